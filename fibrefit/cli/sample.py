"""``fibrefit sample``: the joint posterior."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from fibrefit.cli.options import Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal
from fibrefit.sampling.settings import AS_A_FIT, NOISE_KINDS


@study_command("sample")
@click.option(
    "--ess",
    type=float,
    default=400.0,
    show_default=True,
    help="Bulk and tail ESS to reach.",
)
@click.option("--r-hat", type=float, default=1.01, show_default=True, help="R-hat that counts as converged.")
@click.option("--max-steps", type=click.IntRange(1), default=4000, show_default=True, help="Budget in steps.")
@click.option("--max-seconds", type=float, help="Budget in seconds of sampling, of each mode.")
@click.option("--ensembles", type=int, default=4, show_default=True, help="Independent ensembles, four at least.")
@click.option(
    "--walkers",
    type=int,
    help="Walkers of each ensemble, an even number [three a value, those of records and noise included; 32 at least].",
)
@click.option(
    "--noise",
    type=click.Choice(NOISE_KINDS),
    default=AS_A_FIT,
    show_default=True,
    help="Noise spectrum: that of a fit, the kind that explains the residuals best (auto), or one kind.",
)
@click.option("--student-t", "--heavy", "heavy", is_flag=True, help="Heavy-tailed (Student's t) likelihood.")
@click.option("--interval", type=float, default=0.95, show_default=True, help="Probability of the credible intervals.")
@click.option("--nuts", is_flag=True, help="Cross-check with the No-U-Turn sampler (NUTS).")
@click.option("--compare", multiple=True, metavar="RESULT", help="Another posterior of the same records, repeatable.")
@click.option("--checkpoint-seconds", type=float, default=5.0, show_default=True, help="Time between two checkpoints.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted or finished run in DIR.")
def command(
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
    with place as directory, shown_progress(terminal) as progress:
        found = sample_study(
            request.study, settings=settings, options=options, folder=directory.path, progress=progress
        )
        progress("drawing and writing", None)
        found.write(directory)
    terminal.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))
    terminal.wrote(folder)
    return NOT_TRUSTED if found.status == "failed" else 0
