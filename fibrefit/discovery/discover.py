"""Find what a model lacks: where, which effect, added and shown; or that no known effect accounts for it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.discovery.curves.curves import drawn
from fibrefit.discovery.curves.free_form import Reading, described, probe_all
from fibrefit.discovery.design.distinguish import detectable
from fibrefit.discovery.design.rivals import Rivals, parted
from fibrefit.discovery.engine.candidates import Hypothesis, carried
from fibrefit.discovery.engine.marginal import Weighed
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.forward_selection import Limits, Selection, candidates, forward_select
from fibrefit.discovery.model.finding import Finding, Parting, Unexplained
from fibrefit.discovery.residuals import where
from fibrefit.discovery.residuals.events import events
from fibrefit.discovery.residuals.innovations import Alarm, tests_of
from fibrefit.discovery.search.cross_validation import held_out
from fibrefit.discovery.search.inputs import with_inputs
from fibrefit.discovery.search.search import Progress, Search
from fibrefit.discovery.search.setup import begun
from fibrefit.discovery.search.weighing import weights
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
    before = identify(task, STARTS, limits.seed, whiten=False, progress=progress)
    if reasons := _broken(before):
        return _not_trusted(before, reasons, began)
    search, base = begun(task, before, effects, tell)
    return _concluded(before, base, forward_select(search, base, before, limits), limits, began)


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


def _concluded(before: Identification, base: Weighed, at: Selection, limits: Limits, began: float) -> Finding:
    search, best = at.search, at.best
    search.tell("testing the innovations", None)
    alarms = _alarms(search, best)
    readings = probe_all(search, best, before, NAMED)
    complete = not alarms and not readings
    if not complete and best.effects and (instead := _outdone(search, base, best, before)):
        best, readings = instead
    rounds = tuple(found for found in at.rounds if set(found.added.split(" + ")) & set(best.names))
    search.tell("fitting the final model", None)
    after = before if not best.effects else _final(search, best, limits.seed)
    kept = search.plain(best)
    if complete:
        verdict, reason = _explained(best)
        unexplained = Unexplained(search.gap(kept) if verdict == "nothing_missing" else total(after.gap))
    else:
        said = [alarm.says for alarm in alarms] or [f"{described(readings[0])} gains {readings[0].gain:.3g} nats."]
        verdict, reason = "unexplained", f"{NO_EFFECT} {' '.join(said)}"
        unexplained = Unexplained(total(after.gap), where.places(after), _looks_like(kept, search, after, readings))
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
        held_out=held_out(search, search.base, kept) if best.effects else (),
        ranking=() if at.look is None else candidates(at.look),
        seconds=time.perf_counter() - began,
        weights=weights(search, best, after) if best.effects else (),
        detectable=() if best.effects or not complete else detectable(search),
        partings=_partings(search, tuple(rivals.values())),
        curves=() if complete else drawn(readings, after, search.samples),
    )


def _alarms(search: Search, best: Weighed) -> list[Alarm]:
    """Tests of the innovations that say the model is not complete."""
    tested = tests_of(search.scales, best, search.task.traces, search.task.problem.model.rig.channels)
    return [alarm for alarm in tested if alarm.raised]


def _outdone(
    search: Search, base: Weighed, best: Weighed, before: Identification
) -> tuple[Weighed, list[Reading]] | None:
    """The base and its curves, where one of them makes the records more probable than what was named."""
    if best.frame.reactions is not base.frame.reactions:
        local = carried(search.base.frame, search.base.fit.local, base.frame, base.local)
        base = search.scales.weigh(search.base.frame, (), local)
    else:
        base = search.scales.again(base)
    readings = probe_all(search, base, before, best.log - base.log + NAMED)
    return (base, readings) if readings else None


def _untried(search: Search, best: Weighed) -> list[tuple[str, str]]:
    """Each effect with those that no record of the rig tells from it and that were not tried."""
    tried = {effect.name for effect in search.effects}
    return [(effect.name, other) for effect in best.effects for other in look_alikes(effect) if other not in tried]


def _partings(search: Search, rivals: Sequence[Rivals]) -> tuple[Parting, ...]:
    found = []
    for i, pair in enumerate(rivals):
        search.tell("looking for records that tell effects apart", i / len(rivals))
        found.append(parted(search, pair))
    return tuple(parting for parting in found if parting is not None)


def _taken_out(at: Selection, best: Weighed) -> list[str]:
    """What is said of effects that were added and are not kept."""
    added = [name for found in at.rounds for name in found.added.split(" + ")]
    gone = [name for name in dict.fromkeys(added) if name not in best.names]
    if not gone or not best.effects:
        return []
    plural = len(gone) > 1
    said = f"{' and '.join(gone)} {'were' if plural else 'was'} added and taken out again: with the others "
    return [f"{said}{'they are' if plural else 'it is'} no longer more than chance."]


NO_EFFECT = "A gap is left that no effect of the catalogue, alone or with others, accounts for."


def _explained(best: Weighed) -> tuple[str, str]:
    """Verdict and reason where innovations are noise, and no curve explains more than what was named."""
    levels = best.evidence.grid[int(np.argmax(best.evidence.weight))]
    left = "noise" if not levels.any() else "noise, and base parameters that differ a little between records"
    return (
        "named" if best.effects else "nothing_missing",
        f"What is left is {left}: no test of the innovations objects.",
    )


TELLS = 0.6
"""Share of the gap a curve must account for to be what the missing effect looks like."""


def _looks_like(kept: Hypothesis, search: Search, found: Identification, readings: Sequence[Reading]) -> str:
    """What is left of a fit in words: an event in time, or the free curve that accounts for most of it."""
    whole = max(kept.fit.cost - search.samples, 1.0)
    share = 0.0 if not readings else min((kept.fit.cost - readings[0].hypothesis.fit.cost) / whole, 1.0)
    if share < TELLS and (event := _event(found)):
        return event
    if not readings:
        return f"nothing that is known of; {where.in_words(found)}"
    return f"{described(readings[0])}; it accounts for {100 * max(share, 0.0):.0f} % of the gap"


def _event(found: Identification) -> str:
    """Records that part from the model at some instant and go on so; empty where none does."""
    if (one := where.onset(found)) is not None:
        others = ", the other records do not" if len(found.problem.layout.records) > 1 else ""
        return f"an event in time: {one[0]} parts from the model at {one[1]:.3f} s{others}"
    parting = [f"{record} at {instant:.3f} s" for record, instant in events(found)]
    return f"an event in time: records part from the model, {', '.join(parting)}" if parting else ""


def _final(search: Search, best: Weighed, seed: int) -> Identification:
    task, values = search.task_with(best)
    found = with_inputs(search, best)
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
