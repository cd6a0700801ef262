"""``fibrefit distinguish``: which effects the records of a study can distinguish."""

from __future__ import annotations

import click

from fibrefit.cli.options import Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal


@study_command("distinguish")
@click.option("--only", multiple=True, metavar="EFFECT", help='Only this effect or pattern ("guide.*"), repeatable.')
@click.option("--exclude", multiple=True, metavar="EFFECT", help="Without this effect or pattern, repeatable.")
def command(terminal: Terminal, request: Request, only: tuple[str, ...], exclude: tuple[str, ...]) -> int:
    """Say which effects the records of STUDY can distinguish, and the detection limit of each.

    The records may be measured, or only planned: then each has a name, a sampling_rate, a duration and what makes it
    move (lift of a drop; excitation, amplitude and rate of a driven weight; amplitude and frequency of an inverted
    pendulum), the base parameters have initial values, and [noise] states that of the gauges. Of a guided_mass and a
    pendulum they are refused: only a measurement tells how such a motion begins.
    """
    from fibrefit.workflow.design.distinguish import distinguish_study

    with request.reserved("confuse", repr((only, exclude))) as folder, shown_progress(terminal) as progress:
        found = distinguish_study(request.study, only=only, exclude=exclude, progress=progress)
        found.save(folder, force=request.force)
    terminal.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))
    terminal.wrote(folder)
    return NOT_TRUSTED if found.status == "failed" else 0
