"""A search with readings linearised in the errors of measured inputs, made anew from little that is kept of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from fibrefit.core.limits import OutOfTimeError
from fibrefit.discovery.engine.candidates import Hypothesis, transferred
from fibrefit.discovery.engine.common_noise import common_noise_of, steps_at
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.linearisation import AS_BEGUN, Linearisation
from fibrefit.discovery.engine.refit import Refit, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.search.search import Search
from fibrefit.problem import InputSensitivities, StepLikelihood


class About(NamedTuple):
    """A search with readings linearised about a hypothesis.

    Parameters
    ----------
    search : Search
    supermodel : Supermodel
        Of the hypothesis.
    local : (n_record, n_local) in SI units
        Its values, of that supermodel: about which readings were linearised.
    led : bool
        Whether these are other ones than it was found with, see `through_all_bounces`.
    """

    search: Search
    supermodel: Supermodel
    local: np.ndarray
    led: bool = False


def search_about(
    search: Search, plain: Hypothesis, sensitivities: InputSensitivities, linearisation: Linearisation,
    base: Refit | None = None, led: bool = False,
) -> About:  # fmt: skip
    """A search with given reactions of readings to errors of inputs.

    Parameters
    ----------
    search : Search
    plain : Hypothesis
        About which readings were linearised.
    sensitivities : InputSensitivities
    linearisation : Linearisation
        How they came about.
    base : Refit, optional
        Of the model the search began with, in plain squares; by default that of the search is refitted.
    led : bool
        See `About`.
    """
    supermodel = supermodel_of(search.task, (), sensitivities)
    own = supermodel_of(search.task, plain.effects, sensitivities) if plain.effects else supermodel
    if base is None:
        begun = Hypothesis((), search.base.fit, supermodel)
        polish = partial(refit, supermodel, search.context.subset(()), begun.fit.local, search.context.whole)
        base = search.recalled("linearised", begun, (), polish)()
    local = transferred(own, plain.supermodel, plain.fit.local)
    noise = common_noise_of(own, search.inference.common_noise.noise, _steps_about(search, own, local))
    anew = replace(
        search,
        base=Hypothesis((), base, supermodel),
        inference=search.inference.with_noise(noise),
        supermodels=[supermodel, own] if plain.effects else [supermodel],
        lock=Lock(),
        linearisation=linearisation,
    )
    return About(anew, own, local, led)


def _steps_about(search: Search, own: Supermodel, local: np.ndarray) -> StepLikelihood | None:
    """Likelihood of readings in coarse steps about values, where those of the search have one."""
    if search.inference.common_noise.in_steps is None:
        return None
    return steps_at(own, local, search.context.whole)


def linearised_once(
    search: Search, fitted: LaplaceFit, job: Callable[[Search, LaplaceFit], tuple[Search, LaplaceFit, bool]]
) -> tuple[Search, LaplaceFit]:
    """Search and hypothesis after readings were linearised anew, once or often; what is kept of it is where they are.

    A search that goes on linearises them there once.

    Parameters
    ----------
    search : Search
    fitted : LaplaceFit
    job : callable
        Search and hypothesis with readings linearised about another place; and whether that came in time.

    Raises
    ------
    OutOfTimeError
        If it did not.
    """
    ends = list[tuple[Search, LaplaceFit]]()
    begun = replace(search, linearisation=AS_BEGUN)

    def done() -> Any:
        there, found, came = job(begun, fitted)
        ends.append((there, found))
        if not came:
            raise OutOfTimeError  # With more time it would be another place.
        return None if there is begun else (there.linearisation, there.base.fit, found.evidence)

    try:
        kept = search.recalled("linearised anew", fitted, (), done)()
    except OutOfTimeError:
        if not ends:
            raise
    if ends or kept is None:
        return ends[0] if ends else (search, fitted)
    return _as_kept(begun, fitted, *kept)


def _as_kept(
    search: Search, fitted: LaplaceFit, linearisation: Linearisation, base: Refit, evidence: Any
) -> tuple[Search, LaplaceFit]:
    """The same from what is kept."""
    begun, supermodel = search.base.supermodel.sensitivities, supermodel_of(search.task, fitted.effects)
    assert begun is not None
    assert linearisation.local is not None
    plain = Hypothesis(fitted.effects, Refit(linearisation.local, np.nan), supermodel)
    about = search_about(search, plain, linearisation.sensitivities(supermodel.task, begun), linearisation, base)
    return about.search, LaplaceFit(fitted.effects, about.supermodel, evidence)
