"""How commands are declared: an option in one line, those that commands have in common, and what a study brings."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from fibrefit.cli.terminal import Terminal, progress_display
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import LARGEST_SEED
from fibrefit.core.paths import FIGURES, figure_formats, nearest_file, refuse_no_text, sha256_of, shown_path

if TYPE_CHECKING:
    from fibrefit.study import Study

#: Where a command that runs the code a study names keeps whether it may.
TRUST = "fibrefit.trust"


def duration(value: Any) -> float:
    """A time such as ``5 min``, in s and at least one; a bare number is in seconds."""
    from fibrefit.core.units import parse_quantity

    try:
        seconds = float(value)
    except ValueError:
        try:
            seconds = parse_quantity(value, "s", "time", error=UsageError)
        except UsageError as error:
            raise click.BadParameter(str(error)) from None
    if not 1.0 <= seconds < float("inf"):
        raise click.BadParameter(f"{value} is not a time of 1 s or more.")
    return seconds


def option(names: str, says: str, kind: Any = bool, default: Any = None, **more: Any) -> click.Option:
    """An option of a command.

    Parameters
    ----------
    names : str
        As typed, with what stands for the value in the help if that is not the type, and the name by which a command
        is given it where it is another one: ``"--set=KEY=VALUE overrides"``.
    says : str
        Its line in the help.
    kind : type
        Of the value; ``bool`` for a flag, ``list`` for one that may be repeated.
    default : object
        Value where it is not given, which the help shows.
    more : object
        Whatever else click takes.
    """
    more |= {"is_flag": True} if kind is bool else {"multiple": True} if kind is list else {"type": kind}
    if default is not None:
        more |= {"default": default, "show_default": True}
    first, *others = names.split()
    name, _, metavar = first.partition("=")
    return click.Option([name, *others], help=says, metavar=metavar or None, **more)


PATH = click.Path(path_type=Path)
FILE_NAME = click.Path(readable=False)
"""Name of a file or a folder: shells complete it; whether it is there, and what it is, a command says itself."""
RIG = option("--rig=KIND", "Kind of rig, for bare records: fibre_mass, pulley_drive, ...", str)
SET = option("--set=KEY=VALUE overrides", "Change the study, repeatable.", list)
TRUST_OPTION = option(
    "--trust",
    "Run the code of laws that the study names (FILE.py:CLASS); only if you know it.",
    expose_value=False,
    is_eager=True,
    callback=lambda context, parameter, value: context.meta.update({TRUST: value}),
)
"""Without it, `study_from` refuses studies that name code to run."""
ROBUST = option("--robust", "Soft-L1 loss for residuals beyond 3 sigma.")
OF_RESULT = (
    option("--out=DIR", "Folder of the result [results/STUDY-HASH].", PATH),
    option("--force", "Replace an earlier result in DIR."),
    option(
        "--seed",
        "Seed of all random numbers; simulate, sweep, distinguish, plan and predict do not depend on it.",
        click.IntRange(0, LARGEST_SEED),
        0,
    ),
    option(
        "--figures=FORMATS",
        "All figures as png, pdf, svg, several with commas, or none.  [default: png, of a fit its overview alone]",
        str,
        expose_value=False,
        callback=lambda context, parameter, text: FIGURES.set(None if text is None else figure_formats(text)),
    ),
)
OF_TERMINAL = (
    option("--json as_json", "One JSON document on stdout, everything else on stderr."),
    option("-q --quiet", "No remarks and no progress."),
    option("-v --verbose", "Show the traceback of a fault.", expose_value=False),
)


def plain_command(name: str, *parameters: click.Parameter) -> Callable[[Callable[..., Any]], click.Command]:
    """A command with these parameters: called with its `Terminal`, and with the value of each by name."""

    def made(command: Callable[..., Any]) -> click.Command:
        @wraps(command)
        def with_terminal(as_json: bool, quiet: bool, **options: Any) -> Any:
            return command(Terminal(as_json, quiet), **options)

        return click.command(name, params=[*parameters, *OF_TERMINAL])(with_terminal)

    return made


class Request(NamedTuple):
    """What every command on a study can be given.

    Parameters
    ----------
    study : Study
        Complete and in SI.
    out : pathlib.Path or None
        Value of ``--out``.
    force : bool
        Whether an earlier result may be replaced.
    """

    study: Study
    out: Path | None
    force: bool
    seed: int = 0

    def folder(self, *settings: str) -> Path:
        """`out`, or ``results/<study>-<hash>`` by the study and the `settings`, which are all else it depends on."""
        from fibrefit.store.directory import default_directory

        digests = [sha256_of(path) for path in self.study.input_files() if os.path.isfile(path)]
        folder = self.out or default_directory(self.study.name, self.study.resolved_toml(), *digests, *settings)
        refuse_no_text(self.study.input_files(), folder)
        return folder

    def reserved(self, *settings: str, files: Sequence[Path] = ()) -> AbstractContextManager[Path]:
        """Block in which the folder of a result is kept for this run, refused before any work is done for it.

        Parameters
        ----------
        settings : str
            As for `folder`.
        files : sequence of pathlib.Path
            Read beside those of the study: none may lie in the folder either.

        Raises
        ------
        UsageError
            If it may not be replaced, cannot be written, or another run is writing it.
        """
        from fibrefit.store import ResultDirectory, Run

        folder = self.folder(*settings)
        return ResultDirectory(folder, force=self.force, run=Run((*self.study.input_files(), *files))).reserved()

    def saved(
        self,
        terminal: Terminal,
        place: AbstractContextManager[Path],
        work: Callable[..., Any],
        more: str = "",
        *,
        tells: bool = True,
    ) -> Any:
        """Result of some work, saved into the folder that is reserved for it, and reported.

        Parameters
        ----------
        place : context manager
            As `reserved` gives it.
        work : callable
            Called with what shows its progress.
        more : str
            What there is to say of the folder besides.
        tells : bool
            Whether progress tells that it is saved.
        """
        with place as folder, progress_display(terminal) as progress:
            found = work(progress=progress)
            if tells:
                progress("drawing and writing", None)
            found.save(folder, force=self.force)
        terminal.report(found)
        terminal.wrote(folder, more)
        return found


def study_command(name: str, *own: click.Parameter) -> Callable[[Callable[..., Any]], click.Command]:
    """A command on a study: called with its `Terminal`, the `Request` that common options make, and its own options.

    Its own arguments stand before the study, its own options before those of the result.
    """

    def made(command: Callable[..., Any]) -> click.Command:
        @wraps(command)
        def with_request(terminal: Terminal, **options: Any) -> Any:
            study = study_from(options.pop("files"), options.pop("rig"), options.pop("overrides"))
            request = Request(study, options.pop("out"), options.pop("force"), options.pop("seed"))
            return command(terminal, request, **options)

        files = click.Argument(["files"], metavar="STUDY | FILE...", nargs=-1, required=True, type=FILE_NAME)
        arguments = [one for one in own if isinstance(one, click.Argument)]
        options = [one for one in own if isinstance(one, click.Option)]
        return plain_command(name, *arguments, files, RIG, SET, TRUST_OPTION, *options, *OF_RESULT)(with_request)

    return made


def study_from(files: Sequence[str], rig: str | None, overrides: Sequence[str]) -> Study:
    """Study the command line names: a study file, a folder with one, or bare records.

    Parameters
    ----------
    files : sequence of str
        One study, or any number of records.
    rig : str or None
        Kind of the rig of bare records.
    overrides : sequence of str
        Values of ``--set``.

    Raises
    ------
    UsageError
        If studies and records are mixed, the kind of rig is missing, or the study names code that nobody trusts.
    StudyError
        If the study is not valid.
    """
    from fibrefit.study import load_study, study_from_files

    studies = [file for file in files if is_study(file)]
    if studies and len(files) > 1:
        raise UsageError(studies[0], f"a study among {len(files)} files", "one study, or bare records", "")
    if studies and rig is not None:
        raise UsageError("--rig", rig, "bare records", "Override the study with --set rig.kind instead.")
    if studies:
        study = load_study(studies[0], overrides)
    elif lost := next((file for file in files if not os.path.exists(file)), None):
        do = nearest_file(Path(lost)) or "Check the path."
        raise UsageError(shown_path(lost), "no such file or folder", "a study, or records", do)
    elif rig is None:
        raise UsageError(files[0], "a record, and no --rig", "a study, or the kind of rig", "Add --rig fibre_mass.")
    else:
        study = study_from_files(files, rig, overrides)
    check_trust(study, overrides)
    return study


def is_study(file: str) -> bool:
    """Whether a word of the command line names a study rather than a record."""
    return os.path.isdir(Path(file)) or Path(file).suffix.lower() == ".toml"


def check_trust(study: Study, overrides: Sequence[str] = ()) -> None:
    """Refuse a study that names code to run, unless the command line says ``--trust`` or names that code itself.

    Raises
    ------
    UsageError
        Naming the file.
    """
    from fibrefit.study.overrides import parse

    context = click.get_current_context(silent=True)
    if context is None or context.meta.get(TRUST) is not False:
        return  # trusted, or the command runs none
    # Effects that the command line names, each as a whole: part of a name trusts nothing.
    named = set(context.params.get("also", ()))
    for override in overrides:
        keys, value = parse(override)
        if keys == ["model"] and isinstance(value, dict):
            keys, value = ["model", "effects"], value.get("effects")
        if keys[:2] == ["model", "effects"]:
            named.update(one for one in (value if isinstance(value, list) else [value]) if isinstance(one, str))
    for effect, file in study.own_effects().items():
        if effect not in named:
            got, expected = (
                f'"{effect}" is code that would be run: {file}',
                "a law of the catalogue, or a study you trust",
            )
            do = "Look into that file; then add --trust."
            raise UsageError(f"{study.source}, model.effects", got, expected, do)


def check_trust_of_result(result: Path) -> None:
    """Refuse a result whose study names code to run, as `check_trust` does; one that holds no study is left alone."""
    from fibrefit.store.summary import folder_of_result
    from fibrefit.study import load_study

    file = folder_of_result(result) / "study.toml"
    if os.path.isfile(file):
        check_trust(load_study(file, all_missing=True))
