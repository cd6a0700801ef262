"""``fibrefit discover``: find what the model lacks, name it, add it.

A person may choose among the candidates: asked on stderr, and answered on stdin, by hand or through a pipe.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from fibrefit.cli.options import Request, duration, option, study_command
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal, as_typed, progress_display, say
from fibrefit.core.errors import did_you_mean
from fibrefit.core.limits import Progress
from fibrefit.core.paths import FIGURES

if TYPE_CHECKING:
    from fibrefit.study.summaries.discovery import Candidate, DiscoverySummary

STOP = ("s", "stop")
JOINT = " + "


@study_command(
    "discover",
    option("--max-effects", "Most effects to add.", click.IntRange(1), 3),
    option("--only=EFFECT", 'Try only this effect or pattern ("guide.*"), repeatable.', list),
    option("--exclude=EFFECT", "Do not try this effect or pattern, repeatable.", list),
    option(
        "--also=EFFECT",
        "Try this one too, repeatable: one of your own, FILE.py:CLASS with its path relative to the study, or one of "
        "the catalogue that is not looked for unrequested.",
        list,
    ),
    option(
        "--time=TIME seconds",
        "Time after which there is an answer: the best so far, and what was not tried. A bare number is in seconds.",
        duration,
        "5 min",
    ),
    option(
        "--least",
        "Smallest effect of interest: rms of what it explains, in units of the noise rms. What is there but "
        "smaller is reported, not added.",
        click.FloatRange(min=0.0),
        0.0,
    ),
    option("--interactive", "Choose among the candidates at each round."),
    option("--resume", "Go on with an interrupted search in DIR, or give it more time."),
)
def discover_command(
    terminal: Terminal, request: Request, seconds: float, interactive: bool, resume: bool, **tried: Any
) -> int:
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
    chosen: list[str] = []

    def person(candidates: Sequence[Candidate]) -> str | None:
        name = ask_candidate(candidates)
        chosen.extend([] if name is None else [name])
        return name

    choose = person if interactive else None
    shown = listed_steps(terminal) if interactive else progress_display(terminal)
    with journal_folder(folder, study, options, force=force, resume=resume) as (directory, journal), shown as progress:
        found = discover_study(
            study, **tried, seed=seed, seconds=seconds, choose=choose, folder=journal, progress=progress
        )
        progress("drawing and writing", None)
        found.write(directory)
        summary = found.summary()
        if not (summary.untried or summary.undone):
            forgotten(journal)
    code = _answered(terminal, summary)
    for name in [name for name in chosen if name not in summary.added]:
        terminal.remark(f"\n{name} was chosen but not kept: without it the records are explained as well.")
    # Values of fits that cannot be trusted are no place to go on from.
    final = "" if summary.verdict == "not_trusted" else " The study is that of the final model."
    terminal.wrote(folder, final)
    return code


def _answered(terminal: Terminal, summary: DiscoverySummary) -> int:
    from fibrefit.report.discovery import discovery_report

    terminal.answer(discovery_report(summary), summary.model_dump(mode="json", by_alias=True))
    return NOT_TRUSTED if summary.verdict == "not_trusted" or summary.status == "failed" else 0


def ask_candidate(candidates: Sequence[Candidate]) -> str | None:
    """Effect a person chooses among the candidates of a round.

    Parameters
    ----------
    candidates : sequence of Candidate
        Best first.

    Returns
    -------
    str or None
        None where nothing is to be added any more, or where nobody answers.
    """
    from fibrefit.report.text import with_error

    offered = distinct_names(candidates)
    names, width = list(offered), max(map(len, offered))
    say(f"\n    {'effect':<{width}}  gap after  evidence  its values")
    for number, candidate in enumerate((one for one in candidates if one.effect in offered), 1):
        # Of its own parameters, with their standard errors where they have any.
        values = []
        for name, one in candidate.parameters.items():
            if name.rpartition(".")[0] in candidate.effect.split(JOINT):
                value, spread, unit = with_error(one.value, one.std_error, one.unit)
                values.append(" ".join(filter(None, [value, spread and f"+/- {spread}", unit if unit != "-" else ""])))
        numbers = f"{candidate.gap_after:>9.3f}  {candidate.evidence:>8.0f}  {', '.join(values)}"
        say(f"{number:>2}  {candidate.effect:<{width}}  {numbers}")
    while True:
        say(f"Which one is added? 1 to {len(names)}, a name, Enter for the first, s to stop: ", newline=False)
        line = sys.stdin.readline()
        word = line.strip()
        if not line or word.lower() in STOP:
            say("" if line else "no answer: stopped")
            return None
        chosen = word or names[0]
        if word.isdecimal() and 1 <= int(word) <= len(names):
            chosen = names[int(word) - 1]
        if chosen in names:
            return offered[chosen]
        say(f'"{word}" is none of them. {did_you_mean(word, names)}'.rstrip())


def distinct_names(candidates: Sequence[Candidate]) -> dict[str, str]:
    """What each candidate is called, and the name by which the search knows it from those before it.

    A search takes the first candidate that holds the effect it is given. Candidates that no effect distinguishes from
    an earlier one are omitted.
    """
    offered: dict[str, str] = {}
    seen: set[str] = set()
    for candidate in candidates:
        own = [name for name in candidate.effect.split(JOINT) if name not in seen]
        if own:
            offered[candidate.effect] = own[-1]
        seen |= set(candidate.effect.split(JOINT))
    return offered


@contextmanager
def listed_steps(terminal: Terminal) -> Iterator[Progress]:
    """Say each step of the work once, on a line of its own: a moving bar would hide the questions."""
    last = ""

    def note(doing: str, share: float | None) -> None:
        nonlocal last
        if doing != last:
            terminal.remark(f"... {doing}")
            last = doing

    yield note
