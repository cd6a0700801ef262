"""``fibrefit batch``: many identifications."""

from __future__ import annotations

from pathlib import Path

import click

from fibrefit.cli.options import FileName, check_trust, result_options, trust_option
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, with_terminal
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import MOST_STARTS


@click.command("batch")
@click.argument("series", metavar="SERIES...", nargs=-1, required=True, type=FileName())
@click.option("--rig", metavar="KIND", help="Kind of rig, for bare records: fibre_mass, pulley_drive, ...")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change every study, repeatable.")
@click.option(
    "--each",
    type=click.Choice(["record", "study"]),
    help="What is identified by itself [the records of one study, or each of several studies].",
)
@click.option("--jobs", type=click.IntRange(1), help="Processes on this machine [one a core].")
@click.option("--scheduler", metavar="ADDRESS", help="A running Dask scheduler, such as tcp://host:8786.")
@click.option(
    "--starts",
    type=click.IntRange(1, MOST_STARTS),
    default=32,
    show_default=True,
    help="Most starts of each search: 4 first, all where that fit does not pass its checks.",
)
@click.option("--robust", is_flag=True, help="Soft-L1 loss for residuals beyond 3 sigma.")
@click.option("--resume", is_flag=True, help="Keep what an interrupted or finished run in DIR has done.")
@click.option("--shard", metavar="I/N", help="Only the I-th of N parts, for job arrays; a run without it gathers them.")
@trust_option
@result_options
@with_terminal
def command(
    terminal: Terminal,
    series: tuple[str, ...],
    rig: str | None,
    overrides: tuple[str, ...],
    each: str | None,
    jobs: int | None,
    scheduler: str | None,
    starts: int,
    robust: bool,
    resume: bool,
    shard: str | None,
    out: Path | None,
    force: bool,
    seed: int,
) -> int:
    """Identify every record, or every study, of SERIES by itself, and put the results into one table.

    SERIES are study files, folders with a study.toml, folders of such folders, or bare records with --rig. What cannot
    be identified is listed with the reason and does not stop the rest.
    """
    from fibrefit.workflow.batches.jobs import origins_of, studies_of
    from fibrefit.workflow.batches.run import batch
    from fibrefit.workflow.batches.shards import shard_of

    if jobs is not None and scheduler is not None:
        do = "Leave out --jobs: a cluster has as many workers as it was given."
        raise UsageError(f"--jobs {jobs}", f"--scheduler {scheduler} beside it", "one of both", do)
    for study in studies_of(origins_of(series, rig, overrides)):
        check_trust(study, overrides)
    with shown_progress(terminal) as progress:
        found = batch(
            series,
            out,
            rig=rig,
            overrides=overrides,
            each=each,  # type: ignore[arg-type]
            processes=jobs,
            scheduler=scheduler,
            starts=starts,
            seed=seed,
            robust=robust,
            force=force,
            resume=resume,
            shard=None if shard is None else shard_of(shard),
            progress=progress,
        )
    terminal.answer(found.report(), found.summary().model_dump(mode="json", by_alias=True))
    if found.taken_up:
        terminal.remark(f"\n{found.taken_up} of {len(found.jobs)} had been done before.")
    if found.folder is not None:
        terminal.wrote(found.folder)
    return NOT_TRUSTED if found.status == "failed" else 0
