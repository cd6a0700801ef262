"""Find what a model lacks: where, which effect, added and shown; or that no known effect accounts for it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.discover import where
from fibrefit.discover.begin import begun
from fibrefit.discover.candidates import Hypothesis, alone
from fibrefit.discover.curves import drawn
from fibrefit.discover.evidence import NOISE_LIKE, chance, outdone
from fibrefit.discover.finding import Candidate, Finding, HeldOut, Round, Unexplained
from fibrefit.discover.free_form import Reading, described, probe_all
from fibrefit.discover.refit import Subset, refit, standard_errors
from fibrefit.discover.search import BEAM, Progress, Search
from fibrefit.discover.weighing import only_sure, weights
from fibrefit.effects.law import Effect
from fibrefit.fit.identify import identify
from fibrefit.fit.judge import CONVERGED
from fibrefit.fit.result import Identification, total
from fibrefit.problem.task import Task

STARTS = 8
FINAL_STARTS = 3
NEARBY = 1.01
"""Factor by which parameters of the final starts differ from the best ones."""
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


def discover(
    task: Task, effects: Sequence[type[Effect]], limits: Limits | None = None, progress: Progress | None = None
) -> Finding:
    """Search for the effects a model lacks.

    Parameters
    ----------
    task : Task
        Of the model to begin with.
    effects : sequence of Effect classes
        That may be missing, each applicable to the rig.
    limits : Limits, optional
    progress : callable, optional
        Told what is being done and the share that is finished.

    Returns
    -------
    Finding
    """
    began, limits, tell = time.perf_counter(), limits or Limits(), progress or (lambda what, share: None)
    before = identify(task, STARTS, limits.seed, progress=progress)
    if reasons := _broken(before):
        return _not_trusted(before, reasons, began)
    search = begun(task, before, effects, tell)
    return _concluded(before, _climb(search, before, limits), limits, began)


ASTRAY = 0.05
"""Share of the cost a further step of the base fit may promise: at a kink the last bit of a bad fit is hard to get."""


def _broken(before: Identification) -> str:
    """Why nothing can be said of what the base model lacks; empty where something can.

    A model that lacks much comes to no rest where bounces begin or cease. What it has yet to gain is little beside what
    it lacks, and every candidate is held against a base that is fitted again from where the candidate ended.
    """
    astray = ASTRAY * before.problem.n_measured
    return " ".join(
        check.says
        for check in before.checks
        if check.fatal and not check.passed and not (check.name == CONVERGED and (check.statistic or 0.0) <= astray)
    )


@dataclass(frozen=True)
class _Climbed:
    """Where a search has come to.

    Parameters
    ----------
    search : Search
        In its last state.
    best : Hypothesis
    rounds : tuple of Round
    looked : tuple of Hypothesis
        Candidates of the last round, best first.
    rivals : tuple of (str, str)
        What was added last, each with an effect that does as well.
    """

    search: Search
    best: Hypothesis
    rounds: tuple[Round, ...] = ()
    looked: tuple[Hypothesis, ...] = ()
    rivals: tuple[tuple[str, str], ...] = ()


def _climb(search: Search, before: Identification, limits: Limits) -> _Climbed:
    """Add effects while the records ask for them."""
    at, beam = _Climbed(search, search.base), [search.base]
    while len(at.best.effects) < limits.max_effects:
        if at.best.effects:
            if search.is_noise(at.best) and not search.leaves_much(at.best):
                break
            if (anew := search.anew(at.best)) is not None:
                search, best = anew
                at, beam = replace(at, search=search, best=best), [best]
        if len(at.best.effects) > 1 and _is_rival(search, _free_form(search, before), at.best):
            break
        looked = search.extended(beam, f"trying each effect, round {len(at.rounds) + 1}")
        if not looked:
            break
        at = replace(at, looked=tuple(looked))
        chosen = _chosen(search, looked, at.best, limits)
        if chosen is None or not search.is_significant(chosen, at.best):
            break
        polished = Hypothesis(
            chosen.effects,
            refit(chosen.frame, search.ground.subset(chosen.effects), chosen.fit.local, search.ground.whole, 40, 1e-6),
            chosen.frame,
        )
        found, rivals = _round(search, before, at.best, polished, looked), _rivals(search, looked, at.best, polished)
        at = replace(at, best=polished, rounds=(*at.rounds, found), rivals=rivals)
        beam = [polished, *(other for other in looked if other.effects != chosen.effects)][:BEAM]
    return at


def _chosen(search: Search, looked: Sequence[Hypothesis], over: Hypothesis, limits: Limits) -> Hypothesis | None:
    if limits.choose is None:
        return search.simplest(looked, over)
    name = limits.choose([_candidate(search, hypothesis, search.base) for hypothesis in looked[:LISTED]])
    return next((hypothesis for hypothesis in looked if name in hypothesis.names), None)


def _round(
    search: Search, before: Identification, parent: Hypothesis, chosen: Hypothesis, looked: Sequence[Hypothesis]
) -> Round:
    ranking = tuple(_candidate(search, hypothesis, parent, errors=i < LISTED) for i, hypothesis in enumerate(looked))
    added = " + ".join(name for name in chosen.names if name not in parent.names)
    gaps = search.gap(parent), search.gap(chosen)
    changes = _changes(parent, chosen)
    sentence = f"{added}: the gap falls from {gaps[0]:.3g} to {gaps[1]:.3g} times the noise. {changes}".strip()
    if not parent.effects:
        sentence = f"{where.in_words(before)}. {sentence}"
    return Round(added, *gaps, where.places(before) if not parent.effects else (), ranking, sentence)


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
    return f"With it {' and '.join(said)}." if said else ""


def _candidate(search: Search, hypothesis: Hypothesis, parent: Hypothesis, errors: bool = True) -> Candidate:
    kappa = search.colour(hypothesis, parent)
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
        float(gain / kappa - chance(hypothesis.size - parent.size)),
        parameters,
    )


def _concluded(before: Identification, at: _Climbed, limits: Limits, began: float) -> Finding:
    search, rounds = at.search, at.rounds
    best = search.pruned(at.best) if len(at.best.effects) > 1 else at.best
    if best.effects and not search.is_noise(best):
        best = only_sure(search, best)
        rounds = tuple(found for found in rounds if set(found.added.split(" + ")) & set(best.names))
    reading = None if _is_plain(search, best) else _free_form(search, before)
    verdict, reason, unexplained = _verdict(search, before, best, reading)
    if verdict == "unexplained" and reading is not None and _has_only_helped(search, reading, best):
        best, rounds = search.base, ()
    search.tell("fitting the final model", None)
    after = before if not best.effects else _final(search, best, limits.seed)
    if verdict != "nothing_missing":
        unexplained = replace(unexplained, gap=total(after.gap))
    return Finding(
        verdict=verdict,
        reason=reason,
        added=best.effects,
        rounds=rounds,
        cannot_tell_apart=tuple(pair for pair in at.rivals if pair[0] in best.names),
        unexplained=unexplained,
        before=before,
        after=after,
        held_out=_held_out(search, best) if best.effects else (),
        ranking=tuple(_candidate(search, other, search.base, i < LISTED) for i, other in enumerate(at.looked)),
        seconds=time.perf_counter() - began,
        weights=weights(search, best, after) if best.effects else (),
        curves=()
        if verdict != "unexplained"
        else drawn(search.curves, before, search.ground, search.samples, search.kappa),
    )


def _is_plain(search: Search, best: Hypothesis) -> bool:
    """Whether nothing is left that a probe should look at: noise, explained by at most one effect."""
    return search.is_noise(best) and len(best.effects) <= 1


def _free_form(search: Search, before: Identification) -> Reading:
    """Best probe on the model the search began with."""
    if not search.curves:
        tell = lambda share: search.tell("probing for what has no name", share)  # noqa: E731
        tell(0.0)
        search.curves = tuple(probe_all(search.base, before, search.ground, search.kappa, tell))
    return search.curves[0]


def _is_rival(search: Search, reading: Reading, best: Hypothesis) -> bool:
    """Whether one curve of one variable explains more than what was named, which then merely helped.

    Effects that are what is missing explain more with a few parameters than a curve does with many.
    """
    curve = reading.hypothesis.fit.cost
    return outdone(best.fit.cost, best.size, curve, len(reading.heights), search.kappa)


NEARLY_ALL = 1.15
"""Gap up to which a curve has explained all there was to explain, or nearly so."""
MOST = 0.7
"""Share of what a curve explains from which a name stands beside it, where both leave much."""


def _has_only_helped(search: Search, reading: Reading, best: Hypothesis) -> bool:
    """Whether what was named is not to be kept: a curve explains all, or much more.

    Where even the curve leaves much, it is better than a name by what its many knots happen to fit.
    """
    if not _is_rival(search, reading, best):
        return False
    whole, curve = search.base.fit.cost, reading.hypothesis.fit.cost
    return search.gap(reading.hypothesis) <= NEARLY_ALL or whole - best.fit.cost < MOST * (whole - curve)


def _verdict(
    search: Search, before: Identification, best: Hypothesis, reading: Reading | None
) -> tuple[str, str, Unexplained]:
    noise_like = search.is_noise(best)
    if noise_like and reading is None:
        plain = not search.only_scatters(best) or search.gap(best) <= NOISE_LIKE
        left = (
            "noise" if plain else "noise, and base parameters that differ by some tenths of a percent between records"
        )
        verdict = "named" if best.effects else "nothing_missing"
        return verdict, f"What is left is {left}.", Unexplained(search.gap(best))
    if noise_like and reading is not None and not _is_rival(search, reading, best):
        return "named", "What is left is noise, and no single curve explains more.", Unexplained(search.gap(best))
    looks = _looks_like(search, before, best, reading)
    reason = "A gap is left that no effect of the catalogue, alone or with others, accounts for."
    return "unexplained", reason, Unexplained(search.gap(best), where.places(before), looks)


TELLS = 0.6
"""Share of the gap a curve must account for to be what the missing effect looks like."""


def _looks_like(search: Search, before: Identification, best: Hypothesis, reading: Reading | None) -> str:
    whole = max(search.base.fit.cost - search.samples, 1.0)
    share = 0.0 if reading is None else min((search.base.fit.cost - reading.hypothesis.fit.cost) / whole, 1.0)
    event = where.onset(before)
    if event is not None and share < TELLS:
        return f"an event in time: {event[0]} parts from the model at {event[1]:.3f} s, the other records do not"
    if reading is None:
        return where.in_words(before)
    return f"{described(reading)}; it accounts for {100 * share:.0f} % of the gap"


def _final(search: Search, best: Hypothesis, seed: int) -> Identification:
    task, values = alone(search.task, best)
    found = search.with_inputs(best)
    if found is not None:
        values = found.values
    # Every candidate was searched for from many places: here a few starts around the best one, over whole records, do.
    nearby = replace(
        task,
        start=values,
        spread=dict.fromkeys(task.spread, NEARBY),
        ladders=task.ladders[:1, -1:],
    )
    return identify(nearby, FINAL_STARTS, seed, waves=None if found is None else found.waves, progress=search.tell)


def _rivals(
    search: Search, looked: Sequence[Hypothesis], over: Hypothesis, best: Hypothesis
) -> tuple[tuple[str, str], ...]:
    """What was added to `over`, and each effect that would have explained the records as well in its place."""
    pairs = []
    for other in search.alike(best, looked, over):
        mine = [name for name in best.names if name not in other.names]
        theirs = [name for name in other.names if name not in best.names]
        if len(mine) == len(theirs) == 1 and other.size <= best.size + 1:
            pairs.append((mine[0], theirs[0]))
    return tuple(dict.fromkeys(pairs))


def _held_out(search: Search, best: Hypothesis) -> tuple[HeldOut, ...]:
    records = search.task.problem.layout.records
    if len(records) == 1:
        return ()
    found = []
    for r, record in enumerate(records):
        search.tell("predicting each record from the others", r / len(search.task.traces))
        found.append(HeldOut(record, *(_predicted(search, hypothesis, r) for hypothesis in (search.base, best))))
    return tuple(found)


def _predicted(search: Search, hypothesis: Hypothesis, record: int) -> float:
    ground = search.ground
    others, alone = ground.whole.copy(), np.zeros_like(ground.whole)
    others[record], alone[record] = 0, ground.whole[record]
    fitted = refit(hypothesis.frame, ground.subset(hypothesis.effects), hypothesis.fit.local, others, 15)
    own = refit(hypothesis.frame, Subset((), ground.each), fitted.local, alone, 15)
    return float(np.sqrt(own.cost / search.base.frame.samples[record]))


def _not_trusted(before: Identification, reason: str, began: float) -> Finding:
    gap = total(before.gap)
    return Finding(
        "not_trusted", reason, (), (), (), Unexplained(gap), before, before, (), (), time.perf_counter() - began
    )
