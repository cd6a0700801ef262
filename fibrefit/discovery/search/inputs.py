"""Errors of measured inputs about a better model: what they are and what they do is found anew for it."""

from __future__ import annotations

from dataclasses import replace
from threading import Lock

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis, absent_values, carried
from fibrefit.discovery.engine.marginal import Scales
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import FAR, Supermodel, coefficients_at, supermodel_of
from fibrefit.discovery.engine.weighed import Weighed
from fibrefit.discovery.engine.yardstick import yardstick_of
from fibrefit.discovery.search.search import Search
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients
from fibrefit.problem.inputs.sensitivities import sensitivities_of


def coefficients_of(search: Search, weighed: Weighed) -> InputCoefficients | None:
    """Errors of noisy inputs that suit a hypothesis best, to first order about those known; None without any."""
    if (sensitivities := weighed.frame.sensitivities) is None:
        return None
    return coefficients_at(*search.task_with(weighed), sensitivities)


def relinearised(search: Search, weighed: Weighed) -> tuple[Search, Weighed] | None:
    """Search and hypothesis with what errors of noisy inputs do to the hypothesis; None without such inputs."""
    if (coefficients := coefficients_of(search, weighed)) is None:
        return None
    search.tell("finding what errors of inputs do to the better model", None)
    task, values = search.task_with(weighed)
    sensitivities = sensitivities_of(task, values, coefficients, search.gap(search.plain(weighed)) > FAR)
    frame, own = (
        supermodel_of(search.task, (), sensitivities),
        supermodel_of(search.task, weighed.effects, sensitivities),
    )
    local = np.asarray(task.problem.layout.local(values))
    local = carried(own, absent_values(own, len(local)), Supermodel(task), local)
    base = refit(frame, search.context.subset(()), search.base.fit.local, search.context.whole)
    scales = Scales(search.context, search.scales.reference, yardstick_of(own, search.scales.yardstick.noise))
    lock = Lock()
    anew = replace(search, base=Hypothesis((), base, frame), scales=scales, frames=[frame, own], lock=lock)
    return anew, scales.weigh(own, weighed.effects, local)
