"""Ctrl-C in long work: the first time it is requested to conclude, the second time it is ended."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from fibrefit.cli.terminal import Terminal


@contextmanager
def stop_requested(terminal: Terminal) -> Iterator[Callable[[], bool]]:
    """Block in which the first Ctrl-C only sets a mark, which the work is to look at.

    Parameters
    ----------
    terminal : Terminal
        Where it says how it goes on.
    """
    requested = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield requested.is_set
        return

    def first(number: int, frame: Any) -> None:
        if requested.is_set():
            raise KeyboardInterrupt
        requested.set()
        terminal.remark("Interrupted: concluding with what there is. Ctrl-C again ends at once.")

    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        # Begun by a job script, or with nohup: whoever did so does not want it interrupted.
        yield requested.is_set
        return
    before = signal.signal(signal.SIGINT, first)
    try:
        yield requested.is_set
    finally:
        signal.signal(signal.SIGINT, before)
