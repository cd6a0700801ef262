"""What a command says and where: its answer on stdout, all else on stderr; its progress, and what Ctrl-C asks of it."""

from __future__ import annotations

import json
import os
import shlex
import signal
import sys
import threading
import time
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from fibrefit.core.errors import UsageError
from fibrefit.core.formatting import harmless, printable
from fibrefit.core.limits import Progress, quiet

FAULT, NOT_TRUSTED, INTERRUPTED = 1, 5, 130
"""Exit codes: of a fault of the program, of a result that is not to be used, of a command that was interrupted."""


@dataclass(frozen=True, slots=True)
class Terminal:
    """Output of a command.

    Parameters
    ----------
    json : bool
        Whether the answer is one JSON document, for a program.
    quiet : bool
        Whether remarks and progress are left out.
    """

    json: bool = False
    quiet: bool = False

    def answer(self, text: str, document: Any) -> None:
        """Give the result of the command.

        Parameters
        ----------
        text : str
            For a person.
        document : object
            For a program; anything that JSON can hold.
        """
        if self.json:
            # Escapes keep the document whole on any terminal; a number that is none would not be JSON.
            say_document(document)
        else:
            say(spelt(text, sys.stdout.encoding), err=False)

    def report(self, found: Any) -> None:
        """Give a result that has a report and a summary."""
        self.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))

    def remark(self, text: str) -> None:
        """Say something beside the answer."""
        if not self.quiet:
            say(text)

    def wrote(self, folder: Path, more: str = "") -> None:
        """Say what lies in the folder of a result, the summary first and folders last.

        Parameters
        ----------
        more : str
            What there is to say of it besides.
        """
        paths = sorted(folder.iterdir(), key=lambda path: (path.is_dir(), path.name != "summary.json", path.name))
        names = [path.name for path in paths if not path.name.startswith(".")]
        self.remark(f"\nWritten to {folder}: {', '.join(names)}.{more}")

    def made(self, folder: Path | None) -> None:
        """Say that a folder did not exist and was made, if one was: a name may have been misspelt.

        Parameters
        ----------
        folder : pathlib.Path or None
            As `first_missing` found it before.
        """
        if folder is not None and os.path.isdir(folder):
            self.remark(f"The folder {folder} did not exist and was made.")


def first_missing(folder: Path) -> Path | None:
    """The uppermost folder on the way to `folder` that does not exist; None where all do."""
    missing = [path for path in (folder, *folder.parents) if not os.path.exists(path)]
    return missing[-1] if missing else None


def say(text: str, *, err: bool = True, newline: bool = True) -> None:
    """Write to the terminal: the only way there, so that nothing from files or names can steer it.

    Parameters
    ----------
    err : bool
        On stderr.
    newline : bool
        Whether the line ends with it.
    """
    _write(harmless(printable(text)), err, newline)


def say_document(document: Any) -> None:
    """Write one JSON document to stdout; it is all ASCII, with whatever steers a terminal escaped."""
    text = json.dumps(document, indent=1, allow_nan=False)
    _write(text.replace("\x7f", "\\u007f"), err=False)


def _write(text: str, err: bool, newline: bool = True) -> None:
    try:
        click.echo(text, err=err, nl=newline)
    except BrokenPipeError:
        raise  # whoever read it has stopped; the entry point knows
    except OSError as error:
        if not err:
            why = error.strerror or "no reason given"
            raise UsageError(
                "the answer", f"cannot be written to stdout: {why}", "room for it", "The result itself is whole."
            ) from None
        # Where nothing can be said, the work goes on all the same.


def spelt(text: str, encoding: str | None) -> str:
    """Text with the Greek letters that an encoding lacks written as their names.

    Parameters
    ----------
    text : str
        Any text.
    encoding : str or None
        Encoding of the terminal, e.g. ``"cp1252"``.

    Returns
    -------
    str
        ``"k e (1 + eta e)"`` where there is no eta.
    """

    def letter(sign: str) -> str:
        try:
            sign.encode(encoding or "ascii")
        except UnicodeEncodeError:
            name = unicodedata.name(sign, "")
            return name.rpartition(" ")[2].lower() if name.startswith("GREEK SMALL LETTER") else sign
        return sign

    return text if text.isascii() else "".join(map(letter, text))


def as_typed(*words: str, windows: bool = os.name == "nt") -> str:
    """Words as they are typed on a command line of this system: a name with blanks in it is one word.

    Parameters
    ----------
    windows : bool
        Whether to double quotes, which are all that its command line knows; this system's unless said.
    """
    from subprocess import list2cmdline  # half a hundredth of a second, where a command is told at all

    return list2cmdline(words) if windows else shlex.join(words)


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
