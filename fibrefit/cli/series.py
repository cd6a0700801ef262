"""``fibrefit series``: what the records of a study say together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fibrefit.cli.options import result_directory, result_options, study_options, with_study
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import Terminal, with_terminal

if TYPE_CHECKING:
    from fibrefit.study import Study


@click.command("series")
@study_options
@result_options
@with_terminal
@with_study
def command(
    terminal: Terminal,
    study: Study,
    out: Path | None,
    force: bool,
    seed: int,
) -> int:
    """Ask the records of STUDY whether one set of parameters serves all speeds.

    Three models of the same records are compared by marginal likelihood and on records left out: constant parameters,
    parameters with a law of speed (a power, an added power, a free curve), parameters of each record's own. Besides:
    the population (mean, scatter, a new record) and the trends over every condition.
    """
    place = result_directory(study, out, force, "series", str(seed))
    from fibrefit.workflow.together.series import series_study

    with place as folder, shown_progress(terminal) as progress:
        found = series_study(study, seed=seed, progress=progress)
        progress("drawing and writing", None)
        found.save(folder, force=force)
    terminal.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))
    terminal.remark(
        f"\nWritten to {folder}: summary.json, result.h5, table.csv, table.parquet, figures, and study.toml of the "
        "model that serves."
    )
    return 0
