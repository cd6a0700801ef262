"""Progress of long work, on stderr and only where a person is looking at it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from fibrefit.cli.terminal import Terminal, harmless
from fibrefit.core.progress import Progress


@contextmanager
def shown_progress(terminal: Terminal) -> Iterator[Progress]:
    """Line on stderr that follows the work done in the block.

    Parameters
    ----------
    terminal : Terminal
        Quiet ones show nothing, and neither does output that goes to a file.

    Yields
    ------
    callable
        To be called with what is being done and the share that is done.
    """
    if terminal.quiet or not sys.stderr.isatty():
        yield lambda doing, share: None
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
