"""Options that commands working on a study have in common."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import click

from fibrefit.cli.terminal import Terminal, with_terminal
from fibrefit.core.limits import LARGEST_SEED
from fibrefit.core.paths import is_folder, is_plain_file, nearest_file, shown_path

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from fibrefit.study import Study

Command = TypeVar("Command", bound=Callable[..., Any])


class Duration(click.ParamType):
    """A time such as ``5 min``, in s; a bare number is in seconds."""

    name = "TIME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Number of seconds, at least one."""
        from fibrefit.core.errors import UsageError
        from fibrefit.core.units import parse_quantity

        try:
            seconds = float(value)
        except ValueError:
            try:
                seconds = parse_quantity(value, "s", "time", error=UsageError)
            except UsageError as error:
                self.fail(str(error), param, ctx)
        if not 1.0 <= seconds < float("inf"):
            self.fail(f"{value} is not a time of 1 s or more.", param, ctx)
        return seconds


#: Where a command that runs the code a study names keeps whether it may.
TRUST = "fibrefit.trust"


def trust_option(command: Command) -> Command:
    """Give a command ``--trust``: without it, `study_from` refuses studies that name code to run."""

    def remember(context: click.Context, option: click.Parameter, value: bool) -> None:
        context.meta[TRUST] = value

    option = click.option(
        "--trust", is_flag=True, expose_value=False, callback=remember, is_eager=True,
        help="Run the code of laws that the study names (FILE.py:CLASS); only if you know it.",
    )  # fmt: skip
    return option(command)


class FileName(click.ParamType):
    """Name of a file or a folder: shells complete it; whether it is there, and what it is, a command says itself."""

    name = "path"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """What the shell knows of files."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


def study_options(command: Command) -> Command:
    """Give a command its files, ``--rig``, ``--set`` and ``--trust``."""
    for option in (
        trust_option,
        click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change the study, repeatable."),
        click.option("--rig", metavar="KIND", help="Kind of rig, for bare records: fibre_mass, pulley_drive, ..."),
        click.argument("files", metavar="STUDY | FILE...", nargs=-1, required=True, type=FileName()),
    ):
        command = option(command)
    return command


def result_options(command: Command) -> Command:
    """Give a command ``--out``, ``--force``, ``--seed`` and ``--figures``."""
    for option in (
        click.option(
            "--figures",
            metavar="FORMATS",
            expose_value=False,
            callback=_keep_formats,
            help="All figures as png, pdf, svg, several with commas, or none.  "
            "[default: png, of a fit its overview alone]",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0, LARGEST_SEED),
            default=0,
            show_default=True,
            help="Seed of all random numbers; simulate, sweep, distinguish, plan and predict do not depend on it.",
        ),
        click.option("--force", is_flag=True, help="Replace an earlier result in DIR."),
        click.option(
            "--out", metavar="DIR", type=click.Path(path_type=Path), help="Folder of the result [results/STUDY-HASH]."
        ),
    ):
        command = option(command)
    return command


def _keep_formats(context: click.Context, parameter: click.Parameter, text: str | None) -> None:
    """Tell all that is written from now on as which files figures are requested."""
    from fibrefit.core.paths import FIGURES, figure_formats

    FIGURES.set(None if text is None else figure_formats(text))


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
    study = _named_study(files, rig, overrides)
    check_trust(study, overrides)
    return study


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
        from fibrefit.core.paths import refuse_no_text, sha256_of
        from fibrefit.store.directory import default_directory

        digests = [sha256_of(path) for path in self.study.input_files() if is_plain_file(path)]
        folder = self.out or default_directory(self.study.name, self.study.resolved_toml(), *digests, *settings)
        refuse_no_text(self.study.input_files(), folder)
        return folder

    @contextmanager
    def reserved(self, *settings: str, files: Sequence[Path] = ()) -> Iterator[Path]:
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
        with ResultDirectory(folder, force=self.force, run=Run((*self.study.input_files(), *files))).reserved():
            yield folder


def study_command(name: str) -> Callable[[Callable[..., Any]], click.Command]:
    """A command on a study: called with its `Terminal`, the `Request` that common options make, and options of its own.

    Its own arguments stand before the study, its own options before those of the result.
    """

    def made(command: Callable[..., Any]) -> click.Command:
        own = command.__dict__.pop("__click_params__", [])

        @wraps(command)
        def with_request(terminal: Terminal, **options: Any) -> Any:
            study = study_from(options.pop("files"), options.pop("rig"), options.pop("overrides"))
            request = Request(study, options.pop("out"), options.pop("force"), options.pop("seed"))
            return command(terminal, request, **options)

        # Click reads parameters from the last to the first.
        common: Any = result_options(with_terminal(with_request))
        common.__click_params__ += [one for one in own if isinstance(one, click.Option)]
        common = study_options(common)
        common.__click_params__ += [one for one in own if isinstance(one, click.Argument)]
        return click.command(name)(common)

    return made


def check_trust(study: Study, overrides: Sequence[str] = ()) -> None:
    """Refuse a study that names code to run, unless the command line says ``--trust`` or names that code itself.

    Raises
    ------
    UsageError
        Naming the file.
    """
    from fibrefit.core.errors import UsageError

    context = click.get_current_context(silent=True)
    if context is None or context.meta.get(TRUST) is not False:
        return  # trusted, or the command runs none
    named = {*context.params.get("also", ()), *_effects_of(overrides)}
    for effect, file in study.own_effects().items():
        if effect not in named:
            raise UsageError(
                f"{study.source}, model.effects", f'"{effect}" is code that would be run: {file}',
                "a law of the catalogue, or a study you trust",
                "Look into that file; then add --trust.",
            )  # fmt: skip


def _effects_of(overrides: Sequence[str]) -> set[str]:
    """Names of effects that overrides put into a study, each as a whole: part of a name trusts nothing."""
    from fibrefit.study.overrides import parse

    found: set[str] = set()
    for override in overrides:
        keys, value = parse(override)
        if keys == ["model"] and isinstance(value, dict):
            keys, value = ["model", "effects"], value.get("effects")
        if keys[:2] == ["model", "effects"]:
            found.update(one for one in (value if isinstance(value, list) else [value]) if isinstance(one, str))
    return found


def check_trust_of_result(result: Path) -> None:
    """Refuse a result whose study names code to run, as `check_trust` does; one that holds no study is left alone."""
    from fibrefit.store.summary import folder_of_result
    from fibrefit.study import load_study

    file = folder_of_result(result) / "study.toml"
    if is_plain_file(file):
        check_trust(load_study(file, all_missing=True))


def _named_study(files: Sequence[str], rig: str | None, overrides: Sequence[str]) -> Study:
    from fibrefit.core.errors import UsageError
    from fibrefit.study import load_study, study_from_files

    studies = [file for file in files if is_study(file)]
    if studies and len(files) > 1:
        raise UsageError(studies[0], f"a study among {len(files)} files", "one study, or bare records", "")
    if studies and rig is not None:
        raise UsageError("--rig", rig, "bare records", "Override the study with --set rig.kind instead.")
    if studies:
        return load_study(studies[0], overrides)
    if lost := next((file for file in files if not os.path.exists(file)), None):
        do = nearest_file(Path(lost)) or "Check the path."
        raise UsageError(shown_path(lost), "no such file or folder", "a study, or records", do)
    if rig is None:
        raise UsageError(files[0], "a record, and no --rig", "a study, or the kind of rig", "Add --rig fibre_mass.")
    return study_from_files(files, rig, overrides)


def is_study(file: str) -> bool:
    """Whether a word of the command line names a study rather than a record."""
    return is_folder(Path(file)) or Path(file).suffix.lower() == ".toml"
