"""``fibrefit inspect``: what was understood of records, or of a study and its records."""

from __future__ import annotations

from pathlib import Path

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
@click.option("--force", is_flag=True, help="Replace an earlier inspection in DIR.")
@click.option(
    "--out", metavar="DIR", type=click.Path(path_type=Path), help="Folder for the pictures [results/inspect_NAME-HASH]."
)
@with_terminal
def command(
    terminal: Terminal, files: tuple[str, ...], overrides: tuple[str, ...], force: bool, out: Path | None
) -> int:
    """Say what was understood of records or of STUDY: columns, units, rate, gaps, damage."""
    from fibrefit.store.directory import ResultDirectory, default_directory

    if out is not None:
        ResultDirectory(out, force=force).check()
    from fibrefit.workflow.inspection import inspect

    bare = not any(is_study(file) for file in files)
    found = inspect(files, overrides) if bare else inspect(study_from(files, None, overrides))
    terminal.answer(found.report(), found.document())
    if bare and any(each.verdict != "understood" for each in found.seen):
        terminal.remark(HINT)
    if found.tables:
        # A folder named after its content may be written again: it will hold the same.
        folder = out or default_directory(f"inspect {found.name}", found.content())
        found.save(folder, force=force or out is None)
        terminal.remark(f"\nPictures are in {folder / 'figures'}.")
    return max((refusal.exit_code for refusal in found.refusals), default=0)
