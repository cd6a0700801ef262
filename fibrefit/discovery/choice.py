"""What a round adds: its ranking, and the candidate that is more than chance where readings are linearised about it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import beyond_limits, in_time, time_left
from fibrefit.discovery.comparison import Comparison, compared_about
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import (
    BEYOND_DOUBT,
    LIKENESS,
    NAMED,
    PRICE,
    SIMPLER,
    Chance,
    false_alarm,
    occam,
)
from fibrefit.discovery.search.inputs import Confirmation, confirmed
from fibrefit.discovery.search.starts import searched_for
from fibrefit.study.summaries.discovery import Candidate
from fibrefit.study.summaries.results import ParameterSummary

LISTED = 8
"""Candidates whose parameters are shown with errors."""

Choose = Callable[[Sequence[Candidate]], str | None]


class Believed(NamedTuple):
    """A comparison, what is added, and what that gains where readings are linearised about it."""

    comparison: Comparison
    chosen: LaplaceFit | None
    seen: Confirmation | None = None


def believed(comparison: Comparison, choose: Choose | None = None) -> Believed:
    """What is added; what gains only where readings are linearised about another model is not.

    To ask a candidate about itself takes about as long as to compare them all. Where there is no time for that, what is
    beyond doubt is believed.

    Parameters
    ----------
    comparison : Comparison
    choose : callable, optional
        Given a round's ranking, names the effect to add; what a person chooses is believed.
    """
    refused = set[tuple[str, ...]]()
    while (chosen := chosen_of(comparison, choose, refused)) is not None:
        if comparison.gain(chosen) > BEYOND_DOUBT and time_left() < comparison.seconds:
            return Believed(comparison, chosen)
        # The first is asked about whatever the time: all that was found would be lost with it.
        with nullcontext() if refused else beyond_limits():
            ask = partial(confirmed, comparison.search, comparison.parent, chosen)
            seen, came = in_time(ask, None)
        if not came:
            break
        if choose is not None or (seen is None and _needs_no_confirmation(comparison, chosen)):
            return Believed(comparison, chosen, seen)
        if seen is not None and seen.gain > NAMED:
            return among_rivals(Believed(comparison, chosen, seen))
        refused.add(chosen.names)
        less = chosen.with_log(comparison.parent.log + (0.0 if seen is None else seen.gain))
        others = [one for one in comparison.found if one is not chosen]
        comparison = replace(comparison, found=tuple(sorted([*others, less], key=lambda one: -one.log)))
    return Believed(comparison, None)


def _needs_no_confirmation(comparison: Comparison, chosen: LaplaceFit) -> bool:
    """Whether a candidate is believed about which readings could not be linearised.

    It is where inputs are exact, or its gain is beyond doubt. Where inputs have errors, a motion that is lost about a
    candidate is no sign that it is what is missing.
    """
    return chosen.supermodel.sensitivities is None or comparison.gain(chosen) > BEYOND_DOUBT


def among_rivals(found: Believed) -> Believed:
    """The best where readings are linearised about itself, the others as seen from there.

    Readings linearised about the parent put one in front by tens of nats that another is as probable as where they are
    linearised about either of them.
    """
    views: dict[tuple[str, ...], Believed] = {}
    while (seen := found.seen) is not None and seen.gain > NAMED:
        if (there := compared_about(found.comparison, seen)) is None:
            break
        found, best = Believed(there, seen.found, seen), chosen_of(there)
        views[seen.found.names] = found
        if best is None or best.names == seen.found.names:
            break
        if best.names in views:
            # Each is less probable about itself than the other: it is the one that is behind by less.
            return min(found, views[best.names], key=_behind)
        further, _ = in_time(partial(confirmed, there.search, there.parent, best), None)
        if further is None or further.gain <= NAMED:
            break
        found = Believed(there, best, further)
    return found


def _behind(found: Believed) -> float:
    """Nats by which what is believed is less probable about itself than the best there."""
    assert found.chosen is not None
    names = found.chosen.names
    return found.comparison.found[0].log - max(one.log for one in found.comparison.found if one.names == names)


def chosen_of(
    comparison: Comparison, choose: Choose | None = None, refused: Collection[tuple[str, ...]] = ()
) -> LaplaceFit | None:
    """What is added: what a person chooses, or the most probable if it is more than chance; None for nothing.

    Parameters
    ----------
    comparison : Comparison
    choose : callable, optional
        Given a round's ranking, names the effect to add.
    refused : collection of tuple of str
        Names of those that gain nothing about themselves.
    """
    if choose is not None:
        name = choose(candidates(comparison)[:LISTED])
        return next((one for one in comparison.found[:LISTED] if name in one.names), None)
    # What was not followed says nothing but what slopes predict of it.
    followed = [one for one in comparison.found if one.evidence.mode.steps and one.names not in refused]
    # Where the time ended before candidates were compared in one noise, what little they differ by is not known.
    needed = NAMED if comparison.compared else BEYOND_DOUBT
    near = [one for one in followed if comparison.gain(one) > needed and one.log > followed[0].log - SIMPLER]
    return min(
        [one for one in near if not _takes_up_a_likeness(comparison, one)],
        key=lambda one: (sum(len(effect.parameters) for effect in one.effects), _new(one, comparison), -one.log),
        default=None,
    )


def _takes_up_a_likeness(comparison: Comparison, one: LaplaceFit) -> bool:
    """Whether it adds an instant of one record that says no more than what a law leaves by being near the true one.

    Of what such a law leaves, something comes at once in some record: a step there takes it up.
    """
    new = [effect for effect in one.effects if effect not in comparison.parent.effects]
    little = comparison.gain(one) <= min(LIKENESS * comparison.gained, BEYOND_DOUBT)
    return little and any(effect.sudden and effect.records for effect in new)


def _new(one: LaplaceFit, comparison: Comparison) -> bool:
    """Whether it is more than a mistake in what the study says: those come before any physics is invented."""
    return any(
        not effect.name.startswith("study.") for effect in one.effects if effect not in comparison.parent.effects
    )


def candidates(comparison: Comparison) -> tuple[Candidate, ...]:
    """How the candidates of a round did over their parent, the most probable first."""
    return tuple(candidate(comparison, one) for one in comparison.found)


def candidate(comparison: Comparison, one: LaplaceFit) -> Candidate:
    """How a hypothesis did over its parent; what it adds, with standard errors.

    Parameters of one effect have their own names, those of several the effect's before them.

    Parameters
    ----------
    comparison : Comparison
    one : LaplaceFit
    """
    added = [effect for effect in one.effects if effect not in comparison.parent.effects]
    shared, errors = one.shared, one.errors
    parameters = {
        parameter.name if len(added) == 1 else name: ParameterSummary(
            value=shared[name], std_error=errors[name], unit=parameter.unit
        )
        for effect in added
        for parameter in effect.parameters
        for name in [f"{effect.name}.{parameter.name}"]
        if np.isfinite(shared[name])
    }
    chances = [_chance(comparison, other) for other in comparison.found]
    return Candidate(
        effect=" + ".join(effect.name for effect in added) or "nothing",
        gap_after=comparison.gap_of(one),
        evidence=comparison.gain(one),
        parameters=parameters,
        false_alarm=false_alarm(comparison.gain(one), chances + chances[:1] * comparison.others),
    )


def _chance(comparison: Comparison, one: LaplaceFit) -> Chance:
    """How much a candidate of a round gains where nothing is missing."""
    added = [effect for effect in one.effects if effect not in comparison.parent.effects]
    size = sum(len(effect.parameters) for effect in added)
    compared = one.names in comparison.compared
    cost = occam(comparison.parent.evidence, one.evidence) - one.divided_off if compared else np.nan
    # What was not compared in the same noise, or whose motion is lost, costs what is usual.
    return Chance(size, cost if np.isfinite(cost) else PRICE * size, sum(map(searched_for, added)))
