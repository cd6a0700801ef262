"""The rounds of a search: what is added in each, and why no more is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.discovery.curves.free_form import Reading, probe_all
from fibrefit.discovery.design.rivals import Rivals
from fibrefit.discovery.engine.candidates import Hypothesis, alone
from fibrefit.discovery.engine.refit import refit, standard_errors
from fibrefit.discovery.engine.thresholds import chance, outdone
from fibrefit.discovery.model.finding import Candidate, Round
from fibrefit.discovery.residuals import where
from fibrefit.discovery.residuals.residuals import Left, left_at
from fibrefit.discovery.search.cross_validation import best_foreseen, gap_foreseen, is_refuted
from fibrefit.discovery.search.search import BEAM, Search
from fibrefit.fitting.result import Identification

LISTED = 8
"""Candidates whose parameters are shown with errors."""


@dataclass(frozen=True)
class Limits:
    """How far a search may go.

    Parameters
    ----------
    max_effects : int
    seed : int
    choose : callable, optional
        Given a round's ranking, names the effect to add; None lets the search decide.
    """

    max_effects: int = 3
    seed: int = 0
    choose: Callable[[Sequence[Candidate]], str | None] | None = None


@dataclass(frozen=True)
class Climbed:
    """Where a search has come to.

    Parameters
    ----------
    search : Search
        In its last state.
    best : Hypothesis
    rounds : tuple of Round
    looked : tuple of Hypothesis
        Candidates of the last round, best first.
    asked : Search or None
        The state in which they were looked at.
    rivals : tuple of Rivals
        What was added, each with an effect that does as well.
    """

    search: Search
    best: Hypothesis
    rounds: tuple[Round, ...] = ()
    looked: tuple[Hypothesis, ...] = ()
    asked: Search | None = None
    rivals: tuple[Rivals, ...] = ()


def climb(search: Search, before: Identification, limits: Limits) -> Climbed:
    """Add effects while the records ask for them."""
    at, beam = Climbed(search, search.base), [search.base]
    while len(at.best.effects) < limits.max_effects:
        if at.best.effects:
            if search.is_noise(at.best) and not search.leaves_much(at.best):
                break
            if (anew := search.anew(at.best)) is not None:
                search, best = anew
                at, beam = replace(at, search=search, best=best), [best]
        if len(at.best.effects) > 1 and is_rival(search, free_form(search, before), at.best):
            break
        looked = search.extended(beam, f"trying each effect, round {len(at.rounds) + 1}")
        if not looked:
            break
        at = replace(at, looked=tuple(looked), asked=search)
        chosen = _chosen(search, looked, at.best, limits)
        if chosen is None and limits.choose is None and _may_hide_each_other(search, at.best, limits):
            looked = search.extended(looked[:BEAM], "trying effects in pairs")
            chosen = _pair(search, looked)
        if chosen is None:
            break
        if limits.choose is None:
            chosen = best_foreseen(search, chosen, looked, at.best)
        polished = Hypothesis(
            chosen.effects,
            refit(chosen.frame, search.ground.subset(chosen.effects), chosen.fit.local, search.ground.whole, 40, 1e-6),
            chosen.frame,
        )
        if limits.choose is None and is_refuted(search, polished, at.best):
            break
        found, rivals = _round(search, before, at.best, polished, looked), _rivals(search, looked, at.best, polished)
        # Where only the best one went on, the rivals of an earlier effect are not tried again beside a later one.
        kept = at.rivals if len(beam) == 1 else ()
        at = replace(at, best=polished, rounds=(*at.rounds, found), rivals=(*kept, *rivals))
        beam = [polished, *(other for other in looked if other.effects != chosen.effects)][:BEAM]
    return at


def ranking(at: Climbed) -> tuple[Candidate, ...]:
    """How the candidates of the last round did over the model the search began with, best first."""
    if at.asked is None:
        return ()
    return tuple(candidate(at.asked, other, at.asked.base, i < LISTED) for i, other in enumerate(at.looked))


OTHERS = 2
"""Candidates after the best one that are asked too, where scatter between records would imitate that one."""


def _chosen(search: Search, looked: Sequence[Hypothesis], over: Hypothesis, limits: Limits) -> Hypothesis | None:
    """What is added to a hypothesis: what a person chooses, or the best that is more than chance; None for nothing."""
    if limits.choose is not None:
        further = [hypothesis for hypothesis in looked if set(over.effects) <= set(hypothesis.effects)][:LISTED]
        name = limits.choose([candidate(search, hypothesis, search.base) for hypothesis in further])
        return next((hypothesis for hypothesis in further if name in hypothesis.names), None)
    asked = [search.simplest(looked, over), *looked[: 1 + OTHERS]]
    return next((hypothesis for hypothesis in asked if search.is_significant(hypothesis, over)), None)


def _may_hide_each_other(search: Search, best: Hypothesis, limits: Limits) -> bool:
    """Whether two effects, neither of which helps by itself, are to be tried together."""
    return not best.effects and limits.max_effects > 1 and not search.is_noise(best)


def _pair(search: Search, looked: Sequence[Hypothesis]) -> Hypothesis | None:
    """The best of two effects together that are more than chance and need each other; None where there is none."""
    best = search.simplest(looked, search.base) if looked else None
    if best is None or not search.is_significant(best, search.base):
        return None
    return best if len(search.pruned(best).effects) == len(best.effects) else None


def _round(
    search: Search, before: Identification, parent: Hypothesis, chosen: Hypothesis, looked: Sequence[Hypothesis]
) -> Round:
    ranking = tuple(candidate(search, hypothesis, parent, errors=i < LISTED) for i, hypothesis in enumerate(looked))
    added = " + ".join(name for name in chosen.names if name not in parent.names)
    gone = " and ".join(name for name in parent.names if name not in chosen.names)
    instead = f", in place of {gone}" if gone else ""
    gaps = search.gap(parent), search.gap(chosen)
    changes = _changes(parent, chosen)
    sentence = f"{added}{instead}: the gap falls from {gaps[0]:.3g} to {gaps[1]:.3g} times the noise. {changes}".strip()
    left = before if not parent.effects else _left(search, parent)
    return Round(added, *gaps, where.places(left), ranking, f"{where.in_words(left)}. {sentence}")


def _left(search: Search, hypothesis: Hypothesis) -> Left:
    """What a hypothesis leaves, the errors of noisy inputs taken off them."""
    found = search.with_inputs(hypothesis)
    if found is not None:
        return left_at(found.problem, found.values, search.task.noise)
    task, values = alone(search.task, hypothesis)
    return left_at(task.problem, values, search.task.noise)


CARRIED = 0.05
"""Relative change of a base parameter from which it is said to have carried part of a missing effect."""


def _changes(parent: Hypothesis, chosen: Hypothesis) -> str:
    """What the base parameters had carried in place of the effect."""
    said = []
    for name, old in parent.fit.shared.items():
        new = chosen.fit.shared.get(name, old)
        if abs(new - old) > CARRIED * abs(old):
            unit = chosen.frame.declared[name].unit
            said.append(f"{name} {'rises' if new > old else 'falls'} from {old:.4g} to {new:.4g} {unit}")
    return (
        f"With it {' and '.join(said)}: until then {'they' if len(said) > 1 else 'it'} stood in for it." if said else ""
    )


def candidate(search: Search, hypothesis: Hypothesis, parent: Hypothesis, errors: bool = True) -> Candidate:
    """How a hypothesis did, over its parent; parameters with their standard errors, or infinite ones."""
    kappa = search.colour_over(parent)
    gain = parent.fit.cost - hypothesis.fit.cost
    subset = search.ground.subset(hypothesis.effects)
    spread = standard_errors(hypothesis.frame, subset, hypothesis.fit.local, search.ground.whole) if errors else {}
    inflation = np.sqrt(kappa * max(hypothesis.fit.cost / search.samples, 1.0))
    parameters = {}
    for effect in hypothesis.effects:
        for parameter in effect.parameters:
            name = f"{effect.name}.{parameter.name}"
            error = float(spread.get(name, np.inf) * inflation)
            parameters[name] = (hypothesis.fit.shared[name], error, parameter.unit)
    return Candidate(
        " + ".join(name for name in hypothesis.names if name not in parent.names) or "nothing",
        search.gap(hypothesis),
        float(gain / kappa - chance(hypothesis.size - parent.size, search.tried)),
        parameters,
        gap_foreseen(search, hypothesis),
    )


def _rivals(search: Search, looked: Sequence[Hypothesis], over: Hypothesis, best: Hypothesis) -> tuple[Rivals, ...]:
    """What was added to `over`, and each effect that would have explained the records as well in its place."""
    pairs: dict[tuple[str, str], Rivals] = {}
    for other in search.alike(best, looked, over):
        mine = [name for name in best.names if name not in other.names]
        theirs = [name for name in other.names if name not in best.names]
        if len(mine) == len(theirs) == 1 and other.size <= best.size + 1:
            pairs.setdefault((mine[0], theirs[0]), Rivals((mine[0], theirs[0]), (best, other)))
    return tuple(pairs.values())


def free_form(search: Search, before: Identification) -> Reading | None:
    """Best probe on the model the search began with; None where none applies to the rig."""
    if not search.curves:
        tell = lambda share: search.tell("probing for what has no name", share)  # noqa: E731
        tell(0.0)
        search.curves = tuple(probe_all(search.task, search.base, before, search.ground, search.kappa, tell))
    return next(iter(search.curves), None)


def is_rival(search: Search, reading: Reading | None, best: Hypothesis) -> bool:
    """Whether one curve of one variable explains more than what was named, which then merely helped.

    Effects that are what is missing explain more with a few parameters than a curve does with many.
    """
    if reading is None:
        return False
    curve = reading.hypothesis.fit.cost
    return outdone(best.fit.cost, best.size, curve, len(reading.heights), search.kappa)
