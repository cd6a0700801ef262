"""``fibrefit sweep``: frequency sweep of an inverted pendulum."""

from __future__ import annotations

from pathlib import Path

import click

from fibrefit.cli.options import FileName, Request, is_study, result_options, study_from, trust_option
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, with_terminal
from fibrefit.core.paths import is_plain_file


@click.command("sweep")
@click.argument("study", metavar="STUDY", type=FileName())
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change the study, repeatable.")
@trust_option
@result_options
@with_terminal
def command(
    terminal: Terminal, study: str, overrides: tuple[str, ...], out: Path | None, force: bool, seed: int
) -> int:
    """Frequency sweep of the pendulum of STUDY (forward, backward, from rest) with stability.

    Extremes of angle and forces against the frequency of the drive. Each frequency is started from rest, and continued
    from the motion at the next lower and at the next higher one; stability is judged by Floquet multipliers.
    """
    if is_plain_file(Path(study)) and not is_study(study):
        from fibrefit.core.errors import UsageError

        raise UsageError(study, "a record", "a study of an inverted pendulum", "A sweep takes no records.")
    loaded = study_from((study,), None, overrides)
    from fibrefit.workflow.sweep import sweep_study

    with Request(loaded, out, force).reserved("sweep") as folder, shown_progress(terminal) as progress:
        swept = sweep_study(loaded, progress=progress)
        progress("drawing and writing", None)
        swept.save(folder, force=force)
    terminal.answer(swept.report(), swept.summary().model_dump(mode="json", by_alias=True))
    terminal.wrote(folder)
    return NOT_TRUSTED if swept.status == "failed" else 0
