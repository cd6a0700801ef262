"""Long work: its progress on stderr, and Ctrl-C, which at first requests it to conclude and then ends it."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from fibrefit.cli.terminal import Terminal, say
from fibrefit.core.formatting import harmless
from fibrefit.core.limits import Progress, quiet

EVERY = 30.0
"""Seconds between two lines where no person is looking: a log says where the work stands."""


@contextmanager
def progress_display(terminal: Terminal) -> Iterator[Progress]:
    """Line on stderr that follows the work done in the block; a line each `EVERY` seconds where stderr is a file.

    Parameters
    ----------
    terminal : Terminal
        Quiet ones show nothing.
    """
    if terminal.quiet:
        yield quiet
        return
    if not sys.stderr.isatty():
        # Lines of a log, from a thread of its own: work may say nothing for long.
        began, ended, now = time.monotonic(), threading.Event(), {"doing": "beginning", "share": ""}

        def note(doing: str, share: float | None) -> None:
            now.update(doing=doing, share="" if share is None else f", {100.0 * share:.0f} %")

        def write() -> None:
            while not ended.wait(EVERY):
                say(f"{time.monotonic() - began:6.0f} s: {now['doing']}{now['share']}")

        writer = threading.Thread(target=write, daemon=True)
        writer.start()
        try:
            yield note
        finally:
            ended.set()
            writer.join()
        return
    from rich import progress
    from rich.console import Console

    columns = (
        progress.SpinnerColumn("line"),
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(),
        progress.TimeElapsedColumn(),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def follow(doing: str, share: float | None) -> None:
            bar.update(task, description=harmless(doing), total=None if share is None else 1.0, completed=share or 0.0)

        yield follow


@contextmanager
def stop_requested(terminal: Terminal) -> Iterator[Callable[[], bool]]:
    """Block in which the first Ctrl-C only sets a mark, which the work is to look at.

    Parameters
    ----------
    terminal : Terminal
        Where it says how it goes on.
    """
    requested = threading.Event()
    # A signal reaches the main thread alone; who began this by a job script, or with nohup, wants no interruption.
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        yield requested.is_set
        return

    def first(number: int, frame: Any) -> None:
        if requested.is_set():
            raise KeyboardInterrupt
        requested.set()
        terminal.remark("Interrupted: concluding with what there is. Ctrl-C again ends at once.")

    before = signal.signal(signal.SIGINT, first)
    try:
        yield requested.is_set
    finally:
        signal.signal(signal.SIGINT, before)
