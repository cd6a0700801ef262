"""``fibrefit batch``: many identifications."""

from __future__ import annotations

from typing import Any

import click

from fibrefit.cli.options import FILE_NAME, OF_RESULT, RIG, ROBUST, TRUST_OPTION, check_trust, option, plain_command
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, progress_display
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import MOST_STARTS


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
