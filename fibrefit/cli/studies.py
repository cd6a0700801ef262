"""Commands that hand a study on to one function: fit, simulate, sweep, predict, series, batch, distinguish, plan."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Any

import click

from fibrefit.cli.options import (
    FILE_NAME,
    OF_RESULT,
    PATH,
    RIG,
    ROBUST,
    SET,
    TRUST_OPTION,
    Request,
    check_trust,
    check_trust_of_result,
    is_study,
    option,
    plain_command,
    study_command,
    study_from,
)
from fibrefit.cli.terminal import INTERRUPTED, NOT_TRUSTED, Terminal, as_typed, progress_display, stop_requested
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import MOST_STARTS
from fibrefit.core.paths import FIGURES, requested_formats, sha256_of

WITHOUT = option("--exclude=EFFECT", "Without this effect or pattern, repeatable.", list)


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


@study_command("simulate")
def simulate_command(terminal: Terminal, request: Request) -> None:
    """Compute the response of the model to the conditions of each record of STUDY, as CSV and pictures.

    Of many records the first have pictures. Parameters take the initial values of the study; those it does not give are
    suggested by the records.
    What belongs to a measured record alone, its zero, its release or start and the error of a measured input, is fitted
    to it where the study does not state it.
    """
    from fibrefit.workflow.simulate import simulate_study

    with request.reserved("simulate") as folder, progress_display(terminal) as progress:
        progress("simulating", None)
        simulate_study(request.study).save(folder, force=request.force)
    written = sorted(path.relative_to(folder).as_posix() for path in folder.glob("simulated/*.csv"))
    text = "\n".join([f"Simulated {request.study.name}; written to {folder}:", *(f"  {name}" for name in written)])
    terminal.answer(text, {"study": request.study.name, "out": str(folder), "files": written})


@plain_command("sweep", click.Argument(["study"], metavar="STUDY", type=FILE_NAME), SET, TRUST_OPTION, *OF_RESULT)
def sweep_command(
    terminal: Terminal, study: str, overrides: tuple[str, ...], out: Path | None, force: bool, seed: int
) -> int:
    """Frequency sweep of the pendulum of STUDY (forward, backward, from rest) with stability.

    Extremes of angle and forces against the frequency of the drive. Each frequency is started from rest, and continued
    from the motion at the next lower and at the next higher one; stability is judged by Floquet multipliers.
    """
    if os.path.isfile(Path(study)) and not is_study(study):
        raise UsageError(study, "a record", "a study of an inverted pendulum", "A sweep takes no records.")
    request = Request(study_from((study,), None, overrides), out, force)
    from fibrefit.workflow.sweep import sweep_study

    swept = request.saved(terminal, request.reserved("sweep"), partial(sweep_study, request.study))
    return NOT_TRUSTED if swept.status == "failed" else 0


@study_command("predict", click.Argument(["result"], type=PATH))
def predict_command(terminal: Terminal, request: Request, result: Path) -> int:
    """Predict the records of STUDY with the model and the values of RESULT, the folder of an earlier result.

    Zero and start of each record, and the error of a measured input within its noise, are fitted to it, nothing else.
    Exit code 5 where the values do not hold or the prediction cannot be trusted.
    """
    check_trust_of_result(result)
    from fibrefit.store.summary import files_of_result
    from fibrefit.workflow.prediction.predict import predict_study

    files = files_of_result(result)
    reserved = request.reserved("predict", *map(sha256_of, files), files=files)
    prediction = request.saved(terminal, reserved, partial(predict_study, result, request.study))
    return NOT_TRUSTED if prediction.summary().status != "ok" else 0


@study_command("series")
def series_command(terminal: Terminal, request: Request) -> int:
    """Ask the records of STUDY whether one set of parameters serves all speeds.

    Three models of the same records are compared by marginal likelihood and on records left out: constant parameters,
    parameters with a law of speed (a power, an added power, a free curve), parameters of each record's own. Besides:
    the population (mean, scatter, a new record) and the trends over every condition.
    """
    reserved = request.reserved("series", str(request.seed))
    from fibrefit.workflow.together.series import series_study

    work = partial(series_study, request.study, seed=request.seed)
    request.saved(terminal, reserved, work, " The study is that of the model that serves.")
    return 0


@study_command(
    "distinguish", option("--only=EFFECT", 'Only this effect or pattern ("guide.*"), repeatable.', list), WITHOUT
)
def distinguish_command(terminal: Terminal, request: Request, only: tuple[str, ...], exclude: tuple[str, ...]) -> int:
    """Say which effects the records of STUDY can distinguish, and the detection limit of each.

    The records may be measured, or only planned: then each has a name, a sampling_rate, a duration and what makes it
    move (lift of a drop; excitation, amplitude and rate of a driven weight; amplitude and frequency of an inverted
    pendulum), the base parameters have initial values, and [noise] states that of the gauges. Of a guided_mass and a
    pendulum they are refused: only a measurement tells how such a motion begins.
    """
    from fibrefit.workflow.design.distinguish import distinguish_study

    work = partial(distinguish_study, request.study, only=only, exclude=exclude)
    reserved = request.reserved("confuse", repr((only, exclude)))
    found = request.saved(terminal, reserved, work, tells=False)
    return NOT_TRUSTED if found.status == "failed" else 0


@study_command(
    "plan",
    option(
        "--for purpose",
        "Rank by error bars, by telling rivals apart, or by power to find what is missing.",
        click.Choice(["errors", "rivals", "power"]),
    ),
    option("--rivals=EFFECT,EFFECT", "Two effects of which one is missing.", str),
    option(
        "--cost=WHAT=MINUTES costs",
        'Of a condition that no record at hand has, or of a "record", repeatable [record 2, lift 1, inclination 15, '
        "others 5 min].",
        list,
    ),
    option("--only=EFFECT", 'Detection limits of this effect or pattern ("guide.*"), repeatable.', list),
    WITHOUT,
)
def plan_command(
    terminal: Terminal,
    request: Request,
    purpose: str | None,
    rivals: str | None,
    costs: tuple[str, ...],
    only: tuple[str, ...],
    exclude: tuple[str, ...],
) -> int:
    """Rank the records that could be taken next by what they would add to those of STUDY, measured or planned.

    Without --for they are ranked by how surely they tell rivals apart, where there are some, else by error bars. The
    folder of a discovery brings the effects that it could not tell apart.
    """
    from fibrefit.workflow.design.plan import Aim, plan_study

    minutes: dict[str, float] = {}
    for text in costs:
        name, _, number = text.partition("=")
        if (name := name.strip()) in minutes:
            raise UsageError(f'--cost "{text}"', f"the cost of {name} for the second time", "each once", "")
        try:
            minutes[name] = float(number)
        except ValueError:
            raise UsageError(f'--cost "{text}"', "no number of minutes", "for example inclination=15") from None
    pair = tuple(filter(None, (rivals or "").replace(" ", "").split(",")))
    aim = Aim(purpose, pair, minutes, only, exclude)  # type: ignore[arg-type]
    work = partial(plan_study, request.study, aim)
    found = request.saved(terminal, request.reserved("plan", repr(aim)), work, tells=False)
    return NOT_TRUSTED if found.status == "failed" else 0


@plain_command(
    "batch",
    click.Argument(["series"], metavar="SERIES...", nargs=-1, required=True, type=FILE_NAME),
    RIG,
    option("--set=KEY=VALUE overrides", "Change every study, repeatable.", list),
    option(
        "--each",
        "What is identified by itself [the records of one study, or each of several studies].",
        click.Choice(["record", "study"]),
    ),
    option("--jobs", "Processes on this machine [one a core].", click.IntRange(1)),
    option("--scheduler=ADDRESS", "A running Dask scheduler, such as tcp://host:8786.", str),
    option(
        "--starts",
        "Most starts of each search: 4 first, all where that fit does not pass its checks.",
        click.IntRange(1, MOST_STARTS),
        32,
    ),
    ROBUST,
    option("--resume", "Keep what an interrupted or finished run in DIR has done."),
    option("--shard=I/N", "Only the I-th of N parts, for job arrays; a run without it gathers them.", str),
    TRUST_OPTION,
    *OF_RESULT,
)
def batch_command(
    terminal: Terminal,
    series: tuple[str, ...],
    overrides: tuple[str, ...],
    jobs: int | None,
    shard: str | None,
    **options: Any,
) -> int:
    """Identify every record, or every study, of SERIES by itself, and put the results into one table.

    SERIES are study files, folders with a study.toml, folders of such folders, or bare records with --rig. What cannot
    be identified is listed with the reason and does not stop the rest.
    """
    from fibrefit.workflow.batches.jobs import origins_of, studies_of
    from fibrefit.workflow.batches.run import batch
    from fibrefit.workflow.batches.shards import shard_of

    if jobs is not None and options["scheduler"] is not None:
        do = "Leave out --jobs: a cluster has as many workers as it was given."
        raise UsageError(f"--jobs {jobs}", f"--scheduler {options['scheduler']} beside it", "one of both", do)
    for study in studies_of(origins_of(series, options["rig"], overrides)):
        check_trust(study, overrides)
    part, out = None if shard is None else shard_of(shard), options.pop("out")
    with progress_display(terminal) as progress:
        found = batch(series, out, overrides=overrides, processes=jobs, shard=part, progress=progress, **options)
    terminal.report(found)
    if found.taken_up:
        terminal.remark(f"\n{found.taken_up} of {len(found.jobs)} had been done before.")
    if found.folder is not None:
        terminal.wrote(found.folder)
    return NOT_TRUSTED if found.status == "failed" else 0
