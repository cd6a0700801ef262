"""``fibrefit plan``: the next records, ranked by what they would add."""

from __future__ import annotations

import click

from fibrefit.cli.options import Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal


@study_command("plan")
@click.option(
    "--for",
    "purpose",
    type=click.Choice(["errors", "rivals", "power"]),
    help="Rank by error bars, by telling rivals apart, or by power to find what is missing.",
)
@click.option("--rivals", metavar="EFFECT,EFFECT", help="Two effects of which one is missing.")
@click.option(
    "--cost",
    "costs",
    multiple=True,
    metavar="WHAT=MINUTES",
    help='Of a condition that no record at hand has, or of a "record", repeatable [record 2, lift 1, inclination 15, '
    "others 5 min].",
)
@click.option(
    "--only",
    multiple=True,
    metavar="EFFECT",
    help='Detection limits of this effect or pattern ("guide.*"), repeatable.',
)
@click.option("--exclude", multiple=True, metavar="EFFECT", help="Without this effect or pattern, repeatable.")
def command(terminal: Terminal, request: Request, **options: object) -> int:
    """Rank the records that could be taken next by what they would add to those of STUDY, measured or planned.

    Without --for they are ranked by how surely they tell rivals apart, where there are some, else by error bars. The
    folder of a discovery brings the effects that it could not tell apart.
    """
    from fibrefit.workflow.design.plan import Aim, plan_study

    costs = _costs(options["costs"])  # type: ignore[arg-type]
    rivals = tuple(filter(None, str(options["rivals"] or "").replace(" ", "").split(",")))
    aim = Aim(options["purpose"], rivals, costs, options["only"], options["exclude"])  # type: ignore[arg-type]
    with request.reserved("plan", repr(aim)) as folder, shown_progress(terminal) as progress:
        found = plan_study(request.study, aim, progress=progress)
        found.save(folder, force=request.force)
    terminal.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))
    terminal.wrote(folder)
    return NOT_TRUSTED if found.status == "failed" else 0


def _costs(given: tuple[str, ...]) -> dict[str, float]:
    from fibrefit.core.errors import UsageError

    costs: dict[str, float] = {}
    for text in given:
        name, _, minutes = text.partition("=")
        if (name := name.strip()) in costs:
            raise UsageError(f'--cost "{text}"', f"the cost of {name} for the second time", "each once", "")
        try:
            costs[name] = float(minutes)
        except ValueError:
            raise UsageError(f'--cost "{text}"', "no number of minutes", "for example inclination=15") from None
    return costs
