"""Every number that says how far a search looks, with its meaning: it costs time or a miss.

What decides between explanations stands in `thresholds`. Of those here the ones that say whether a motion was lost show
in a verdict, too: `TOO_FAR`, `MOTION_LOST` and `MET`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from fibrefit.discovery.engine import thresholds
from fibrefit.problem import Effort

Listed = TypeVar("Listed")

FIRST_STARTS = 8
"""Starts of the fit of the first model."""
FIRST_FIT = 0.3
"""Share of the time that the fit of the first model may take."""
NEARLY = 1.1
"""Gap up to which slopes tell where a missing effect leads; beyond it, candidates are searched for in plain squares."""
WRONG_MINIMUM = 8.0
"""Nats below its parent from which a hypothesis, which contains the parent, lies in a minimum of its own."""
LEAST_FALL = 0.2
"""Predicted reduction of a hypothesis's objective, a tenth of a nat, that is left: names differ by nats."""
PATIENCE_OF_DESCENT = 10
"""Evaluations in which a hypothesis has to gain half a nat: the kinks of a bouncing cost are crept along for ever."""
CURVE_STEPS = 30
"""Evaluations of a free curve: it says where laws are to be looked for, and far from a good fit it creeps for hundreds,
to end a thousand nats below the law."""
CURVE_PATIENCE = 6
"""Evaluations in which it has to gain a noticeable share of what it has gained so far: three steps, as every other one
has slopes simulated anew where the cost has kinks."""
CURVE_SHARE = 0.02
"""That share: two curves on a drive had 97 and 98 % of what they came to gain, 2150 nats and 1088, after six and nine
evaluations, and took 45 s for 45 and a hundred."""
WARM_START_STEPS = 10
"""Evaluations of a warm start, a parent from where a candidate ended; where it is more probable there, it goes on."""
CONTINUATION_STEPS = 4
"""Equal steps of continuation in the strength of an effect that is left out, the others refitted."""
LINEARISED_ANEW = 6
"""How often readings are linearised again at the most, before the first round, where records differ: at first each
record is at values of the others."""
SETTLES = 0.5
"""Share of the nats that a test objects by to which linearising readings anew has to bring them for it to be done once
more: an error of linearisation falls by far more each time, what is missing stays."""
NOISES = 2
"""Times the noise of a round is taken from what its best candidate leaves."""
NOISES_OF_STEPS = 5
"""The same of readings in coarse steps, while the noise before rounding moves: each time it comes nearer by half."""
PROMISING = 0.5
"""Share of the largest fall of the cost, after some steps, from which a candidate is refitted in full."""
INSTANTS_MOVED = 3
"""Times instants of a sudden effect are looked for again, each with all else refitted: of two slips one of which began
at half its place in the record, two were needed."""
VALLEYS = 4
"""Frequencies from which an effect that rings is followed."""
HARDLY = 0.05
"""Share of what another effect gains that slopes have to predict of one where that is not beyond doubt, too: in four
driven searches that were traced no effect gained more than 2.1 times what they predicted; one since then gained
five times as much."""
REFITTED = 4
"""Candidates that always are."""
FOLLOWED_AT_ONCE = 8
"""Candidates that are followed before it is tested whether the next ones may still do better than the best of them."""
INSTEAD = 6
"""Candidates that are also followed from where records do not differ: whether they do what differences would."""
WIDELY = 4
"""Candidates whose slopes predict most, that are searched for from every sign and shape; the others from where slopes
predict most of them."""
COMPARED = 3
"""Candidates that are compared anew, and from which the model without them is refitted, whatever they gained."""
FAR_BEHIND = 30.0
"""Nats behind another one from which a candidate is given up: it is not compared again in better known noise, nor where
readings are linearised about it; behind what it contains, its records are not looked for in other minima."""
PARTNERS = 8
"""Effects tried beside each of the best ones where none is found by itself, and in the place of a first effect once a
second one is there."""
IN_SEVERAL = 2
"""Records in which slopes have to predict something of an event, before one that happens in all is looked at."""
CURVES_WITH_LAWS = 3
"""Free curves that laws are looked for in, the best ones."""
LAWS_FITTED = 6
"""Laws that are fitted in full."""
FINAL_STARTS = 3
"""Starts of the final fit, about what was found."""
FINAL_SPREAD = 1.01
"""Factor by which parameters of these starts differ from the best ones."""
STARTS_NEED = 10.0
"""Time that has to be left for a final fit from starts of its own, over what it is expected to take: those of drops
with a fibre of mass took 1.8 and 8.4 times that, the latter 24 s longer than was left of 300."""
LOOKING = 0.8
"""Share of the time left that candidates are given; what remains is for comparing the best ones in one noise."""
PROBING = 0.3
"""Share of the time left that free curves are given before effects are tried in pairs."""
COURSE = 0.3
"""Share of the time left for curves over the course of a record, where curves over a state were drawn."""
SECOND_LOOK = 0.5
"""Share of the time left in which laws are seen about themselves, and in which second variables are looked for."""
SIDE_SEARCH = 0.6
"""Share of the time left that a search beside the rounds may take: for a mistake of the study, for the partners of an
effect, for a law of no name, and each step of that."""
GLS_NEEDS = 0.3
"""Share of the time that has to be left for the GLS estimate of a driven rig."""

MOTION_LOST = 1.1
"""Factor by which more is left, where readings are linearised anew or in a fit, from which a motion was lost."""
TOO_FAR = 1.4
"""Gap over that of a perfect model from which a model with noisy inputs lacks too much to follow bounces: its readings
are taken up to the first bounce alone, and what a candidate leaves is twice what noise does."""
LED = 0.5
"""Share of what a model with noisy inputs leaves of whole records in plain squares that one with a mistake of the study
may leave to be asked about itself, and the best of several of another one: errors of an input are in all of them, and a
bounce that is lost leaves a hundred times as much."""
MET = 3.0
"""Gap of whole records in plain squares up to which what is led there meets all bounces. Errors of a drive leave 1.0 to
1.7 of it (five series whose study was wrong in a slope or a clock); in a series that lacked a friction the best mistake
left 10, where the base model left 15."""
HOPE = 3.0
"""Nats by which slopes may predict less than a curve then gains."""
STEADY_LIMIT = 0.1
"""Relative change of strengths that would just be found, below which they are looked for no more: slopes hardly bend
over less."""


def settles(before: float, after: float) -> bool:
    """Whether linearising anew takes away what a test objects by, in nats."""
    return after < SETTLES * before


def first_fit_ends(used: float, given: float) -> bool:
    """Whether the fit of the first model has taken its share of the time given, both in s."""
    return used > FIRST_FIT * given


def noise_is_taken_again(turn: int, same: bool, settled: Callable[[], bool]) -> bool:
    """Whether hypotheses are compared once more, in the noise that the best of them leaves now.

    Parameters
    ----------
    turn : int
        How often they were.
    same : bool
        Whether the best one is that whose noise it was.
    settled : callable
        Whether the noise before rounding is still the most probable one, see `LaplaceInference.settled_about`.
    """
    return (not same and turn < NOISES) or (turn < NOISES_OF_STEPS and not settled())


def slopes_tell(gap: float) -> bool:
    """Whether a model with such a gap is near enough to what is missing for its slopes to lead there."""
    return gap <= NEARLY


def leads_through(cost: float, before: float) -> bool:
    """Whether what is led to whole records in plain squares may lead through bounces that the model before it loses."""
    return cost < LED * before


def meets_all_bounces(cost: float, samples: int) -> bool:
    """Whether what is led to whole records in plain squares leaves so little that it has lost no motion."""
    return cost <= MET**2 * samples


def motion_lost(before: float, after: float) -> bool:
    """Whether so much more is left, where readings are linearised anew or in a fit, that a motion was lost there."""
    return after > MOTION_LOST * before


def in_wrong_minimum(log: float, parent: float) -> bool:
    """Whether a hypothesis that contains its parent lies in a wrong minimum, by the evidence of both in nats."""
    return not log > parent - WRONG_MINIMUM


def may_be_better_elsewhere(objective: float, parent: float) -> bool:
    """Whether records of a hypothesis are looked for in other minima, by its objective and that of what it contains.

    A motion that was lost is not found again by what a record or two deviate by.
    """
    return not objective > parent + 2.0 * FAR_BEHIND


def descent(parent: float = np.inf) -> dict[str, Any]:
    """How a hypothesis is followed, as `mode` takes it; what contains a parent, only as long as it may be better.

    Parameters
    ----------
    parent : float
        Objective of the parent, twice a negative logarithm.
    """
    return {
        "tolerance": LEAST_FALL,
        "effort": Effort(patience=PATIENCE_OF_DESCENT, worthless=parent + 2.0 * WRONG_MINIMUM),
    }


def curve_descent(parent: float) -> dict[str, Any]:
    """The same of a free curve on top of a parent with such an objective."""
    how = descent(parent)
    limits = {"steps": CURVE_STEPS, "patience": CURVE_PATIENCE, "share": CURVE_SHARE, "before": parent}
    return how | {"effort": replace(how["effort"], **limits)}


def warm_start() -> dict[str, Any]:
    """How a parent is refitted from where a candidate ended, as `mode` takes it."""
    return {"tolerance": LEAST_FALL, "effort": Effort(steps=WARM_START_STEPS)}


def continuation_steps() -> list[float]:
    """Factors on the strength of an effect that is left out by continuation, each on the one before."""
    return [left / (left + 1.0) for left in range(CONTINUATION_STEPS - 1, 0, -1)]


def promising(before: float, costs: Sequence[float]) -> list[bool]:
    """Which of some costs, the lowest first, fall so far below that of the model before that they may be the best."""
    most = PROMISING * (before - costs[0]) if costs else 0.0
    return [i < REFITTED or before - cost >= most for i, cost in enumerate(costs)]


def least_of_singular(least: float) -> float:
    """Nats that slopes have to predict of an effect at whose null the model changes its kind, where `least` of others.

    What leaves no more than noise has gained `least` over `PROMISING`, and of that `HARDLY` is asked.
    """
    return HARDLY / PROMISING * least


def instants_are_looked_for(turn: int, fall: float) -> bool:
    """Whether the instants of a sudden effect are looked for, once more or at all, by the fall of the objective so far.

    Parameters
    ----------
    turn : int
        From 0.
    fall : float
        That the effect, or the last turn, brought.
    """
    return turn < INSTANTS_MOVED and fall > 2.0 * thresholds.NAMED


def is_followed_elsewhere(place: int) -> bool:
    """Whether an effect that rings is followed from a frequency, by its place among those that most is predicted of."""
    return place < VALLEYS


def is_searched_widely(place: int) -> bool:
    """Whether a candidate is searched for from every sign and shape, by its place among those that predict most."""
    return place < WIDELY


def compared_again(logs: Sequence[float], named: bool) -> list[bool]:
    """Which candidates are compared in better known noise.

    Parameters
    ----------
    logs : sequence of float
        Their evidence in nats, the most probable first.
    named : bool
        Whether the first may get its name.
    """
    behind = FAR_BEHIND if named else 0.0
    return [i < COMPARED or log > logs[0] - behind for i, log in enumerate(logs)]


def is_as_good(gain: float, most: float) -> bool:
    """Whether a curve may be the best, given what the best gains: each is followed to within a share of its gain."""
    return gain > most - max(FAR_BEHIND, 2.0 * CURVE_SHARE * most)


def is_near(place: int, behind: float) -> bool:
    """Whether a model is among the best ones, by its place and the nats it is behind (negative) the first."""
    return place < COMPARED and behind > -FAR_BEHIND


def followed_in_turn(ranked: Sequence[Listed]) -> list[list[Listed]]:
    """Candidates, the most promising first, in groups: after each it is tested whether the next may do better."""
    return [list(ranked[i : i + FOLLOWED_AT_ONCE]) for i in range(0, len(ranked), FOLLOWED_AT_ONCE)]


def is_followed_instead(place: int) -> bool:
    """Whether a candidate is followed in the place of differences between records, by what slopes predict there."""
    return place < INSTEAD


def proposes_laws(place: int) -> bool:
    """Whether laws are looked for in a free curve, by its place among those that gained most."""
    return place < CURVES_WITH_LAWS


def laws_in_turn(found: Sequence[Sequence[Listed]]) -> list[Listed]:
    """Laws that are fitted, of the forms that follow each curve best: the first of each come before any second one."""
    turns = [law for turn in range(LAWS_FITTED) for laws in found for law in laws[turn : turn + 1]]
    return turns[:LAWS_FITTED]


def is_partner(place: int) -> bool:
    """Whether an effect is tried beside another one, by its place among those that gained most by themselves."""
    return place < PARTNERS


def happens_in_several(number: int) -> bool:
    """Whether slopes predict something of an event in so many records that it may happen in all of them."""
    return number >= IN_SEVERAL


def final_spread(names: Iterable[str]) -> dict[str, float]:
    """Factor by which each of some parameters differs in the starts of the final fit."""
    return dict.fromkeys(names, FINAL_SPREAD)


def time_for_starts(left: float, takes: float) -> bool:
    """Whether enough time is left for a final fit from starts of its own, which is expected to take so much, in s."""
    return left > STARTS_NEED * takes


def time_for_gls(left: float, given: float) -> bool:
    """Whether enough of the time given is left for a GLS estimate, both in s."""
    return left > GLS_NEEDS * given


def looking_time(left: float) -> float:
    """Time that candidates are given of what is left, both in s."""
    return LOOKING * left


def probing_time(left: float) -> float:
    """Time that free curves may take of what is left, before effects are tried in pairs, both in s."""
    return PROBING * left


def course_time(left: float) -> float:
    """Time that curves over the course of a record may take of what is left, both in s."""
    return COURSE * left


def second_look_time(left: float) -> float:
    """Time that laws may be looked at once more, of what is left, both in s."""
    return SECOND_LOOK * left


def side_search_time(left: float) -> float:
    """Time that a search beside the rounds may take of what is left, both in s."""
    return SIDE_SEARCH * left


def may_be_worth(predicted_gain: float, worth: float) -> bool:
    """Whether a curve is followed whose slopes predict so many nats, where it has to gain so many."""
    return predicted_gain > worth - HOPE


def strengths_converged(before: np.ndarray, after: np.ndarray) -> bool:
    """Whether strengths that would just be found have converged."""
    return bool(np.all(np.abs(after - before) <= STEADY_LIMIT * before))
