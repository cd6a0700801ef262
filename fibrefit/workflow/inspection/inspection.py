"""What was understood of records, or of a study and its records."""

from __future__ import annotations

import json
import os
import textwrap
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import NO_FILES, FibrefitError, UsageError
from fibrefit.core.formatting import Card, Shown, printable

if TYPE_CHECKING:
    import pandas as pd

    from fibrefit.plots.figures import Figures
    from fibrefit.records import Record, Table
    from fibrefit.study import Study

SCHEMA = "fibrefit/inspection/1"

NOT_CONDITIONS = {"file", "name", "channels", "parts", "beside", "header"}
"""Keys of a record that tell where and how it is read."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What was understood of one file.

    Parameters
    ----------
    lines : list of str
        For a person.
    understood : dict
        For a program.
    table : Table or None
        What the file says, where it could be read.
    refusal : FibrefitError or None
        Why it could not.
    record : Record or None
        What is in it, where it can be used as it is.
    asked : FibrefitError or None
        What has to be said or mended before it can be used.
    missing : bool
        Whether there is no such file.
    """

    lines: list[str]
    understood: dict[str, Any]
    table: Table | None = None
    refusal: FibrefitError | None = None
    record: Record | None = None
    asked: FibrefitError | None = None
    missing: bool = False

    @property
    def verdict(self) -> str:
        """Whether the file can be used."""
        if "refused" in self.understood:
            return "not understood"
        return "not ready" if "not_ready" in self.understood else "understood"


@dataclass(frozen=True, repr=False)
class Inspection(Shown):
    """What was understood.

    Parameters
    ----------
    name : str
    seen : tuple of Seen
        File by file.
    study : Study or None
        None where bare files were inspected.
    bare : tuple of pathlib.Path
        Those.
    """

    name: str
    seen: tuple[Seen, ...]
    study: Study | None = None
    bare: tuple[Path, ...] = ()

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Every file that was read."""
        return self.bare if self.study is None else tuple(self.study.input_files())

    @property
    def tables(self) -> dict[str, Table]:
        """What each file says that could be read, by its name."""
        return _named([each.table for each in self.seen if each.table is not None])

    @property
    def drawn(self) -> dict[str, Table]:
        """Those of which there is a picture: the first ones of many."""
        from fibrefit.plots.figures import MOST_RECORDS

        return dict(list(self.tables.items())[:MOST_RECORDS])

    @property
    def refusals(self) -> tuple[FibrefitError, ...]:
        """Why files could not be read."""
        return tuple(each.refusal for each in self.seen if each.refusal)

    def report(self) -> str:
        """In words."""
        lines = [] if self.study is None else _study_lines(self.study)
        return "\n\n".join("\n".join(part) for part in [lines, *(each.lines for each in self.seen)] if part)

    def document(self) -> dict[str, Any]:
        """For a program."""
        study = self.study
        said = {} if study is None else {"study": study.model_dump(mode="json", by_alias=True, exclude_none=True)}
        return {"schema": SCHEMA, **said, "files": [each.understood for each in self.seen]}

    def to_dataframe(self) -> pd.DataFrame:
        """One row a column of a file: header, unit, samples, range, what is masked."""
        from fibrefit.tables.frames import inspection_frame

        return inspection_frame(self.document())

    def plot(self) -> Figures:
        """One figure a file, of the first ones of many."""
        from fibrefit.plots.figures import Figures
        from fibrefit.plots.table import table_figure

        return Figures({file: table_figure(table) for file, table in self.drawn.items()})

    def save(self, out: Path | str, *, force: bool = False) -> Path:
        """Write ``inspection.json``, ``inspection.txt`` and a picture of each file into a folder.

        Parameters
        ----------
        out : str or pathlib.Path
            Folder, which is made.
        force : bool
            Replace a folder that exists.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        UsageError
            If the folder exists and may not be replaced, or holds what was read.

        Examples
        --------
        >>> fibrefit.load_result(fibrefit.inspect(record.path).save("results/seen")).to_dataframe()["si"].tolist()
        ['N', 'm']
        """
        from fibrefit.core.paths import write_whole
        from fibrefit.plots.save import save_figures
        from fibrefit.store.directory import ResultDirectory, Run

        with ResultDirectory(Path(out), force=force, run=Run(self.inputs)) as directory:
            write_whole(directory.path / "inspection.json", self.content())
            write_whole(directory.path / "inspection.txt", self.report() + "\n")
            if self.drawn:
                save_figures(self.plot(), directory.path / "figures")
        return directory.out

    def content(self) -> str:
        """Text of ``inspection.json``."""
        return json.dumps(self.document(), indent=1, allow_nan=False) + "\n"

    def _card(self) -> Card:
        rows = [(str(one.understood["file"] or "planned"), one.verdict) for one in self.seen]
        unread = sum(verdict != "understood" for _, verdict in rows)
        files = "1 file" if len(rows) == 1 else f"{len(rows)} files"
        line = f"{files}, {f'{unread} of them not ready' if unread else 'ready'} to be used"
        return Card(f'Inspection of "{self.name}"', line, ("file", "verdict"), rows)


def inspect(
    what: str | Path | Study | Collection[str | Path] | Iterator[str | Path], overrides: Sequence[str] = ()
) -> Inspection:
    """Say what is understood of files of measured data, or of a study and its files.

    Parameters
    ----------
    what : str, pathlib.Path, Study, or collection or iterator of paths
        A study (a ``.toml`` or a folder with one), or files.
    overrides : sequence of str
        What the files do not say, as on the command line: ``"units.force=kN"``.

    Returns
    -------
    Inspection
        With ``report()``, ``tables``, ``refusals``, ``to_dataframe()``, ``plot()`` and ``save(folder)``. A file that is
        not understood is no exception here: it is reported with the reason.

    Raises
    ------
    StudyError
        If the study is not valid.
    UsageError
        If an override makes no sense, or no file is named.

    Examples
    --------
    >>> seen = fibrefit.inspect(fibrefit.example("drop_series") / "drop_5mm_90deg.csv")
    >>> seen.to_dataframe()["si"].tolist()
    ['N', 'm']
    """
    # What knows of studies takes as long to load as a file takes to read: bare files do without.
    if not isinstance(what, str | Path | Collection | Iterator):
        return Inspection(what.name, _records_of(what), what)
    paths = [Path(path) for path in ([what] if isinstance(what, str | Path) else what)]
    if not paths:
        raise UsageError("files", *NO_FILES)
    if len(paths) == 1 and (os.path.isdir(paths[0]) or paths[0].suffix.lower() == ".toml"):
        from fibrefit.study import load_study

        study = load_study(paths[0], overrides)
        return Inspection(study.name, _records_of(study), study)
    return Inspection(printable(paths[0].stem), _bare(paths, overrides), bare=tuple(paths))


def _bare(files: Sequence[Path], overrides: Sequence[str]) -> tuple[Seen, ...]:
    arguments: dict[str, Any] = {}
    if overrides:
        from fibrefit.study.reading import reading_of

        arguments = reading_of(overrides)
    return tuple(seen_in(file, arguments) for file in files)


def _records_of(study: Study) -> tuple[Seen, ...]:
    from fibrefit.workflow.readings import readings_of

    seen = []
    for record in study.records:
        if record.file is None:
            seen.append(Seen([f"{record.label}: planned, not measured yet.", *_conditions(record)], {"file": None}))
            continue
        parts, beside = readings_of(study, record)
        own = [seen_in(path, said) for path, said in [*parts, *([beside] if beside else [])]]
        own[0] = replace(own[0], lines=[*own[0].lines, *_conditions(record)])
        if all(one.verdict == "understood" for one in own) and (doubt := _doubt_of(study, record, own)):
            own[0].lines.extend(_wrapped(f"Not ready to be used: {doubt}"))
            own[0].understood["not_ready"] = doubt
        seen += own
    return tuple(seen)


def _doubt_of(study: Study, record: Any, own: Sequence[Seen]) -> str:
    """What the rig has against a record that is understood: its force moves no such weight so; empty for nothing."""
    from fibrefit.workflow.prepare import refused_by_rig

    parts = [one.record for one in own if one.record is not None]
    return refused_by_rig(study, record, parts)


def seen_in(path: Path, arguments: dict[str, Any]) -> Seen:
    """What was understood of a file, and what still keeps it from being used as a record.

    Parameters
    ----------
    path : pathlib.Path
        The file.
    arguments : dict
        What it does not say itself, as `fibrefit.records.ReadOptions` takes it; nothing by default.
    """
    from fibrefit.records import ReadOptions, describe, read_table, record_of

    try:
        table = read_table(path, ReadOptions(**arguments))
    except FibrefitError as error:
        refused = {"file": printable(path.name), "refused": str(error)}
        missing = not os.path.lexists(path)
        return Seen(_wrapped(f"Not understood: {error}"), refused, refusal=error, asked=error, missing=missing)
    lines, understood, record, asked = describe(table), table.understood, None, None
    try:
        record = record_of(table, channels=arguments.get("channels", {}))
    except FibrefitError as error:
        lines += [line for each in error.each() for line in _wrapped(f"Not ready to be used: {each}")]
        understood["not_ready"], asked = str(error), error
    return Seen(lines, understood, table, record=record, asked=asked)


def _study_lines(study: Study) -> list[str]:
    """What the study says, apart from its records."""
    number = len(study.records)
    lines = [f"{study.name}: {study.kind}, {number} record{'' if number == 1 else 's'}."]
    effects = f" with {', '.join(study.model.effects)}" if study.model.effects else ""
    has_fibre = any(key.startswith("fibre") for key in type(study.rig).model_fields)
    lines.append(f"Model: {f'{study.model.tension_law} fibre' if has_fibre else 'base model'}{effects}.")
    for name, table in study.parameters.items():
        said = table.model_dump(exclude_defaults=True)
        lines.append(f"  {name}: " + ", ".join(f"{key} {_plain(value)}" for key, value in said.items()))
    return lines


def _conditions(record: Any) -> list[str]:
    """Conditions of a record, in the units a person would choose."""
    from fibrefit.core.formatting import format_quantity

    said = []
    for name, text in record.model_dump(mode="json", exclude_none=True, exclude=NOT_CONDITIONS).items():
        value, _, unit = str(text).partition(" ")
        shown = format_quantity(float(value), unit) if isinstance(getattr(record, name), float) else str(text)
        said.append(f"{name} {shown}")
    return _wrapped(f"  Conditions: {', '.join(said)}.") if said else []


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, 80, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return " ".join(f"{key} {_plain(part)}" for key, part in value.items())
    return " to ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _named(tables: Sequence[Table]) -> dict[str, Table]:
    """Tables by the name of their file, with its folder where names alone would not tell them apart."""
    stems = [printable(table.path.stem) for table in tables]
    return {
        stem if stems.count(stem) == 1 else printable(str(table.path)): table
        for stem, table in zip(stems, tables, strict=True)
    }
