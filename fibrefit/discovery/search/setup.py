"""Where a search begins: the supermodels to search in, and the model without additions in the first of them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from fibrefit.core.limits import Progress
from fibrefit.discovery.engine.candidates import Hypothesis, SearchContext, transferred
from fibrefit.discovery.engine.common_noise import common_noise_of
from fibrefit.discovery.engine.effort import TOO_FAR, noise_is_taken_again, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.refit import Refit, refit
from fibrefit.discovery.engine.supermodel import Supermodel, simulation_groups, supermodel_of
from fibrefit.discovery.search.search import EffectSearch, Search
from fibrefit.fitting.checks import AGREED, check, starts_agree, undecided
from fibrefit.fitting.result import Identification, total
from fibrefit.laws.law import Effect
from fibrefit.problem import Task, sensitivities_of
from fibrefit.study.summaries.check import SIZE


def prepared_search(
    task: Task, before: Identification, effects: Sequence[type[Effect]], tell: Progress, folder: Path | None = None
) -> tuple[Search, LaplaceFit]:
    """Search over measured records, and the model it begins with.

    Parameters
    ----------
    task : Task
    before : Identification
        Of its model.
    effects : sequence of Effect classes
        That may be missing.
    tell : callable
        Called with what is being done.
    folder : pathlib.Path, optional
        Of the journal.
    """
    wanted = _wanted(task, effects)
    # An error of an input does to a record what it does where that is: at values of its own, where records differ.
    supermodel = supermodel_of(task, (), sensitivities_of(task, before.local, before.coefficients, is_far(before)))
    context, local = _context(task), _local(supermodel, task, before.plain.values)
    tell("polishing the fit without more effects", None)
    search = _search(
        task, wanted, supermodel, context, refit(supermodel, context.subset(()), local, context.whole), tell
    )
    search = search.with_inference(search.inference.kept_in(folder))
    base = search.inference.fitted(supermodel, (), search.base.fit.local)
    if before.gls is not None or before.plain.differ:
        # A record that differs may be matched in a wrong bounce by values all records share; a fit looked for its own.
        apart = transferred(supermodel, Supermodel(task), before.local)
        base = max(base, search.inference.fitted(supermodel, (), apart), key=lambda one: one.log)
    # A rest is short and tells little of slow noise; where the model leaves hardly more than noise, all records do.
    if slopes_tell(search.gap(search.base)):
        for turn in itertools.count(1):
            search = search.with_inference(search.inference.in_noise_of(base))
            base = search.inference.again(base)
            if not noise_is_taken_again(turn, True, partial(search.inference.settled_about, base)):
                break
    return search, base


def minima_compared(search: Search, base: LaplaceFit, before: Identification) -> tuple[LaplaceFit, Identification]:
    """The best minimum of the base model, and its fit, whose starts are held against the next one's probability.

    As measured, an input leaves residuals in every minimum, and few starts may find the best: what tells them apart are
    residuals with the errors of the input eliminated. The likelihood of the search says that at once.

    Parameters
    ----------
    search : Search
    base : LaplaceFit
    before : Identification
        Of the base model.
    """
    noise = all(check.passed for check in before.checks if check.identifier == SIZE)
    if not before.input_errors or not undecided(before.starts, noise):
        return base, before
    search.tell("comparing other minima of the first fit", None)
    supermodel, errors = search.base.supermodel, before.plain.errors
    values = [end for end in before.starts.others() if np.any(np.abs(end - before.plain.values) > errors)]
    ends = [search.inference.fitted(supermodel, (), _local(supermodel, search.task, end)) for end in values]
    best = max([base, *ends], key=lambda one: one.log)
    # By what is reported, which a better minimum is held against: the likelihood may lead from another start to one.
    nats = min((base.log - one.log for one in ends if _is_elsewhere(one, base)), default=np.inf)
    agree = check(AGREED, starts_agree(before.starts, noise, nats))
    checks = tuple(agree if one.identifier == AGREED else one for one in before.checks)
    return best, replace(before, checks=checks)


def _is_elsewhere(one: LaplaceFit, best: LaplaceFit) -> bool:
    """Whether it is another minimum: ends that differ by less than their error bars say the same."""
    return any(abs(one.shared[name] - value) > best.errors[name] for name, value in best.shared.items())


def set_up(task: Task, before: Identification | None, effects: Sequence[type[Effect]], tell: Progress) -> Search:
    """As `prepared_search`, all effects in one supermodel of groups, at first values where nothing was fitted."""
    wanted = _wanted(task, effects)
    values = task.start if before is None else before.plain.values
    sensitivities = None if before is None else sensitivities_of(task, values, before.coefficients, is_far(before))
    stiff = any(effect.stiff for effect in task.problem.model.effects)
    supermodel = replace(supermodel_of(task, wanted, sensitivities), groups=simulation_groups(wanted, stiff))
    gap = 1.0 if before is None else total(before.gap)
    fit = Refit(_local(supermodel, task, values), gap**2 * float(supermodel.samples.sum()))
    return _search(task, wanted, supermodel, _context(task), fit, tell)


def is_far(before: Identification) -> bool:
    """Whether a fit with noisy inputs lacks so much that its readings are taken up to the first bounce alone."""
    return bool(before.input_errors) and total(before.gap) > TOO_FAR * before.expected_gap


def _wanted(task: Task, effects: Sequence[type[Effect]]) -> tuple[type[Effect], ...]:
    return tuple(effect for effect in effects if effect not in task.problem.model.effects)


def _context(task: Task) -> SearchContext:
    layout = task.problem.layout
    free = [slot for slot in layout.slots if slot.free]
    start = np.asarray(layout.local(jnp.asarray(task.start)))
    return SearchContext(
        base=tuple(slot.name for slot in free if slot.shared),
        each=tuple(slot.name for slot in free if not slot.shared),
        scattering=tuple(s.name for s in free if s.shared and "." not in s.name and s.belief is None),
        counts=task.counts,
        data_start={name: start[:, j] for j, name in enumerate(layout.names)},
    )


def _local(supermodel: Supermodel, task: Task, values: np.ndarray) -> np.ndarray:
    local = np.asarray(task.problem.layout.local(jnp.asarray(values)))
    return transferred(supermodel, Supermodel(task), local)


def _search(
    task: Task,
    wanted: tuple[type[Effect], ...],
    supermodel: Supermodel,
    context: SearchContext,
    fit: Refit,
    tell: Progress,
) -> Search:
    noise = tuple(task.noise[channel] for channel in task.problem.model.rig.channels)
    reference = {name: float(np.mean(fit.local[:, supermodel.names.index(name)])) for name in context.base}
    inference = LaplaceInference(context, reference, common_noise_of(supermodel, noise))
    return EffectSearch(task, wanted, context, Hypothesis((), fit, supermodel), inference, tell, [supermodel])
