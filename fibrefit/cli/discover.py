"""``fibrefit discover``: find what the model lacks, name it, add it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from fibrefit.cli.choosing import Person, listed_steps
from fibrefit.cli.options import Duration, Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, as_typed
from fibrefit.core.paths import FIGURES

if TYPE_CHECKING:
    from fibrefit.study.summaries.discovery import DiscoverySummary


@study_command("discover")
@click.option("--max-effects", type=click.IntRange(1), default=3, show_default=True, help="Most effects to add.")
@click.option(
    "--only", multiple=True, metavar="EFFECT", help='Try only this effect or pattern ("guide.*"), repeatable.'
)
@click.option("--exclude", multiple=True, metavar="EFFECT", help="Do not try this effect or pattern, repeatable.")
@click.option(
    "--also",
    multiple=True,
    metavar="EFFECT",
    help="Try this one too, repeatable: one of your own, FILE.py:CLASS with its path relative to the study, or one of "
    "the catalogue that is not looked for unrequested.",
)
@click.option(
    "--time",
    "seconds",
    type=Duration(),
    default="5 min",
    show_default=True,
    help="Time after which there is an answer: the best so far, and what was not tried. A bare number is in seconds.",
)
@click.option(
    "--least",
    type=click.FloatRange(min=0.0),
    default=0.0,
    show_default=True,
    help="Smallest effect of interest: rms of what it explains, in units of the noise rms. What is there but "
    "smaller is reported, not added.",
)
@click.option("--interactive", is_flag=True, help="Choose among the candidates at each round.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted search in DIR, or give it more time.")
def command(terminal: Terminal, request: Request, seconds: float, interactive: bool, resume: bool, **tried: Any) -> int:
    """Find what the model of STUDY lacks: where it goes wrong, which effect accounts for it, and the gap it closes.

    Names are those of `fibrefit effects`. The folder of the result holds a study.toml of the final model. The same
    search is not made twice: a result that is there already is shown again, unless --force is given. What was found is
    kept as the search goes on; --resume goes on from there, and ends with the result of a search that was never
    interrupted.
    """
    from fibrefit.workflow.discovery.discover import SearchOptions, discover_study, finished
    from fibrefit.workflow.discovery.journal import forgotten, journal_folder

    study, seed, force = request.study, request.seed, request.force
    options = SearchOptions(seed=seed, seconds=seconds, **tried)
    folder = request.folder("discover", repr(replace(options, seconds=0.0)), str(interactive))
    known = None if force or interactive else finished(folder, study, options)
    if known is not None and not (resume and (known.untried or known.undone)):
        more = "--resume goes on with it" if known.untried or known.undone else "--force makes it again"
        draw = as_typed("fibrefit", "show", str(folder), "--figures", "png")
        drawn = "" if FIGURES.get() is None else f" Its figures are drawn on request: {draw}"
        terminal.remark(f"The same search was made before; this is its result in {folder}. {more}.{drawn}")
        return _answered(terminal, known)
    person = Person() if interactive else None
    shown = listed_steps(terminal) if interactive else shown_progress(terminal)
    with journal_folder(folder, study, options, force=force, resume=resume) as (directory, journal), shown as progress:
        found = discover_study(
            study, **tried, seed=seed, seconds=seconds, choose=person, folder=journal, progress=progress
        )
        progress("drawing and writing", None)
        found.write(directory)
        summary = found.summary()
        if not (summary.untried or summary.undone):
            forgotten(journal)
    code = _answered(terminal, summary)
    for text in person.remarks(summary.added) if person else ():
        terminal.remark(f"\n{text}")
    # Values of fits that cannot be trusted are no place to go on from.
    final = "" if summary.verdict == "not_trusted" else " The study is that of the final model."
    terminal.wrote(folder, final)
    return code


def _answered(terminal: Terminal, summary: DiscoverySummary) -> int:
    from fibrefit.report.discovery import discovery_report

    terminal.answer(discovery_report(summary), summary.model_dump(mode="json", by_alias=True))
    return NOT_TRUSTED if summary.verdict == "not_trusted" or summary.status == "failed" else 0
