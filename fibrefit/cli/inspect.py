"""``fibrefit inspect``: what was understood of records, or of a study and its records."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from fibrefit.cli.options import is_study, study_from
from fibrefit.cli.terminal import Terminal, with_terminal

HINT = """
What a file does not say can be said for it:
  --set units.force=kN
  --set channels.force="F_Seil"
  --set channels.force='{ column = "U1", unit = "V", scale = "-200 N/V" }'
  --set files.sampling_rate="2 kHz"
  --set files.delimiter=";"
  --set files.columns='["time [s]", "force [N]", "position [mm]"]'"""


@click.command("inspect")
@click.argument("files", metavar="STUDY | FILE...", nargs=-1, required=True)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Such as units.force=kN, repeatable.")
@click.option("--force", is_flag=True, help="Replace an earlier inspection in DIR, or the study at --write.")
@click.option(
    "--out",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Folder for pictures; on a terminal they are drawn without it too [results/inspect_NAME-HASH].",
)
@click.option("--write", metavar="STUDY", type=click.Path(path_type=Path), help="Write what was understood as a study.")
@click.option("--rig", metavar="KIND", help="Kind of rig of the study at --write: fibre_mass, pulley_drive, ...")
@with_terminal
def command(terminal: Terminal, files: tuple[str, ...], **options: Any) -> int:
    """Say what was understood of records or of STUDY: columns, units, rate, gaps, damage."""
    overrides, force, out, write = (options[key] for key in ("overrides", "force", "out", "write"))
    if options["rig"] is not None and write is None:
        from fibrefit.core.errors import UsageError

        raise UsageError(f"--rig {options['rig']}", "no study to write", "--write STUDY beside it")
    if out is not None:
        from fibrefit.store.directory import ResultDirectory

        ResultDirectory(out, force=force).check()
    from fibrefit.workflow.inspection.inspection import inspect

    bare = not any(is_study(file) for file in files)
    reading = overrides if write is None else _of_files(overrides)
    found = inspect(files, reading) if bare else inspect(study_from(files, None, overrides))
    terminal.answer(found.report(), found.document())
    if bare and any(each.verdict != "understood" for each in found.seen):
        terminal.remark(HINT)
    if write is not None:
        from fibrefit.workflow.inspection.write_study import write_study

        write_study(found, write, options["rig"], overrides, force=force)
        terminal.remark(f"\nThe study is in {write}.")
    if found.tables and (out is not None or (sys.stdout.isatty() and write is None)):
        from fibrefit.store.directory import default_directory

        # A folder named after its content may be written again: it will hold the same.
        folder = out or default_directory(f"inspect {found.name}", found.content())
        found.save(folder, force=force or out is None)
        terminal.remark(f"\nPictures are in {folder / 'figures'}.")
    return max((refusal.exit_code for refusal in found.refusals), default=0)


def _of_files(overrides: tuple[str, ...]) -> tuple[str, ...]:
    """Those that say how files are read."""
    from fibrefit.study.written import split_overrides

    return tuple(split_overrides(overrides)[0])
