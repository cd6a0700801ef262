"""Errors of measured inputs about a better model: what they are and what they do is found anew for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fibrefit.core.limits import in_time
from fibrefit.discovery.engine.candidates import Hypothesis, own_task_by_record, transferred
from fibrefit.discovery.engine.effort import LINEARISED_ANEW, TOO_FAR, meets_all_bounces, motion_lost, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.linearisation import Linearisation, Reactions, linearised_at
from fibrefit.discovery.engine.refit import Refit, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED, OBJECTS, occam
from fibrefit.discovery.search.linearised import About, linearised_once, search_about
from fibrefit.discovery.search.search import Search
from fibrefit.fitting.search.optimum import reacts_alike
from fibrefit.problem import InputCoefficients, InputSensitivities


def coefficients_of(search: Search, fitted: LaplaceFit) -> InputCoefficients | None:
    """Errors of noisy inputs that suit a hypothesis best, to first order about those known; None without any.

    They are those of each record at values of its own.
    """
    if (sensitivities := fitted.supermodel.sensitivities) is None:
        return None
    left = np.asarray(fitted.supermodel.residuals(fitted.local, search.context.whole))[:, None]
    return sensitivities.named([-record.best(own)[0] for record, own in zip(sensitivities.records, left, strict=True)])


def residuals_left(search: Search, fitted: LaplaceFit) -> np.ndarray:
    """Residuals of a hypothesis ``(n_record, n_channel, n_time)`` in units of the noise, errors of inputs taken off.

    By a program of the search: to put a hypothesis into a model of its own is to compile that.
    """
    supermodel, coefficients = fitted.supermodel, coefficients_of(search, fitted)
    if coefficients is not None and (seen := supermodel.sensitivities) is not None:
        whole = seen._replace(
            coefficients=coefficients, downweight=np.ones_like(seen.downweight), offset=np.zeros_like(seen.offset)
        )
        supermodel = supermodel_of(search.task, supermodel.effects, whole)
    rows = np.asarray(supermodel.residuals(fitted.local, search.context.whole))
    return rows.reshape(len(rows), len(search.task.problem.model.rig.channels), -1)


def linearised_about(
    search: Search, fitted: LaplaceFit, lead: bool | None = None, counts: np.ndarray | None = None
) -> About | None:
    """Readings linearised in the errors of inputs, about what suits a hypothesis best; None without such inputs.

    Parameters
    ----------
    search : Search
    fitted : LaplaceFit
    lead : bool, optional
        Whether it is led on from before the first bounces, see `through_all_bounces`; by default one that was held to
        what is before them, leaves little there, and leaves more of whole records than where it is led to.
    counts : (n_record,) int, optional
        Samples of each record that count, see `horizon_by_horizon`; all by default.
    """
    if (coefficients := coefficients_of(search, fitted)) is None:
        return None
    search.tell("finding what errors of inputs do to the better model", None)
    plain, led = search.plain(fitted), False
    if lead or (lead is None and _is_led_on(search, plain)):
        ahead, moved = _ahead(search, plain)
        led = moved or bool(lead)
    if led:
        plain, coefficients = ahead, {name: np.zeros_like(wave) for name, wave in coefficients.items()}
    return search_about(search, plain, *_sensitivities_about(search, plain, coefficients, counts), led=led)


def is_held_back(found: LaplaceFit | Hypothesis) -> bool:
    """Whether a hypothesis was held to what comes before the first bounces alone."""
    known = found.supermodel.sensitivities
    return known is not None and known.far


def _is_led_on(search: Search, plain: Hypothesis) -> bool:
    """Whether a hypothesis was held to what is before the first bounces alone, and leaves little of that."""
    return is_held_back(plain) and search.gap(plain) <= TOO_FAR


def _ahead(search: Search, plain: Hypothesis) -> tuple[Hypothesis, bool]:
    """A hypothesis where it leaves less of whole records, inputs as measured: led, or as it is; whether it is led."""
    led = through_all_bounces(search, plain)
    here = transferred(led.supermodel, plain.supermodel, plain.fit.local)
    cost = float(led.supermodel.costs(here, search.context.whole).sum())
    return (led, True) if led.fit.cost < cost else (Hypothesis(plain.effects, Refit(here, cost), led.supermodel), False)


def through_all_bounces(search: Search, plain: Hypothesis) -> Hypothesis:
    """A hypothesis led from what is before the first bounces to whole records, in plain squares, inputs as measured.

    If it is right it leads through them all, yet its values are not known well enough to meet the later ones, and what
    was found of the inputs suits those values: as a first fit it goes from horizon to horizon.
    """
    # That of its group is at hand, and a program takes long to compile.
    supermodel, subset = supermodel_of(search.task, plain.supermodel.effects), search.context.descended(plain.effects)

    def lead() -> Refit:
        led = Refit(transferred(supermodel, plain.supermodel, plain.fit.local), np.inf)
        for counts in search.context.counts:
            led = refit(supermodel, subset, led.local, counts)
        return led

    about = [effect.name for effect in supermodel.effects]
    return Hypothesis(plain.effects, search.recalled("led", plain, about, lead)(), supermodel)


def _sensitivities_about(
    search: Search, plain: Hypothesis, coefficients: InputCoefficients, counts: np.ndarray | None = None
) -> tuple[InputSensitivities, Linearisation]:
    """How readings of a hypothesis react to errors of inputs: as those known do, where these predict its own readings.

    A chord step then: what readings are is simulated where the hypothesis is, their reactions are those of before.
    """
    supermodel, known = plain.supermodel, plain.supermodel.sensitivities
    # Each record at values of its own: to an error of an input it reacts as it is, and not as the others are.
    own, local = own_task_by_record(search.task, plain)
    # Of what did not count, as bounces were out of reach, nothing was predicted.
    far = known is not None and counts is None and search.gap(plain) > TOO_FAR
    if known is not None and counts is None and not (far or known.far):
        as_before = known.about(coefficients)
        models = supermodel_of(search.task, supermodel.effects, as_before), supermodel
        left, predicted = (np.asarray(one.residuals(plain.fit.local, search.context.whole)) for one in models)
        if reacts_alike(left, predicted).all():
            return as_before, search.linearisation.about(local, coefficients)
    reactions = Reactions(local, coefficients, far, counts)
    return reactions.sensitivities(own), linearised_at(reactions)


def relinearised(search: Search, fitted: LaplaceFit) -> tuple[Search, LaplaceFit] | None:
    """Search and hypothesis with what errors of noisy inputs do to the hypothesis.

    None without such inputs, and where a motion is lost there.
    """
    found = _relinearised(search, fitted)
    return None if found is None else found[:2]


def led_through_bounces(search: Search, held: LaplaceFit) -> tuple[Search, LaplaceFit] | None:
    """Search and hypothesis from whole records, of one that a first fit held to what comes before the first bounces.

    A first fit that loses a bounce of one record says nothing of the model: led through them all it may leave noise.
    None where it was not held back, or leads to no motion that meets them.
    """
    if not is_held_back(held):
        return None
    ahead = through_all_bounces(search, search.plain(held))
    if not meets_all_bounces(ahead.fit.cost, search.task.problem.n_measured):
        return None
    found = _relinearised(search, held, lead=True)
    return None if found is None else found[:2]


def _relinearised(
    search: Search, fitted: LaplaceFit, lead: bool | None = None, counts: np.ndarray | None = None
) -> tuple[Search, LaplaceFit, bool] | None:
    """The same, and whether the hypothesis was led on from before the first bounces."""
    if (about := linearised_about(search, fitted, lead, counts)) is None:
        return None
    anew, old = about.search, fitted.evidence.mode
    # What records differed by at other values says nothing at these.
    differ = (None, None) if about.led else (old.sigma, old.place.eta)
    found = anew.inference.fitted(about.supermodel, fitted.effects, about.local, *differ)
    before = search.gap_left(fitted)
    # Of what comes before the first bounces errors of the inputs may take more than noise leaves of all; what is left
    # up to one horizon says nothing of the next.
    if counts is None and motion_lost(max(before, 1.0) if about.led else before, anew.gap_left(found)):
        return None
    return anew, found, about.led


def linearised_where_records_differ(search: Search, fitted: LaplaceFit) -> tuple[Search, LaplaceFit]:
    """Search and hypothesis with readings linearised at each record's own values, if these differ.

    A first fit takes records for alike, and what they differ by for errors of their inputs: what is learnt of the one
    by a linearisation unlearns the other in the next, until it gains no more. Where that does not come soon, bounces of
    a record are lost, and all are led through them. Where the time ends, what was found until then is kept.
    """
    return linearised_once(search, fitted, _until_it_gains_no_more)


def _until_it_gains_no_more(search: Search, fitted: LaplaceFit) -> tuple[Search, LaplaceFit, bool]:
    """The same, and whether all of it came in time."""
    led, came = False, True
    for turn in range(LINEARISED_ANEW):
        if not fitted.evidence.mode.sigma.any():
            break
        anew, came = in_time(partial(relinearised, search, fitted), None)
        if anew is None:
            break
        gained, (search, fitted) = _per_noise(anew[1]) - _per_noise(fitted), anew
        if gained <= NAMED:
            break
        near = slopes_tell(search.gap_left(fitted))
        if not led and (turn or not near):
            ahead, came = in_time(partial(horizon_by_horizon, search, fitted), None)
            led, (search, fitted) = True, ahead or (search, fitted)
            near = slopes_tell(search.gap_left(fitted))
        # What a model lacks makes records differ, too, and then their values come to no rest.
        if not (near and came):
            break
    return search, fitted, came


def _per_noise(fitted: LaplaceFit) -> float:
    """Evidence of a hypothesis beside that of noise in the samples that count, whose number each linearisation sets."""
    return fitted.log + 0.5 * float(fitted.supermodel.samples.sum())


def horizon_by_horizon(search: Search, fitted: LaplaceFit) -> tuple[Search, LaplaceFit] | None:
    """Search and hypothesis led through all bounces, errors of inputs and differences between records eliminated.

    A linearisation follows a bounce only as far as it comes near it: beyond one that is met elsewhere, values of a
    record suit nothing, and creep. So readings count from horizon to horizon, those of the first fit, and are
    linearised anew for each. None where that leads to no better place, or bounces are out of reach.
    """
    known = fitted.supermodel.sensitivities
    if known is None or known.far or search.gap_left(fitted) > TOO_FAR:
        return None
    ahead = search, fitted
    for counts in search.context.counts:
        if (anew := _relinearised(*ahead, lead=False, counts=counts)) is None:
            return None
        ahead = anew[:2]
    return ahead if _per_noise(ahead[1]) > _per_noise(fitted) else None


@dataclass(frozen=True)
class Confirmation:
    """A hypothesis with readings linearised about it.

    Parameters
    ----------
    search : Search
        With these readings.
    found : LaplaceFit
    parent : LaplaceFit
        The more probable of what it is without what was added, and of its parent from where that was.
    overdispersion : float
        By which its gain was divided.
    led : bool
        Whether it was led there from before the first bounces, as others are then.
    """

    search: Search
    found: LaplaceFit
    parent: LaplaceFit
    overdispersion: float = 1.0
    led: bool = False

    @property
    def gain(self) -> float:
        """Logarithm of its Bayes factor over its parent there."""
        return self.found.log - self.parent.log


def overdispersion_of(
    inference: LaplaceInference, parent: LaplaceFit, one: LaplaceFit, names: Sequence[str] = ()
) -> float:
    """Overdispersion of the scores of what a candidate adds; 1 where its gain is none, or beyond doubt.

    Parameters
    ----------
    inference : LaplaceInference
        Of both.
    parent, one : LaplaceFit
    names : sequence of str
        Of the values that it adds; the strengths of its effects unless said.
    """
    if not 0.0 < one.log - parent.log < BEYOND_DOUBT:
        return 1.0
    added = [effect for effect in one.effects if effect not in parent.effects]
    strengths = [f"{effect.name}.{name}" for effect in added for name in effect.strength]
    return inference.overdispersion(parent, one, names or strengths)


def overdispersion_corrected(parent: LaplaceFit, one: LaplaceFit, overdispersion: float) -> LaplaceFit:
    """A candidate with its gain divided by the overdispersion of the scores, and none where records object.

    Where an effect acts, it makes no record far less probable: one that does fits what is not noise in the others.
    """
    gain = one.log - parent.log
    if not 0.0 < gain < BEYOND_DOUBT:
        return one
    if one.largest_loss_to(parent) > OBJECTS:
        kept = 0.0
    else:
        cost = max(occam(parent.evidence, one.evidence), 0.0)
        kept = (gain + cost) / overdispersion - cost
    return one.with_log(parent.log + kept, gain - kept)


def confirmed(search: Search, parent: LaplaceFit, found: LaplaceFit, lead: bool | None = None) -> Confirmation | None:
    """What a hypothesis gains over its parent where readings are linearised about itself; None without noisy inputs.

    Readings linearised about its parent say little of a place that is far from it: a bounce that comes elsewhere meets
    other errors of the inputs. What is gained there by going far is none if it is gone once one is there.

    Parameters
    ----------
    search : Search
    parent, found : LaplaceFit
    lead : bool, optional
        See `linearised_about`.
    """
    if (anew := _relinearised(search, found, lead)) is None:
        return None
    there, own, led = anew
    lesser = (
        there.inference.without(own, parent.effects),
        _fitted_in(there, own.supermodel, parent, led),
    )
    best = max(lesser, key=lambda one: one.log)
    overdispersion = overdispersion_of(there.inference, best, own)
    return Confirmation(there, overdispersion_corrected(best, own, overdispersion), best, overdispersion, led)


def fitted_about(about: Search, other: LaplaceFit, led: bool = False) -> LaplaceFit:
    """A hypothesis where readings are linearised about another one, from where it is, or is `led` as that one was."""
    return _fitted_in(about, about.supermodel_with(other.supermodel.effects), other, led)


def _fitted_in(about: Search, supermodel: Supermodel, other: LaplaceFit, led: bool) -> LaplaceFit:
    """The same in a supermodel that holds it."""
    if led:
        ahead, _ = _ahead(about, about.plain(other))
        return about.inference.fitted(
            supermodel, other.effects, transferred(supermodel, ahead.supermodel, ahead.fit.local)
        )
    local, old = transferred(supermodel, other.supermodel, other.local), other.evidence.mode
    return about.inference.fitted(supermodel, other.effects, local, old.sigma, old.place.eta)
