"""Asking a person which of the candidates is to be added: on stderr, answered on stdin, by hand or through a pipe."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fibrefit.cli.terminal import Terminal, say
from fibrefit.core.errors import did_you_mean
from fibrefit.core.limits import Progress

if TYPE_CHECKING:
    from fibrefit.study.summaries.discovery import Candidate

STOP = ("s", "stop")
JOINT = " + "


class Person:
    """Whoever answers, and what was chosen so far.

    Attributes
    ----------
    chosen : list of str
    """

    def __init__(self) -> None:
        self.chosen: list[str] = []

    def __call__(self, candidates: Sequence[Candidate]) -> str | None:
        """Effect chosen among the candidates of a round; None to stop."""
        name = ask_candidate(candidates)
        if name is not None:
            self.chosen.append(name)
        return name

    def remarks(self, kept: Sequence[str]) -> list[str]:
        """A sentence for each effect that was chosen but is not among those `kept`."""
        dropped = [name for name in self.chosen if name not in kept]
        return [f"{name} was chosen but not kept: without it the records are explained as well." for name in dropped]


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
    offered = distinct_names(candidates)
    _list(candidates, offered)
    names = list(offered)
    while True:
        say(f"Which one is added? 1 to {len(names)}, a name, Enter for the first, s to stop: ", newline=False)
        line = sys.stdin.readline()
        word = line.strip()
        if not line or word.lower() in STOP:
            say("" if line else "no answer: stopped")
            return None
        chosen = names[0] if not word else _named(word, names)
        if chosen is not None:
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

    def say(doing: str, share: float | None) -> None:
        nonlocal last
        if doing != last:
            terminal.remark(f"... {doing}")
            last = doing

    yield say


def _list(candidates: Sequence[Candidate], offered: dict[str, str]) -> None:
    shown = [candidate for candidate in candidates if candidate.effect in offered]
    width = max(len(candidate.effect) for candidate in shown)
    say(f"\n    {'effect':<{width}}  gap after  evidence  its values")
    for number, candidate in enumerate(shown, 1):
        numbers = f"{candidate.gap_after:>9.3f}  {candidate.evidence:>8.0f}  {_values(candidate)}"
        say(f"{number:>2}  {candidate.effect:<{width}}  {numbers}")


def _values(candidate: Candidate) -> str:
    """Values of the candidate's own parameters, with their standard errors where they have any."""
    from fibrefit.report.text import with_error

    said = []
    for name, one in candidate.parameters.items():
        if name.rpartition(".")[0] in candidate.effect.split(JOINT):
            shown, spread, called = with_error(one.value, one.std_error, one.unit)
            said.append(" ".join(filter(None, [shown, spread and f"+/- {spread}", called if called != "-" else ""])))
    return ", ".join(said)


def _named(word: str, names: Sequence[str]) -> str | None:
    if word.isdecimal():
        return names[int(word) - 1] if 1 <= int(word) <= len(names) else None
    return word if word in names else None
