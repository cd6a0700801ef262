"""Progress of long work, on stderr."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from fibrefit.cli.terminal import Terminal, say
from fibrefit.core.formatting import harmless
from fibrefit.core.limits import Progress, quiet

EVERY = 30.0
"""Seconds between two lines where no person is looking: a log says where the work stands."""


@contextmanager
def shown_progress(terminal: Terminal) -> Iterator[Progress]:
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
        with _logged() as tell:
            yield tell
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
def _logged() -> Iterator[Progress]:
    """Progress as lines of a log, from a thread of its own: work may say nothing for long."""
    began, ended, now = time.monotonic(), threading.Event(), {"doing": "beginning", "share": ""}

    def follow(doing: str, share: float | None) -> None:
        now.update(doing=doing, share="" if share is None else f", {100.0 * share:.0f} %")

    def write() -> None:
        while not ended.wait(EVERY):
            say(f"{time.monotonic() - began:6.0f} s: {now['doing']}{now['share']}")

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield follow
    finally:
        ended.set()
        writer.join()
