"""``fibrefit fit``: least squares."""

from __future__ import annotations

import click

from fibrefit.cli.failure import INTERRUPTED
from fibrefit.cli.options import ROBUST, Request, option, study_command
from fibrefit.cli.progress import progress_display, stop_requested
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, as_typed
from fibrefit.core.limits import MOST_STARTS
from fibrefit.core.paths import FIGURES, requested_formats


@study_command(
    "fit",
    option("--starts", "Starts of the multistart search.", click.IntRange(1, MOST_STARTS), 32),
    ROBUST,
    option(
        "--profile",
        "Intervals by profile likelihood, of shared parameters in which records do not differ; refused where an input "
        "is measured with noise.",
    ),
)
def fit_command(terminal: Terminal, request: Request, starts: int, robust: bool, profile: bool) -> int:
    """Identify stiffness, damping and friction from STUDY, or from the records FILE... of one rig."""
    reserved = request.reserved("fit", f"{request.seed} {starts} {robust} {profile}")
    from fibrefit.workflow.fit import fit_study

    options = {"starts": starts, "seed": request.seed, "robust": robust, "profile": profile}
    with reserved as folder, stop_requested(terminal) as stop:
        with progress_display(terminal) as progress:
            fit = fit_study(request.study, **options, progress=progress, stop=stop)  # type: ignore[arg-type]
        report, document = fit.report(), fit.summary().model_dump(mode="json", by_alias=True)
        if requested_formats():
            from fibrefit.plots.artists import without_help

            without_help()
        # What was found is reported before the figures are drawn, which takes as long again; it is saved though nobody
        # reads on. A program is answered once, when all is done.
        unheard: Exception | None = None
        try:
            if not terminal.json:
                terminal.answer(report, document)
        except Exception as error:
            unheard = error
        fit.save(folder, force=request.force, stop=stop)
        if unheard is not None:
            raise unheard
        if terminal.json:
            terminal.answer(report, document)
        interrupted = stop()
    further = ""
    if interrupted:
        further = " Not all figures were drawn."
    elif FIGURES.get() is None:
        typed = as_typed("fibrefit", "show", str(folder), "--figures", "png")
        further = f" Besides the overview, figures are drawn on request: {typed}"
    terminal.wrote(folder, further)
    if interrupted:
        return INTERRUPTED
    return NOT_TRUSTED if fit.status == "failed" else 0
