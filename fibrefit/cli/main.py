"""The command ``fibrefit``: finds the command that was requested, and turns failures into messages and exit codes."""

from __future__ import annotations

import contextvars
import errno
import gc
import importlib
import os
import shlex
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

import click

from fibrefit.cli.terminal import FAULT, INTERRUPTED, say, say_document
from fibrefit.core.errors import FibrefitError, UsageError, did_you_mean
from fibrefit.core.paths import shown_path

#: What a disk says that has no room, or may not be written, and a stream that was closed before the start.
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EBADF)

AT_FIRST, AGAIN = 600_000, 100_000
"""New objects before Python looks for garbage: the packages of a fit and its programs are some 400 000."""

#: Every command and what its line in the help says.
COMMANDS = {
    "init": "Write a study that runs, or the file of an effect of your own.",
    "inspect": "Say what was understood of records or of a study.",
    "simulate": "Compute the response of the model to the conditions of each record.",
    "sweep": "Frequency sweep (forward, backward, from rest) of an inverted pendulum, with stability.",
    "fit": "Identify the parameters by least squares.",
    "sample": "Sample the joint posterior of the parameters, resumably.",
    "predict": "Predict records that a result has not seen, with its values.",
    "discover": "Find what the model lacks, name it, add it.",
    "series": "Ask whether one set of parameters serves all speeds, a law of speed, or values of each record.",
    "batch": "Identify every record or study of a series by itself, hundreds or thousands.",
    "distinguish": "Say which effects the records can distinguish, before or after measuring.",
    "confuse": "Earlier name of distinguish.",
    "plan": "Rank the next records by what they would add.",
    "report": "Put results on one HTML page that needs no other file.",
    "show": "Print the report of a result again.",
    "effects": "List the laws that can be added to a model.",
    "glossary": "Say what the words of the reports mean.",
    "doctor": "Check the installation.",
}

#: Modules of commands that have none of their own name; each is imported when such a command is called.
HOMES = dict.fromkeys(("simulate", "sweep", "fit", "predict", "series", "batch", "distinguish", "plan"), "studies") | {
    "report": "results",
    "show": "results",
    "glossary": "effects",
}
EARLIER_NAMES = {"confuse": "distinguish"}


class Commands(click.Group):
    """Group whose commands are imported one by one, so that help and misspelt words cost nothing."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Command of that name, imported now."""
        if cmd_name not in COMMANDS:
            return None
        name = EARLIER_NAMES.get(cmd_name, cmd_name)
        command: click.Command = getattr(
            importlib.import_module(f"fibrefit.cli.{HOMES.get(name, name)}"), f"{name}_command"
        )
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Command for the first word, or an error that suggests the nearest one."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            near = did_you_mean(args[0], COMMANDS)
            ctx.fail(f'No command "{args[0]}". {near or "There are " + ", ".join(COMMANDS) + "."}')
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Lines of the help, from the table alone."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _print_version(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from fibrefit.core.environment import versions

        say(f"fibrefit {versions()['fibrefit']}", err=False)
        ctx.exit()


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="fibrefit COMMAND --help says the rest. Exit codes: 0 good, 1 fault of the program, 2 usage, "
    "3 data not understood, 4 study not valid, 5 the result failed its checks, 130 interrupted.",
)
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version, help="Version.")
def group() -> None:
    """Identify stiffness, damping and friction of fibre rigs from measured records."""


def run(args: Sequence[str]) -> int:
    """Carry out a command line.

    Parameters
    ----------
    args : sequence of str
        The words after ``fibrefit``.
    """
    try:
        if not all(args):
            do = "Look at what it was made of: a variable without a value names no file."
            raise UsageError("the command line", "an empty word", "a name in its place", do)
        # In a context of its own: what figures were requested holds for this command, not for what follows it.
        carried_out = contextvars.copy_context().run
        return int(carried_out(group.main, args=list(args), prog_name="fibrefit", standalone_mode=False) or 0)
    except click.exceptions.NoArgsIsHelpError as error:
        say(error.format_message())
        return error.exit_code
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        help_line = f"Try '{context.command_path} --help'." if context else ""
        return report_error(error.format_message(), help_line, error.exit_code, args)
    except FibrefitError as error:
        return report_error(error, "", error.exit_code, args)
    except OSError as error:
        refused = _refused_by_the_system(error)
        return report_error(refused, "", refused.exit_code, args) if refused else explain_fault(error, args)
    except MemoryError:
        do = "Close other programs, raise the limit, or cut the records into parts."
        short = UsageError("memory", "is not enough, or limited to less than this takes", "some gigabytes", do)
        return report_error(short, "", short.exit_code, args)
    except (click.Abort, KeyboardInterrupt) as error:
        return report_interruption(error, args)
    except Exception as error:
        return explain_fault(error, args)


def _refused_by_the_system(error: OSError) -> UsageError | None:
    """Message for what a person can mend: a folder that has gone, a full disk, a name no file can have."""
    if error.errno == errno.ENOENT:
        try:
            os.getcwd()
        except OSError:
            do = "Go to another and start again."
            return UsageError("the working folder", "has been removed", "one that exists", do)
    where = shown_path(str(error.filename or "a file"))
    if error.errno == errno.ENAMETOOLONG:
        return UsageError(where, "is longer than the names of files may be", "a shorter one")
    if error.errno in (errno.EACCES, errno.EPERM):
        do = "Look at its permissions."
        return UsageError(where, error.strerror or "cannot be used", "a file or folder that you may use", do)
    if error.errno in FULL:
        return UsageError(where, f"cannot be written: {error.strerror}", "room for it", "Make room and start again.")
    return None


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


def _open_what_is_closed() -> None:
    """Open streams that were closed before the start: the next file to be opened would take their numbers.

    What is written to stdout then fails as on a full disk, since nobody can get the answer; remarks are lost.
    """
    for number, name, mode, flags in (
        (0, "stdin", "r", os.O_RDONLY),
        (1, "stdout", "w", os.O_RDONLY),
        (2, "stderr", "w", os.O_WRONLY),
    ):
        if getattr(sys, name) is None:
            opened = os.open(os.devnull, flags)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115


def with_files(words: Sequence[str]) -> list[str]:
    """Words of a command line with the files that a pattern such as ``drop_*.csv`` names in its place.

    Shells do so themselves, but for that of Windows. What names a file as it stands, or none, stays.
    """
    import glob

    found: list[str] = []
    for word in words:
        files = sorted(glob.glob(word)) if glob.has_magic(word) and not os.path.lexists(word) else []
        found += files or [word]
    return found


def look_for_garbage_late() -> None:
    """Have Python look for garbage seldom: tracing makes hundreds of thousands of objects that stay.

    To look through them took a tenth of a fit; through those of the packages alone, a tenth of a second. The first
    time is therefore later than the others.
    """

    def go_on(phase: str, info: object) -> None:
        if phase == "stop":
            gc.set_threshold(AGAIN, 50, 50)
            gc.callbacks.remove(go_on)

    gc.set_threshold(AT_FIRST, 50, 50)
    gc.callbacks.append(go_on)


def main() -> None:
    """Entry point of the command line."""
    look_for_garbage_late()
    _open_what_is_closed()
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        # A terminal that lacks a letter shows a question mark in its place, and the run goes on; so does one that sends
        # what is none.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    # What a library warns of is said in one line; it may quote a file or a name.
    warnings.showwarning = cast(
        "Any",
        lambda message, category, filename, line, *_: say(
            f"{category.__name__}: {message} ({os.path.basename(filename)}, line {line})"
        ),
    )
    code = run(with_files(sys.argv[1:]) if os.name == "nt" else sys.argv[1:])
    try:
        sys.stdout.flush()
    except OSError:
        # Whoever read our output has stopped reading, or it has no room: what remains is of no use to anybody, and that
        # something is lost has been said.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if code == INTERRUPTED:
        # All is said and kept. A thread that compiles cannot be ended: the interpreter would wait for it, or abort.
        with suppress(OSError, ValueError):
            sys.stderr.flush()
        os._exit(code)
    # To look through all of them for garbage once more, at the very end, took as long as to load the packages.
    gc.freeze()
    sys.exit(code)
