"""Errors of measured inputs about a better model: what they are and what they do is found anew for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from threading import Lock
from typing import NamedTuple

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis, own_task_by_record, transferred
from fibrefit.discovery.engine.common_noise import common_noise_of
from fibrefit.discovery.engine.effort import LINEARISED_ANEW, TOO_FAR, motion_lost
from fibrefit.discovery.engine.marginal import Scales
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import Supermodel, residual_rows, supermodel_of
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, OBJECTS, occam
from fibrefit.discovery.engine.weighed import Weighed
from fibrefit.discovery.search.search import Search
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients
from fibrefit.problem.inputs.sensitivities import sensitivities_of


def coefficients_of(search: Search, weighed: Weighed) -> InputCoefficients | None:
    """Errors of noisy inputs that suit a hypothesis best, to first order about those known; None without any.

    They are those of each record at values of its own.
    """
    if (sensitivities := weighed.supermodel.sensitivities) is None:
        return None
    left = np.asarray(residual_rows(weighed.supermodel, weighed.local, search.context.whole))[:, None]
    return sensitivities.named([-record.best(own)[0] for record, own in zip(sensitivities.records, left, strict=True)])


def residuals_left(search: Search, weighed: Weighed) -> np.ndarray:
    """Residuals of a hypothesis ``(n_record, n_channel, n_time)`` in units of the noise, errors of inputs taken off.

    By a program of the search: to put a hypothesis into a model of its own is to compile that.
    """
    supermodel, coefficients = weighed.supermodel, coefficients_of(search, weighed)
    if coefficients is not None and (seen := supermodel.sensitivities) is not None:
        whole = seen._replace(
            coefficients=coefficients, downweight=np.ones_like(seen.downweight), offset=np.zeros_like(seen.offset)
        )
        supermodel = supermodel_of(search.task, supermodel.effects, whole)
    rows = np.asarray(residual_rows(supermodel, weighed.local, search.context.whole))
    return rows.reshape(len(rows), len(search.task.problem.model.rig.channels), -1)


class About(NamedTuple):
    """A search with readings linearised about a hypothesis.

    Parameters
    ----------
    search : Search
    supermodel : Supermodel
        Of the hypothesis.
    """

    search: Search
    supermodel: Supermodel


def linearised_about(search: Search, weighed: Weighed) -> About | None:
    """Readings linearised in the errors of inputs, about what suits a hypothesis best; None without such inputs."""
    if (coefficients := coefficients_of(search, weighed)) is None:
        return None
    search.tell("finding what errors of inputs do to the better model", None)
    plain = search.plain(weighed)
    # Each record at values of its own: to an error of an input it reacts as it is, and not as the others are.
    sensitivities = sensitivities_of(*own_task_by_record(search.task, plain), coefficients, search.gap(plain) > TOO_FAR)
    supermodel = supermodel_of(search.task, (), sensitivities)
    own = supermodel_of(search.task, weighed.effects, sensitivities) if weighed.effects else supermodel
    base = refit(supermodel, search.context.subset(()), search.base.fit.local, search.context.whole)
    scales = Scales(search.context, search.scales.reference, common_noise_of(own, search.scales.common_noise.noise))
    anew = replace(
        search,
        base=Hypothesis((), base, supermodel),
        scales=scales,
        supermodels=[supermodel, own] if weighed.effects else [supermodel],
        lock=Lock(),
    )
    return About(anew, own)


def relinearised(search: Search, weighed: Weighed) -> tuple[Search, Weighed] | None:
    """Search and hypothesis with what errors of noisy inputs do to the hypothesis.

    None without such inputs, and where a motion is lost there.
    """
    if (about := linearised_about(search, weighed)) is None:
        return None
    anew, own, old = about.search, about.supermodel, weighed.evidence.mode
    local = transferred(own, weighed.supermodel, weighed.local)
    found = anew.scales.weigh(own, weighed.effects, local, old.sigma, old.place.eta)
    if motion_lost(search.gap(search.plain(weighed)), anew.gap(anew.plain(found))):
        return None
    return anew, found


def linearised_where_records_differ(search: Search, weighed: Weighed) -> tuple[Search, Weighed]:
    """Search and hypothesis with readings linearised at each record's own values, if these differ.

    A first fit takes records for alike, and what they differ by for errors of their inputs.
    """
    for _ in range(LINEARISED_ANEW):
        if not weighed.evidence.mode.sigma.any() or (anew := relinearised(search, weighed)) is None:
            break
        search, weighed = anew
    return search, weighed


@dataclass(frozen=True)
class Confirmation:
    """A hypothesis with readings linearised about it.

    Parameters
    ----------
    search : Search
        With these readings.
    found : Weighed
    parent : Weighed
        The more probable of what it is without what was added, and of its parent from where that was.
    overdispersion : float
        By which its gain was divided.
    """

    search: Search
    found: Weighed
    parent: Weighed
    overdispersion: float = 1.0

    @property
    def gain(self) -> float:
        """Logarithm of its Bayes factor over its parent there."""
        return self.found.log - self.parent.log


def overdispersion_of(scales: Scales, parent: Weighed, one: Weighed) -> float:
    """Overdispersion of the scores of what a candidate adds; 1 where its gain is none, or beyond doubt.

    Parameters
    ----------
    scales : Scales
        By which both were weighed.
    parent, one : Weighed
    """
    if not 0.0 < one.log - parent.log < BEYOND_DOUBT:
        return 1.0
    added = [effect for effect in one.effects if effect not in parent.effects]
    return scales.overdispersion(one, [f"{effect.name}.{name}" for effect in added for name in effect.strength])


def overdispersion_corrected(parent: Weighed, one: Weighed, overdispersion: float) -> Weighed:
    """A candidate with its gain divided by the overdispersion of the scores, and none where records object.

    Where an effect acts, it makes no record far less probable: one that does fits what is not noise in the others.
    """
    gain = one.log - parent.log
    if not 0.0 < gain < BEYOND_DOUBT:
        return one
    if one.largest_loss_to(parent) > OBJECTS:
        return one.with_log(parent.log)
    cost = max(occam(parent.evidence, one.evidence), 0.0)
    return one.with_log(parent.log + (gain + cost) / overdispersion - cost)


def confirmed(search: Search, parent: Weighed, found: Weighed) -> Confirmation | None:
    """What a hypothesis gains over its parent where readings are linearised about itself; None without noisy inputs.

    Readings linearised about its parent say little of a place that is far from it: a bounce that comes elsewhere meets
    other errors of the inputs. What is gained there by going far is none if it is gone once one is there.
    """
    if (anew := relinearised(search, found)) is None:
        return None
    there, own = anew
    local = transferred(own.supermodel, parent.supermodel, parent.local)
    old = parent.evidence.mode
    lesser = (
        there.scales.without(own, parent.effects),
        there.scales.weigh(own.supermodel, parent.effects, local, old.sigma, old.place.eta),
    )
    best = max(lesser, key=lambda one: one.log)
    overdispersion = overdispersion_of(there.scales, best, own)
    return Confirmation(there, overdispersion_corrected(best, own, overdispersion), best, overdispersion)


def weighed_about(about: Search, other: Weighed) -> Weighed:
    """A hypothesis where readings are linearised about another one, from where it is."""
    supermodel, old = about.supermodel_with(other.supermodel.effects), other.evidence.mode
    local = transferred(supermodel, other.supermodel, other.local)
    return about.scales.weigh(supermodel, other.effects, local, old.sigma, old.place.eta)
