"""``fibrefit inspect``: what was understood of records, or of a study and its records."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fibrefit.cli.options import is_study, study_from
from fibrefit.cli.terminal import Terminal, with_terminal
from fibrefit.core.errors import FibrefitError

if TYPE_CHECKING:
    from fibrefit.records import Table
    from fibrefit.study import Study

SCHEMA = "fibrefit/inspection/1"

HINT = """
What a file does not say can be said for it:
  --set units.force=kN
  --set channels.force="F_Seil"
  --set channels.force='{ column = "U1", unit = "V", scale = "-200 N/V" }'
  --set files.sampling_rate="2 kHz"
  --set files.delimiter=";"
  --set files.columns='["time [s]", "force [N]", "position [mm]"]'"""


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
    """

    lines: list[str]
    understood: dict[str, Any]
    table: Table | None = None
    refusal: FibrefitError | None = None


@click.command("inspect")
@click.argument("files", metavar="STUDY | FILE...", nargs=-1, required=True)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Such as units.force=kN, repeatable.")
@click.option("--force", is_flag=True, help="Replace an earlier inspection in DIR.")
@click.option(
    "--out", metavar="DIR", type=click.Path(path_type=Path), help="Folder for the pictures [results/inspect_NAME-HASH]."
)
@with_terminal
def command(
    terminal: Terminal, files: tuple[str, ...], overrides: tuple[str, ...], force: bool, out: Path | None
) -> int:
    """Say what was understood of records or of STUDY: columns, units, rate, gaps, damage."""
    from fibrefit.store.directory import ResultDirectory

    if out is not None:
        ResultDirectory(out, force=force).check()
    document: dict[str, Any] = {"schema": SCHEMA}
    if any(is_study(file) for file in files):
        study = study_from(files, None, overrides)
        name, lines, seen = study.name, _study_lines(study), _records_of(study)
        document["study"] = study.model_dump(mode="json", by_alias=True, exclude_none=True)
    else:
        name, lines, seen = Path(files[0]).stem, [], _bare(files, overrides)
    document["files"] = [each.understood for each in seen]
    text = "\n\n".join("\n".join(part) for part in [lines, *(each.lines for each in seen)] if part)
    terminal.answer(text, document)
    if not document.get("study") and any({"refused", "not_ready"} & each.understood.keys() for each in seen):
        terminal.remark(HINT)
    tables = _named([each.table for each in seen if each.table is not None])
    if tables:
        kept = _keep(name, out, force, text, document, tables)
        terminal.remark(f"\nPictures are in {kept / 'figures'}.")
    return max((each.refusal.exit_code for each in seen if each.refusal), default=0)


def _bare(files: Sequence[str], overrides: Sequence[str]) -> list[Seen]:
    from fibrefit.study.reading import reading_of

    arguments = reading_of(overrides)
    return [_seen(Path(file), arguments) for file in files]


def _records_of(study: Study) -> list[Seen]:
    seen = []
    for record in study.records:
        if record.file is None:
            seen.append(Seen([f"{record.label}: planned, not measured yet.", *_conditions(record)], {"file": None}))
            continue
        one = _seen(study.path_of(record.file), study.reading(record))
        seen.append(Seen([*one.lines, *_conditions(record)], one.understood, one.table, one.refusal))
    return seen


def _seen(path: Path, arguments: dict[str, Any]) -> Seen:
    """What was understood of a file, and what still keeps it from being used as a record."""
    from fibrefit.records import ReadOptions, describe, read_table, record_of

    try:
        table = read_table(path, ReadOptions(**arguments))
    except FibrefitError as error:
        return Seen(_wrapped(f"Not understood: {error}"), {"file": path.name, "refused": str(error)}, refusal=error)
    lines, understood = describe(table), table.understood
    try:
        record_of(table, channels=arguments["channels"])
    except FibrefitError as error:
        lines += _wrapped(f"Not ready to be used: {error}")
        understood["not_ready"] = str(error)
    return Seen(lines, understood, table)


def _study_lines(study: Study) -> list[str]:
    """What the study says, apart from its records."""
    number = len(study.records)
    lines = [f"{study.name}: {study.kind}, {number} record{'' if number == 1 else 's'}."]
    effects = f" with {', '.join(study.model.effects)}" if study.model.effects else ""
    lines.append(f"Model: {study.model.tension_law} fibre{effects}.")
    for name, table in study.parameters.items():
        said = table.model_dump(exclude_defaults=True)
        lines.append(f"  {name}: " + ", ".join(f"{key} {_plain(value)}" for key, value in said.items()))
    return lines


def _conditions(record: Any) -> list[str]:
    """Conditions of a record, in the units a person would choose."""
    from fibrefit.core.units import format_quantity

    said = []
    for name, text in record.model_dump(mode="json", exclude_none=True, exclude={"file", "name", "channels"}).items():
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
    stems = [table.path.stem for table in tables]
    return {
        stem if stems.count(stem) == 1 else str(table.path): table for stem, table in zip(stems, tables, strict=True)
    }


def _keep(
    name: str, out: Path | None, force: bool, text: str, document: dict[str, Any], tables: dict[str, Table]
) -> Path:
    """Write what was understood, with a picture of each file; the folder it was written to."""
    import json

    from fibrefit.plots import save_figures, table_figure
    from fibrefit.store.directory import ResultDirectory, default_directory
    from fibrefit.store.files import write_whole

    content = json.dumps(document, indent=1, allow_nan=False) + "\n"
    # A folder named after its content may be written again: it will hold the same.
    folder = out or default_directory(f"inspect {name}", content)
    with ResultDirectory(folder, force=force or out is None) as directory:
        write_whole(directory.path / "inspection.json", content)
        write_whole(directory.path / "inspection.txt", text + "\n")
        save_figures({file: table_figure(table) for file, table in tables.items()}, directory.path / "figures")
    return folder
