"""What a search ends with: tests of what was found, the verdict, and the fit of the final model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar

import numpy as np

from fibrefit.core.declarations import Statement
from fibrefit.core.limits import Budget, check_time, in_time
from fibrefit.discovery.choice import candidates
from fibrefit.discovery.curves.curves import drawn, with_law_over
from fibrefit.discovery.curves.free_form import FittedCurve, curve_facts, probe_all, proposing
from fibrefit.discovery.design.distinguish import detectable
from fibrefit.discovery.design.rivals import Rivals, separating_experiment
from fibrefit.discovery.engine.candidates import Hypothesis, transferred
from fibrefit.discovery.engine.effort import (
    FINAL_STARTS,
    time_for_starts,
)
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import LIKENESS, NAMED, TELLS
from fibrefit.discovery.final_fit import final_fit, fit_of_found, fit_without_effects, is_cut, takes_longer, trouble_of
from fibrefit.discovery.forward_selection import Limits, Selection
from fibrefit.discovery.laws.told import ToldLaw, law_for, law_over_course, told_by_fit
from fibrefit.discovery.model.finding import Finding
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.discovery.pairs import curves_beyond
from fibrefit.discovery.residuals import where
from fibrefit.discovery.residuals.innovations import Alarm
from fibrefit.discovery.search.alarms import alarms_of
from fibrefit.discovery.search.cross_validation import held_out
from fibrefit.discovery.search.effect_sizes import effect_sizes, of_interest
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import is_far
from fibrefit.fitting.result import Identification, total
from fibrefit.laws.catalogue import look_alikes
from fibrefit.laws.ports import PORTS
from fibrefit.study.summaries.discovery import Candidate, Separation, Unexplained, Verdict

T = TypeVar("T")


@dataclass(frozen=True)
class _Parts:
    """Parts of a conclusion: each is done within a share of the time that is left, or left out and reported so.

    Parameters
    ----------
    budget : Budget
    kept : float
        Time in s kept for the fit to come: by which that of the final model takes longer than the first one, as its
        simulations are slower, then all of that with a law; a part takes none of it.
    undone : list of str
        What the time did not suffice for.
    """

    budget: Budget
    kept: float = 0.0
    undone: list[str] = field(default_factory=list)

    def take(self, what: str, job: Callable[[], T], otherwise: T, share: float = 0.5) -> T:
        """Result of a part; `otherwise` where its share of the time is over before it is done."""
        found, came = in_time(job, otherwise, share * (self.budget.left - self.kept))
        if not came:
            self.undone.append(what)
        return found


def concluded(before: Identification, base: LaplaceFit, at: Selection, limits: Limits, budget: Budget) -> Finding:
    """What a selection amounts to.

    Parameters
    ----------
    before : Identification
        Of the model the search began with.
    base : LaplaceFit
        The same model.
    at : Selection
    limits : Limits
    budget : Budget
        Of time.
    """
    search, parts = at.search, _Parts(budget, takes_longer(at.search, at.best, before))
    alarms, best, law, curves = _left_beside(parts, at, base, before)
    search.tell("fitting the final model", None)
    # What was found too small for interest is still there: what is left is that of a model with it.
    found, (wanted, small) = best, of_interest(search, best, limits.least)
    best, after, refused = fit_of_found(search, wanted, before, limits, budget, parts.kept)
    if law is None and not best.effects:  # The final fit is that with a law, where there is one.
        after = fit_without_effects(search, best, before, limits, budget)
    alarms = alarms if best is wanted else alarms_of(search, best)
    # What is still to be fitted comes last, and no other part takes its time.
    kept_for_law = 0.0 if law is None else before.running + takes_longer(search, law.fit, before)
    complete, parts = not alarms and not curves and best is wanted, replace(parts, kept=kept_for_law)
    kept, untried, added = search.plain(best), _left_out(at), bool(best.effects)
    cut, tried = bool(untried or at.cut_short or at.undone or parts.undone), bool(at.steps or _ranking(at) or law)
    verdict, reason = _of_whole_records(*_verdict(best, alarms, curves, cut, tried), after)
    verdict, reason = _after_refusal(verdict, reason, best is not wanted)
    stays = _curve_stays(parts, law, curves)
    law = None if verdict == "not_trusted" else law
    known = tried or not cut or bool(curves)
    rivals = _rivals_told(at.rivals, best)
    predicted = partial(held_out, search, search.base, kept)
    finding = Finding(
        verdict=verdict,
        reason=(*reason, *small, *(refused or _taken_out(at, found)), *stays),
        added=best.effects,
        steps=tuple(step for step in at.steps if set(step.added) & set(best.names)),
        cannot_tell_apart=tuple(dict.fromkeys((*rivals, *_never_tried(search, best)))),
        unexplained=_left_over(search, kept, after, None if complete else curves),
        looks_like=None if complete or not known else _looks_like(kept, search, after, curves, cut),
        before=before,
        after=after,
        held_out=parts.take("left_out", predicted, ()) if added else (),
        ranking=_ranking(at),
        seconds=budget.used,
        weights=parts.take("weights", partial(effect_sizes, search, best, after), ()) if added else (),
        detectable=parts.take("detectable", partial(detectable, search, best), ()) if verdict == NOTHING else (),
        separated_by=parts.take("rivals", partial(_separated, search, tuple(rivals.values())), (), 0.9),
        proposed_law=law and law.told,
        untried=untried,
    )
    if law is not None:
        gone = set(found.effects) - set(best.effects)
        finding = _with_law(finding, law.without(gone), before, limits.seed, budget)
    return replace(finding, undone=_undone(at, finding, parts), seconds=budget.used)


def _rivals_told(rivals: Sequence[Rivals], best: LaplaceFit) -> dict[tuple[str, ...], Rivals]:
    """Rivals of what is in the final model; what was added since it was one stands beside what it was a rival of."""
    return {one.names: one for one in rivals if one.names[0] in best.names and one.names[1] not in best.names}


def _undone(at: Selection, finding: Finding, parts: _Parts) -> tuple[str, ...]:
    """What the time did not suffice for, effects that were not tried aside."""
    further = ("further",) if at.cut_short else ()
    of_law = _not_predicted(at.search, finding.proposed_law)
    final = ("final_fit",) if finding.after is not finding.before and is_cut(finding.after) else ()
    return tuple(dict.fromkeys((*further, *at.undone, *of_law, *final, *parts.undone)))


def _with_law(finding: Finding, law: ToldLaw, before: Identification, seed: int, budget: Budget) -> Finding:
    """A finding whose final fit is that with a law, told as that has it; without the law where that loses a motion.

    Where inputs are exact it is the fit that ended in a wrong minimum, as of an effect (`fit_of_found`); one that the
    time cut short says nothing of the law.
    """
    (search, fit, told), said = law, list[Statement]()
    starts = FINAL_STARTS if time_for_starts(budget.left, takes_longer(search, fit, before)) else 0
    after = final_fit(search, fit, starts, seed, budget)
    if trouble := None if is_cut(after) else trouble_of(search, fit, finding.after, after):
        if trouble.identifier == "lost":
            gone = [trouble, *([Statement("curve_stays")] if finding.unexplained.curves else [])]
            return replace(finding, proposed_law=None, reason=(*finding.reason, *gone))
        said.append(trouble)
    told = told_by_fit(told, law.effect, after)
    left = finding.unexplained
    over = left.model_copy(update={"curves": with_law_over(left.curves, told)})
    return replace(finding, after=after, proposed_law=told, unexplained=over, reason=(*finding.reason, *said))


def _left_beside(
    parts: _Parts, at: Selection, base: LaplaceFit, before: Identification
) -> tuple[list[Alarm], LaplaceFit, ToldLaw | None, list[FittedCurve]]:
    """Tests that object to what was selected, that or what a curve does better, and a law and free curves beside it.

    Where a test objects to a law over a state, one over the course of a record may be more probable.
    """
    search, best, law = at.search, at.best, at.law and ToldLaw(at.search, *at.law)
    search.tell("testing the innovations", None)
    alarms, draw = alarms_of(search, best), partial(curves_beyond, search, best, before)
    curves = parts.take("curves", draw, list[FittedCurve]()) if at.curves is None else list(at.curves)
    if law is not None or not (alarms or curves):
        return alarms, best, law, curves
    if best.effects:
        instead = parts.take("curves_instead", partial(_outdone, search, base, best, before), None)
        best, curves = instead or (best, curves)
    if curves or "curves" in parts.undone:
        proposals = curves or parts.take("curves", partial(proposing, search, best, before, tuple(PORTS)), curves)
        law = parts.take("law", partial(law_for, search, best, before, proposals), None)
    if (law is None or alarms_of(law.search, law.fit)) and "law" not in parts.undone:
        course = parts.take("law", partial(law_over_course, search, best, before, curves), None)
        if course is not None and (law is None or course[0].told.summary.evidence > law.told.summary.evidence):
            law, curves = course
    return alarms, best, law, curves


def _curve_stays(parts: _Parts, law: ToldLaw | None, curves: Sequence[FittedCurve]) -> list[Statement]:
    """Said where laws for free curves were fitted and none does better."""
    return [Statement("curve_stays")] if curves and law is None and "law" not in parts.undone else []


def _not_predicted(search: Search, law: ProposedLaw | None) -> tuple[str, ...]:
    """What is left undone where no record was predicted from the others with a law."""
    several = len(search.context.whole) > 1
    return ("left_out",) if law is not None and several and law.summary.gap_left_out is None else ()


NOTHING: Verdict = "nothing_missing"


def _verdict(
    best: LaplaceFit, alarms: Sequence[Alarm], curves: Sequence[FittedCurve], cut: bool, tried: bool
) -> tuple[Verdict, tuple[Statement, ...]]:
    """Verdict and reason; where the time ended early, nothing is only said to be missing of what was tried."""
    if alarms or curves:
        gains = [Statement("curve_gains", curve_facts(one) | {"gain": one.gain}) for one in curves[:1]]
        statements = [alarm.statement for alarm in alarms] or gains
        if cut and not (tried or best.effects):
            return "not_trusted", (Statement("all_untried"), *statements)
        return "unexplained", (Statement("none_tried" if cut else "no_effect"), *statements)
    if cut and not best.effects:
        return "not_trusted", (Statement("time_ended"),)
    # Innovations are noise, and no curve explains more than what was named.
    levels = best.evidence.grid[int(np.argmax(best.evidence.weight))]
    noise = Statement("noise_left", {"between_records": bool(levels.any())})
    return "named" if best.effects else NOTHING, (noise, *([Statement("no_further_look")] if cut else []))


def _of_whole_records(
    verdict: Verdict, reason: tuple[Statement, ...], after: Identification
) -> tuple[Verdict, tuple[Statement, ...]]:
    """A verdict, unless nothing is said to be missing where a fit of whole records loses the motion.

    Then readings were looked at up to the first bounce alone, and that these are noise says nothing of the others.
    """
    if verdict != NOTHING or not is_far(after):
        return verdict, reason
    return "not_trusted", (Statement("motion_lost", {"gap": total(after.gap)}),)


def _after_refusal(
    verdict: Verdict, reason: tuple[Statement, ...], refused: bool
) -> tuple[Verdict, tuple[Statement, ...]]:
    """A verdict, unless an effect was taken out that no fit finds again.

    Something gained more than chance and is not what is missing: that was not found, though no test objects now.
    """
    return ("unexplained", ()) if refused and verdict in ("named", NOTHING) else (verdict, reason)


def _left_over(
    search: Search,
    kept: Hypothesis,
    after: Identification,
    curves: Sequence[FittedCurve] | None,
) -> Unexplained:
    """What no effect accounts for; `curves`, the free ones, is None where the model is complete."""
    if curves is None:
        return Unexplained(gap=total(after.gap) if kept.effects else search.gap(kept))
    return Unexplained(
        gap=total(after.gap),
        where=where.places(after.residual_set),
        curves=drawn(curves, after),
    )


def _ranking(at: Selection) -> tuple[Candidate, ...]:
    """Candidates of the last round, the best first."""
    return () if at.comparison is None else candidates(at.comparison)


def _left_out(at: Selection) -> tuple[str, ...]:
    """Names of effects that the time did not suffice for in the last round."""
    return () if at.comparison is None else tuple(effect.name for effect in at.comparison.untried)


def _outdone(
    search: Search, base: LaplaceFit, best: LaplaceFit, before: Identification
) -> tuple[LaplaceFit, list[FittedCurve]] | None:
    """The base and its curves, where one of them makes the records more probable than what was named."""
    if best.supermodel.sensitivities is not base.supermodel.sensitivities:
        local = transferred(search.base.supermodel, base.supermodel, base.local, search.base.fit.local)
        base = search.inference.fitted(search.base.supermodel, (), local)
    else:
        base = search.inference.again(base)
    # A curve has its gain divided by an overdispersion, the name has not: it takes more to lose a name than to get it.
    gain = search.inference.again(best).log - base.log
    # A curve holds much of what has a name, an offset of a gauge in an error of it that depends on the force: that it
    # does a little more beside takes away no name, and is told as what is left.
    curves = probe_all(search, base, before, gain + max(NAMED, LIKENESS * gain), NAMED)
    check_time()
    return (base, curves) if curves else None


def _never_tried(search: Search, best: LaplaceFit) -> list[tuple[str, str]]:
    """Each effect with those that no record of the rig tells from it and that were not tried."""
    tried = {effect.name for effect in search.effects}
    return [(effect.name, other) for effect in best.effects for other in look_alikes(effect) if other not in tried]


def _separated(search: Search, rivals: Sequence[Rivals]) -> tuple[Separation, ...]:
    found = []
    for i, pair in enumerate(rivals):
        check_time()
        search.tell("looking for records that tell effects apart", i / len(rivals))
        found.append(separating_experiment(search, pair))
    return tuple(record for record in found if record is not None)


def _taken_out(at: Selection, best: LaplaceFit) -> list[Statement]:
    """Effects that were added and are not kept."""
    added = [name for step in at.steps for name in step.added]
    gone = [name for name in dict.fromkeys(added) if name not in best.names]
    return [Statement("taken_out", {"effects": tuple(gone)})] if gone and best.effects else []


def _looks_like(
    kept: Hypothesis, search: Search, found: Identification, curves: Sequence[FittedCurve], cut: bool
) -> Statement:
    """What is left of a fit: an event in time, or the free curve that accounts for most of it.

    A search that was `cut` short knows of more than it has tried.
    """
    whole = max(kept.fit.cost - search.samples, 1.0)
    share = 0.0 if not curves else min((kept.fit.cost - curves[0].hypothesis.fit.cost) / whole, 1.0)
    if share < TELLS and (event := where.event_of(found.residual_set)):
        return event
    if not curves:
        return Statement("unknown", {"lies": where.most_of(found.residual_set), "cut": cut})
    return Statement("curve_left", curve_facts(curves[0]) | {"share": max(share, 0.0)})
