"""Find what a model lacks: where, which effect, added and shown; or that no known effect accounts for it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from fibrefit.discovery.curves.curves import drawn
from fibrefit.discovery.curves.free_form import Reading, described, probe_all
from fibrefit.discovery.design.distinguish import detectable
from fibrefit.discovery.design.rivals import Rivals, parted
from fibrefit.discovery.engine.candidates import Hypothesis, alone
from fibrefit.discovery.engine.thresholds import NOISE_LIKE
from fibrefit.discovery.forward_selection import Climbed, Limits, climb, free_form, is_rival, ranking
from fibrefit.discovery.model.finding import Finding, Parting, Unexplained
from fibrefit.discovery.residuals import where
from fibrefit.discovery.residuals.events import events
from fibrefit.discovery.search.cross_validation import held_out
from fibrefit.discovery.search.search import Progress, Search
from fibrefit.discovery.search.setup import begun
from fibrefit.discovery.search.weighing import only_sure, weights
from fibrefit.effects.catalogue import look_alikes
from fibrefit.effects.law import Effect
from fibrefit.fitting.checks import CONVERGED
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification, total
from fibrefit.problem.task import Task

STARTS = 8
FINAL_STARTS = 3
NEARBY = 1.01
"""Factor by which parameters of the final starts differ from the best ones."""


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
    return _concluded(before, climb(search, before, limits), limits, began)


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


def _concluded(before: Identification, at: Climbed, limits: Limits, began: float) -> Finding:
    search = at.search
    best = search.pruned(at.best) if len(at.best.effects) > 1 and limits.choose is None else at.best
    if best.effects and not search.is_noise(best):
        best = only_sure(search, best)
    reading = None if _is_plain(search, best) else free_form(search, before)
    noise_like = search.is_noise(best)
    explained = noise_like and not is_rival(search, reading, best)
    if not explained and reading is not None and _has_only_helped(search, reading, best):
        best = search.base
    rounds = tuple(found for found in at.rounds if set(found.added.split(" + ")) & set(best.names))
    search.tell("fitting the final model", None)
    after = before if not best.effects else _final(search, best, limits.seed)
    readings: tuple[Reading, ...] = ()
    if explained:
        verdict, reason = _explained(search, best, reading)
        unexplained = Unexplained(search.gap(best) if verdict == "nothing_missing" else total(after.gap))
    else:
        verdict, reason, readings = "unexplained", NO_EFFECT, _readings(search, after, best)
        looks = _looks_like(search, after, best, readings[0] if readings else None)
        unexplained = Unexplained(total(after.gap), where.places(after), looks)
    rivals = {found.names: found for found in at.rivals if found.names[0] in best.names}
    return Finding(
        verdict=verdict,
        reason=" ".join([reason, *_taken_out(at, best)]),
        added=best.effects,
        rounds=rounds,
        cannot_tell_apart=tuple(dict.fromkeys((*rivals, *_untried(search, best)))),
        unexplained=unexplained,
        before=before,
        after=after,
        held_out=held_out(search, best) if best.effects else (),
        ranking=ranking(at),
        seconds=time.perf_counter() - began,
        weights=weights(search, best, after) if best.effects else (),
        detectable=() if best.effects or not explained else detectable(search),
        partings=_partings(search, tuple(rivals.values())),
        curves=() if explained else drawn(readings, after, search.ground, search.samples, search.kappa),
    )


def _untried(search: Search, best: Hypothesis) -> list[tuple[str, str]]:
    """Each effect with those that no record of the rig tells from it and that were not tried."""
    tried = {effect.name for effect in search.effects}
    return [(effect.name, other) for effect in best.effects for other in look_alikes(effect) if other not in tried]


def _partings(search: Search, rivals: Sequence[Rivals]) -> tuple[Parting, ...]:
    found = []
    for i, pair in enumerate(rivals):
        search.tell("looking for records that tell effects apart", i / len(rivals))
        found.append(parted(search, pair))
    return tuple(parting for parting in found if parting is not None)


def _taken_out(at: Climbed, best: Hypothesis) -> list[str]:
    """What is said of effects that were added and are not kept."""
    added = [name for found in at.rounds for name in found.added.split(" + ")]
    gone = [name for name in dict.fromkeys(added) if name not in best.names]
    if not gone or not best.effects:
        return []
    plural = len(gone) > 1
    said = f"{' and '.join(gone)} {'were' if plural else 'was'} added and taken out again: with the others "
    return [f"{said}{'they are' if plural else 'it is'} no longer more than chance."]


def _is_plain(search: Search, best: Hypothesis) -> bool:
    """Whether nothing is left that a probe should look at: noise, explained by at most one effect."""
    return search.is_noise(best) and len(best.effects) <= 1


NEARLY_ALL = 1.15
"""Gap up to which a curve has explained all there was to explain, or nearly so."""
MOST = 0.7
"""Share of what a curve explains from which a name stands beside it, where both leave much."""


def _has_only_helped(search: Search, reading: Reading, best: Hypothesis) -> bool:
    """Whether what was named is not to be kept: a curve explains all, or much more.

    Where even the curve leaves much, it is better than a name by what its many knots happen to fit.
    """
    if not is_rival(search, reading, best):
        return False
    whole, curve = search.base.fit.cost, reading.hypothesis.fit.cost
    return search.gap(reading.hypothesis) <= NEARLY_ALL or whole - best.fit.cost < MOST * (whole - curve)


NO_EFFECT = "A gap is left that no effect of the catalogue, alone or with others, accounts for."


def _explained(search: Search, best: Hypothesis, reading: Reading | None) -> tuple[str, str]:
    """Verdict and reason where what is left is noise, and no single curve explains more than what was named."""
    if reading is not None:
        return "named", "What is left is noise, and no single curve explains more."
    plain = not search.only_scatters(best) or search.gap(best) <= NOISE_LIKE
    left = "noise" if plain else "noise, and base parameters that differ by some tenths of a percent between records"
    return "named" if best.effects else "nothing_missing", f"What is left is {left}."


def _readings(search: Search, found: Identification, best: Hypothesis) -> tuple[Reading, ...]:
    """Free curves on the model that is kept, best first; none where none was asked for."""
    if not best.effects or not search.curves:
        return search.curves
    tell = lambda share: search.tell("probing what is left", share)  # noqa: E731
    return tuple(probe_all(search.task, best, found, search.ground, search.kappa, tell))


TELLS = 0.6
"""Share of the gap a curve must account for to be what the missing effect looks like."""


def _looks_like(search: Search, found: Identification, best: Hypothesis, reading: Reading | None) -> str:
    """What is left of a fit in words: an event in time, or the free curve that accounts for most of it."""
    whole = max(best.fit.cost - search.samples, 1.0)
    share = 0.0 if reading is None else min((best.fit.cost - reading.hypothesis.fit.cost) / whole, 1.0)
    if share < TELLS and (event := _event(found)):
        return event
    if reading is None:
        return f"nothing that is known of; {where.in_words(found)}"
    return f"{described(reading)}; it accounts for {100 * share:.0f} % of the gap"


def _event(found: Identification) -> str:
    """Records that part from the model at some instant and go on so; empty where none does."""
    if (one := where.onset(found)) is not None:
        others = ", the other records do not" if len(found.problem.layout.records) > 1 else ""
        return f"an event in time: {one[0]} parts from the model at {one[1]:.3f} s{others}"
    parting = [f"{record} at {instant:.3f} s" for record, instant in events(found)]
    return f"an event in time: records part from the model, {', '.join(parting)}" if parting else ""


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


def _not_trusted(before: Identification, reason: str, began: float) -> Finding:
    gap = total(before.gap)
    return Finding(
        "not_trusted", reason, (), (), (), Unexplained(gap), before, before, (), (), time.perf_counter() - began
    )
