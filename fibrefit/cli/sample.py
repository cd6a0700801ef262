"""``fibrefit sample``: the joint posterior."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from fibrefit.cli.options import Request, option, study_command
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, progress_display
from fibrefit.sampling.settings import AS_A_FIT, NOISE_KINDS


@study_command(
    "sample",
    option("--ess", "Bulk and tail ESS to reach.", float, 400.0),
    option("--r-hat", "R-hat that counts as converged.", float, 1.01),
    option("--max-steps", "Budget in steps.", click.IntRange(1), 4000),
    option("--max-seconds", "Budget in seconds of sampling, of each mode.", float),
    option("--ensembles", "Independent ensembles, four at least.", int, 4),
    option(
        "--walkers",
        "Walkers of each ensemble, an even number [three a value, those of records and noise included; 32 at least].",
        int,
    ),
    option(
        "--noise",
        "Noise spectrum: that of a fit, the kind that explains the residuals best (auto), or one kind.",
        click.Choice(NOISE_KINDS),
        AS_A_FIT,
    ),
    option("--student-t --heavy heavy", "Heavy-tailed (Student's t) likelihood."),
    option("--interval", "Probability of the credible intervals.", float, 0.95),
    option("--nuts", "Cross-check with the No-U-Turn sampler (NUTS)."),
    option("--compare=RESULT", "Another posterior of the same records, repeatable.", list),
    option("--checkpoint-seconds", "Time between two checkpoints.", float, 5.0),
    option("--resume", "Go on with an interrupted or finished run in DIR."),
)
def sample_command(
    terminal: Terminal,
    request: Request,
    resume: bool,
    noise: str,
    heavy: bool,
    nuts: bool,
    compare: tuple[str, ...],
    **budget: Any,
) -> int:
    """Sample the joint posterior of the parameters of STUDY, and say whether it can be believed.

    The chains are kept every few seconds; --resume goes on from there, or with a larger budget, and ends with the same
    numbers as a run that was never interrupted.
    """
    from fibrefit.sampling.settings import Settings
    from fibrefit.store import Run
    from fibrefit.workflow.growing import growing_folder
    from fibrefit.workflow.sampling.sample import SamplingOptions, files_compared, identity, sample_study
    from fibrefit.workflow.sampling.start import KEPT

    settings, options = Settings(seed=request.seed, **budget), SamplingOptions(noise, heavy, nuts, compare)
    fixed = identity(options, settings)
    folder = request.folder("sample", fixed)
    run = Run.of("sample", request.study, fixed)
    # What it is compared with may be others when it goes on, but none of them may lie where it is written.
    run = replace(run, inputs=(*run.inputs, *files_compared(options)))
    place = growing_folder(folder, KEPT, force=request.force, resume=resume, run=run)
    with place as directory, progress_display(terminal) as progress:
        found = sample_study(
            request.study, settings=settings, options=options, folder=directory.path, progress=progress
        )
        progress("drawing and writing", None)
        found.write(directory)
    terminal.report(found)
    terminal.wrote(folder)
    return NOT_TRUSTED if found.status == "failed" else 0
