"""``fibrefit inspect``: what was understood of records, or of a study and its records."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fibrefit.cli.options import FILE_NAME, PATH, is_study, option, plain_command, study_from
from fibrefit.cli.terminal import Terminal, as_typed
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError, UsageError

if TYPE_CHECKING:
    from fibrefit.workflow.inspection.inspection import Inspection, Seen

_POSSIBLE = (
    ("units.force", '"kN"'),
    ("channels.force", '"{heading}"'),
    ("channels.force", '{{ column = "{heading}", unit = "V", scale = "-200 N/V" }}'),
    ("files.sampling_rate", '"2 kHz"'),
    ("files.delimiter", '";"'),
    ("files.columns", '["time [s]", "force [N]", "position [mm]"]'),
)
"""Keys and values that say what a file does not: shown where its message advises nothing."""
_TEXT = r'"[^"\n]*"'
_SETTING = re.compile(
    rf"\b(?P<key>\w+) = (?P<value>{_TEXT}|\{{(?:[^{{}}\"\n]|{_TEXT})*\}}|\[(?:{_TEXT}(?:, )?)*\])"
    r"|under \[(?P<table>channels|units|files)\]"
)
"""A key with its value, or the table it belongs to, in the advice of a message."""
_IN_FILES = ("sampling_rate", "delimiter", "decimal", "columns", "header")


@plain_command(
    "inspect",
    click.Argument(["files"], metavar="STUDY | FILE...", nargs=-1, required=True, type=FILE_NAME),
    option("--set=KEY=VALUE overrides", "Such as units.force=kN, repeatable.", list),
    option("--force", "Replace an earlier inspection in DIR, or the study at --write."),
    option(
        "--out=DIR",
        "Folder for pictures; on a terminal they are drawn without it too [results/inspect_NAME-HASH].",
        PATH,
    ),
    option("--write=STUDY", "Write what was understood as a study.", PATH),
    option("--rig=KIND", "Kind of rig of the study at --write: fibre_mass, pulley_drive, ...", str),
)
def inspect_command(
    terminal: Terminal,
    files: tuple[str, ...],
    overrides: tuple[str, ...],
    force: bool,
    out: Path | None,
    write: Path | None,
    rig: str | None,
) -> int:
    """Say what was understood of records or of STUDY: columns, units, rate, gaps, damage.

    The exit code is 3 where a file is not understood or not ready to be used.
    """
    if rig is not None and write is None:
        raise UsageError(f"--rig {rig}", "no study to write", "--write STUDY beside it")
    if out is not None:
        from fibrefit.store.directory import ResultDirectory

        ResultDirectory(out, force=force).check()
    from fibrefit.study.draft import split_overrides
    from fibrefit.workflow.inspection.inspection import inspect

    bare = not any(is_study(file) for file in files)
    reading = overrides if write is None else tuple(split_overrides(overrides)[0])
    found = inspect(files, reading) if bare else inspect(study_from(files, None, overrides))
    if not terminal.json:
        terminal.answer(found.report(), found.document())
    if bare and (hint := _hint(found.seen)):
        terminal.remark(hint)
    if write is not None:
        from fibrefit.workflow.inspection.write_study import write_study

        unstated = write_study(found, write, rig, overrides, force=force)
        more = f" Still to be stated in it, under [rig]: {', '.join(unstated)}." if unstated else ""
        terminal.remark(f"\nThe study is in {write}.{more} Then: {as_typed('fibrefit', 'fit', str(write))}")
    if out is not None:
        _keep(terminal, found, out, force)
    elif found.tables and sys.stdout.isatty() and write is None:
        from fibrefit.store.directory import default_directory

        try:
            # A folder named after its content may be written again: it will hold the same.
            _keep(terminal, found, default_directory(f"inspect {found.name}", found.content()), force=True)
        except UsageError as error:  # records may lie where nobody can write, and nobody asked for pictures
            terminal.remark(f"\nNo pictures were drawn: {error}")
    if terminal.json:  # one document: this, or what could not be written and why
        terminal.answer(found.report(), found.document())
    not_ready = [DataError.exit_code for each in found.seen if each.verdict == "not ready"]
    return max([refusal.exit_code for refusal in found.refusals] + not_ready, default=0)


def _keep(terminal: Terminal, found: Inspection, folder: Path, force: bool) -> None:
    """Write an inspection into a folder, and say what lies there."""
    found.save(folder, force=force)
    number, drawn = len(found.tables), len(found.drawn)
    which = f"Pictures of the first {drawn} of {number} files" if drawn < number else "Pictures"
    terminal.remark(f"\n{which} are in {folder / 'figures'}." if drawn else f"\nWhat was said is in {folder}.")


def _hint(seen: Sequence[Seen]) -> str:
    """How to say on the command line what files do not say; empty where nothing that could be said would help."""
    asked = [(one, each) for one in seen if one.asked is not None and not one.missing for each in one.asked.each()]
    # Options that say what a message advises to write into a study; ".." stands for what a person alone knows.
    advised = []
    for _, error in asked:
        found = list(_SETTING.finditer(error.do))
        for i, one in enumerate(found):
            tables = [other["table"] for other in (*found[i:], *reversed(found[:i])) if other["table"]]
            known = _IN_FILES if tables[:1] == ["files"] else ROLES
            if tables and one["key"] in known:
                advised.append(_typed(f"{tables[0]}.{one['key']}", one["value"]))
    if advised:
        left_open = any(".." in line for line in advised)
        said = 'with what belongs there in place of ".."' if left_open else "such as"
        return "\n  ".join([f"\nOn the command line, {said}:", *dict.fromkeys(advised)])
    silent = next((one for one, error in asked if not error.do), None)
    if silent is None:
        return ""
    headings = [] if silent.table is None else [column.header for column in silent.table.columns]
    heading = next((text for text in headings if text and '"' not in text), "F_Seil")
    lines = [_typed(key, value.format(heading=heading) if "{" in value else value) for key, value in _POSSIBLE]
    return "\n  ".join(["\nWhat a file does not say can be said for it:", *lines])


def _typed(key: str, value: str) -> str:
    """An override as it is typed in a shell: plain text needs no quotes of TOML."""
    from fibrefit.study.overrides import parse

    text = value[1:-1]
    plain = value.startswith('"') and parse(f"{key}={text}")[1] == text
    if plain and re.fullmatch(r"[\w./+-]+", text):
        return f"--set {key}={text}"
    if plain and not set(text) & set('"$`\\!'):
        return f'--set {key}="{text}"'
    return as_typed("--set", f"{key}={value}")
