"""Errors of measured inputs about a better model: what they are and what they do is found anew for it."""

from __future__ import annotations

from dataclasses import replace
from threading import Lock

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis, absent_values, carried
from fibrefit.discovery.engine.marginal import Scales
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import FAR, Frame, frame_of, waves_at
from fibrefit.discovery.engine.weighed import Weighed
from fibrefit.discovery.engine.yardstick import yardstick_of
from fibrefit.discovery.search.search import Search
from fibrefit.problem.inputs.errors_in_variables import Waves
from fibrefit.problem.inputs.reactions import reactions_of


def waves_of(search: Search, weighed: Weighed) -> Waves | None:
    """Errors of noisy inputs that suit a hypothesis best, to first order about those known; None without such inputs.

    Parameters
    ----------
    search : Search
    weighed : Weighed
    """
    if (reactions := weighed.frame.reactions) is None:
        return None
    return waves_at(*search.task_with(weighed), reactions)


def relinearised(search: Search, weighed: Weighed) -> tuple[Search, Weighed] | None:
    """Search and hypothesis with what errors of noisy inputs do to the hypothesis; None without such inputs.

    Parameters
    ----------
    search : Search
    weighed : Weighed
    """
    if (waves := waves_of(search, weighed)) is None:
        return None
    search.tell("finding what errors of inputs do to the better model", None)
    task, values = search.task_with(weighed)
    reactions = reactions_of(task, values, waves, search.gap(search.plain(weighed)) > FAR)
    frame, own = frame_of(search.task, (), reactions), frame_of(search.task, weighed.effects, reactions)
    local = np.asarray(task.problem.layout.local(values))
    local = carried(own, absent_values(own, len(local)), Frame(task), local)
    base = refit(frame, search.ground.subset(()), search.base.fit.local, search.ground.whole)
    scales = Scales(search.ground, search.scales.reference, yardstick_of(own, search.scales.yardstick.noise))
    lock = Lock()
    anew = replace(search, base=Hypothesis((), base, frame), scales=scales, frames=[frame, own], lock=lock)
    return anew, scales.weigh(own, weighed.effects, local)
