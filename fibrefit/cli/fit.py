"""``fibrefit fit``: least squares."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path

import click

from fibrefit.cli.failure import INTERRUPTED
from fibrefit.cli.interruption import stop_requested
from fibrefit.cli.options import Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, as_typed
from fibrefit.core.limits import MOST_STARTS
from fibrefit.core.paths import FIGURES, requested_formats


@study_command("fit")
@click.option(
    "--starts",
    type=click.IntRange(1, MOST_STARTS),
    default=32,
    show_default=True,
    help="Starts of the multistart search.",
)
@click.option("--robust", is_flag=True, help="Soft-L1 loss for residuals beyond 3 sigma.")
@click.option(
    "--profile",
    is_flag=True,
    help="Intervals by profile likelihood, of shared parameters in which records do not differ; refused where an input "
    "is measured with noise.",
)
def command(terminal: Terminal, request: Request, starts: int, robust: bool, profile: bool) -> int:
    """Identify stiffness, damping and friction from STUDY, or from the records FILE... of one rig."""
    place = request.reserved("fit", f"{request.seed} {starts} {robust} {profile}")
    from fibrefit.workflow.fit import fit_study

    settings = {"starts": starts, "seed": request.seed, "robust": robust, "profile": profile}
    with place as folder, stop_requested(terminal) as stop:
        with shown_progress(terminal) as progress:
            fit = fit_study(request.study, **settings, progress=progress, stop=stop)  # type: ignore[arg-type]
        answer = partial(terminal.answer, fit.report(), fit.summary().model_dump(mode="json", by_alias=True))
        if requested_formats():
            from fibrefit.plots.artists import without_help

            without_help()
        # What was found is reported before the figures are drawn, which takes as long again; it is saved though nobody
        # reads on. A program is answered once, when all is done.
        with nullcontext() if terminal.json else _first(answer):
            fit.save(folder, force=request.force, stop=stop)
        if terminal.json:
            answer()
        interrupted = stop()
    terminal.wrote(folder, " Not all figures were drawn." if interrupted else _further(folder))
    if interrupted:
        return INTERRUPTED
    return NOT_TRUSTED if fit.status == "failed" else 0


@contextmanager
def _first(job: Callable[[], None]) -> Iterator[None]:
    """Do a job before the block; what it fails by is raised once the block is done."""
    failed: Exception | None = None
    try:
        job()
    except Exception as error:
        failed = error
    yield
    if failed is not None:
        raise failed


def _further(folder: Path) -> str:
    """How the figures that were not requested are drawn."""
    if FIGURES.get() is not None:
        return ""
    command = as_typed("fibrefit", "show", str(folder), "--figures", "png")
    return f" Besides the overview, figures are drawn on request: {command}"
