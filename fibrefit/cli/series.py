"""``fibrefit series``: what the records of a study say together."""

from __future__ import annotations

from fibrefit.cli.options import Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import Terminal


@study_command("series")
def command(terminal: Terminal, request: Request) -> int:
    """Ask the records of STUDY whether one set of parameters serves all speeds.

    Three models of the same records are compared by marginal likelihood and on records left out: constant parameters,
    parameters with a law of speed (a power, an added power, a free curve), parameters of each record's own. Besides:
    the population (mean, scatter, a new record) and the trends over every condition.
    """
    place = request.reserved("series", str(request.seed))
    from fibrefit.workflow.together.series import series_study

    with place as folder, shown_progress(terminal) as progress:
        found = series_study(request.study, seed=request.seed, progress=progress)
        progress("drawing and writing", None)
        found.save(folder, force=request.force)
    terminal.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))
    terminal.wrote(folder, " The study is that of the model that serves.")
    return 0
