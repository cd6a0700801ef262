"""The fit of what a search found, by the estimator of every fit, and what it says of an effect that it loses."""

from __future__ import annotations

from dataclasses import replace

from fibrefit.core.declarations import Statement
from fibrefit.core.limits import Budget, time_limit
from fibrefit.discovery.engine.candidates import own_task_by_record
from fibrefit.discovery.engine.effort import (
    FINAL_STARTS,
    TOO_FAR,
    final_spread,
    motion_lost,
    time_for_gls,
    time_for_starts,
)
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.forward_selection import Limits
from fibrefit.discovery.search.inputs import coefficients_of, is_held_back
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import is_far
from fibrefit.discovery.search.time_budget import FITTED_AGAIN, slowdown
from fibrefit.fitting.checks import COMPLETION
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification, total
from fibrefit.fitting.search.optimum import Ended
from fibrefit.fitting.search.rescue import record_that_lost_a_bounce


def fit_of_found(
    search: Search, best: LaplaceFit, before: Identification, limits: Limits, budget: Budget, longer: float
) -> tuple[LaplaceFit, Identification, list[Statement]]:
    """What was found and its fit; without what no fit finds again, and what is said of that.

    Where inputs have errors the evidence is that of readings linearised in them. A fit that loses a bounce with an
    effect that the model without it does not lose shows that the effect is not what is missing. Where inputs are exact
    so is the motion that the search followed, and it is the fit that ended in a wrong minimum.
    """
    said: list[Statement] = []
    gone: tuple[str, ...] = ()
    while best.effects:
        starts = FINAL_STARTS if time_for_starts(budget.left, longer) else 0
        after = final_fit(search, best, starts, limits.seed, budget)
        asked = limits.choose is None and not is_cut(after)
        trouble = trouble_of(search, best, before, after) if asked else None
        if trouble is None or trouble.identifier != "lost":
            if said and is_cut(after):
                said = [Statement("lost", {**said[0].facts, "beside": best.names})]
            return best, after, said if trouble is None else [trouble]
        # What loses the bounce without those that were added later is to blame, and not these.
        said, gone = [Statement("lost", {**trouble.facts, "later": gone})], (*gone, best.names[-1])
        best = search.inference.without(best, best.effects[:-1])
    return best, before, said


def fit_without_effects(
    search: Search, best: LaplaceFit, before: Identification, limits: Limits, budget: Budget
) -> Identification:
    """The fit of a model without further effects: the first one, or where that lost a motion which the search found."""
    if not is_far(before) or is_held_back(best):
        return before
    again = final_fit(search, best, FINAL_STARTS if time_for_starts(budget.left, 0.0) else 0, limits.seed, budget)
    return again if total(again.gap) < total(before.gap) else before


def trouble_of(search: Search, found: LaplaceFit, before: Identification, after: Identification) -> Statement | None:
    """What is wrong with the fit of what was found, beside that without it; None where nothing is."""
    if found.supermodel.sensitivities is None:
        if not motion_lost(total(before.gap), total(after.gap)):
            return None
        return Statement("fit_in_wrong_minimum", {"gaps": (search.gap_left(found), total(after.gap))})
    if (record := record_that_lost_a_bounce(before.record_gaps, after.record_gaps)) is None:
        return None
    gaps = total(before.record_gaps[record]), total(after.record_gaps[record])
    return Statement("lost", {"effect": found.names[-1], "record": record, "gaps": gaps})


def takes_longer(search: Search, best: LaplaceFit, before: Identification) -> float:
    """Time in s by which a final fit takes longer than the first one: its simulations may be slower."""
    return FITTED_AGAIN * before.running * (slowdown(search, best) - 1.0) if best.effects else 0.0


def is_cut(found: Identification) -> bool:
    """Whether a fit, or a step of it, ended for lack of time: a motion that it loses says nothing of an effect then."""
    return found.cut_short or any(check.identifier == COMPLETION and not check.passed for check in found.checks)


def final_fit(search: Search, best: LaplaceFit, starts: int, seed: int, budget: Budget) -> Identification:
    """The fit of what was found, from so many starts about it; without any, and on a drive, it begins where that is."""
    plain = search.plain(best)
    task, local = own_task_by_record(search.task, plain)
    # Every candidate was searched for from many places: here a few starts around the best one, over whole records, do.
    nearby = replace(
        task,
        start=task.problem.layout.means_of(local),
        spread=final_spread(task.spread),
        horizons=task.horizons[:1, -1:],
    )
    coefficients, differ = coefficients_of(search, best), bool(best.evidence.mode.sigma.any())
    # Values that all records share lose bounces of records that differ: from there nothing is found that a search knew.
    coefficients = {} if coefficients is None and (differ or not starts) else coefficients
    # Where much is missing, readings count up to the first bounce alone: a fit takes them whole.
    near = None if search.gap(plain) > TOO_FAR else best.supermodel.sensitivities
    # Where records differ, an estimate that takes them for alike loses bounces, and says nothing.
    whiten = differ or time_for_gls(budget.left, budget.seconds)
    # What one law more would be worth has been looked for.
    how = How(whiten=whiten, rivals=False, ended=Ended(local, differ, coefficients, near))
    with time_limit(budget.left):
        return identify(
            nearby, starts if coefficients is None else 1, seed, how,
            progress=search.tell, stop=lambda: budget.left < 0.0,
        )  # fmt: skip
