"""``fibrefit simulate``: the model's response to each record's conditions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fibrefit.cli.options import result_directory, result_options, study_options, with_study
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import Terminal, with_terminal

if TYPE_CHECKING:
    from fibrefit.study import Study


@click.command("simulate")
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
) -> None:
    """Compute the response of the model to the conditions of each record of STUDY, as CSV and pictures.

    Parameters take the initial values of the study; those it does not give are suggested by the records.
    """
    from fibrefit.workflow import simulate_study

    with result_directory(study, out, force, "simulate") as folder, shown_progress(terminal) as progress:
        progress("simulating", None)
        simulate_study(study).save(folder, force=force)
    written = sorted(path.relative_to(folder).as_posix() for path in folder.glob("simulated/*.csv"))
    text = "\n".join([f"Simulated {study.name}; written to {folder}:", *(f"  {name}" for name in written)])
    terminal.answer(text, {"study": study.name, "out": str(folder), "files": written})
