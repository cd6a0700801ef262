"""What a person, or a program that requested JSON, gets when a command fails."""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fibrefit.cli.terminal import say, say_document
from fibrefit.core.errors import FibrefitError

FAULT, INTERRUPTED = 1, 130


def report_error(error: FibrefitError | str, hint: str, code: int, args: Sequence[str]) -> int:
    """Say what is wrong with a command line or a file.

    Parameters
    ----------
    error : FibrefitError or str
        The message.
    hint : str
        Where to find more; may be empty.
    code : int
        Exit code.
    args : sequence of str
        The command line.
    """
    say(" ".join(filter(None, [f"error: {error}", *getattr(error, "__notes__", ()), hint])))
    _answer_in_json(error, code, args)
    return code


def report_interruption(error: BaseException, args: Sequence[str]) -> int:
    """Say that the run was interrupted, and what of it was kept."""
    # click puts an exception of its own in place of the interruption, which then is its cause.
    notes = [note for e in (error, error.__cause__, error.__context__) for note in getattr(e, "__notes__", ())]
    message = " ".join(["Interrupted.", *(dict.fromkeys(notes) or ["Nothing was written."])])
    say(message)
    _answer_in_json(message, INTERRUPTED, args)
    return INTERRUPTED


def explain_fault(error: Exception, args: Sequence[str]) -> int:
    """Write the traceback of a fault of the program, with all that is needed to look into it, and say where it is."""
    from fibrefit.core.environment import cache_directory, versions

    trace, now = "".join(traceback.format_exception(error)), datetime.now(UTC)
    kept: Path | None = None
    with suppress(OSError):  # of a folder that cannot be written, or a working folder that has gone
        path = cache_directory() / "logs" / f"{now:%Y%m%d-%H%M%S}-{os.getpid()}.log"
        facts = [f"{now.isoformat()}  fibrefit {shlex.join(args)}", f"in {Path.cwd()}, {sys.executable}"]
        facts += [f"{name} {version}" for name, version in versions().items()]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join([*facts, "", trace]), encoding="utf-8")
        kept = path
    what = str(error).strip().partition("\n")[0] or "no message"
    message = " ".join([f"fault in the program: {type(error).__name__}: {what}", *getattr(error, "__notes__", ())])
    say(f"{message} The traceback is in {kept}." if kept else message)
    if kept is None or {"-v", "--verbose"} & set(args):
        say(trace)
    _answer_in_json(message, FAULT, args)
    return FAULT


def _answer_in_json(error: FibrefitError | str, code: int, args: Sequence[str]) -> None:
    """Give a program that requested JSON its one document, also when there is no result."""
    if "--json" not in args:
        return
    content: dict[str, Any] = {"message": str(error)}
    if isinstance(error, FibrefitError):
        content |= _parts(error)
    with suppress(FibrefitError, OSError):  # where stdout takes nothing, the message has been said on stderr
        say_document({"schema": "fibrefit/error/1", "exit_code": code, "error": content})


def _parts(error: FibrefitError) -> dict[str, Any]:
    """What a message is made of; with all that is told below it, where it tells more than one mistake."""
    parts: dict[str, Any] = {"where": error.where, "got": error.got, "expected": error.expected, "do": error.do}
    return parts | ({"further": [_parts(each) for each in error.further]} if error.further else {})
