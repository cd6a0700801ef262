"""The rivals of a plan as the records at hand have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core.limits import Progress
from fibrefit.discovery.comparison import in_one_noise
from fibrefit.discovery.design.apart import Explanation
from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.plan import just_found
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
from fibrefit.problem import Task

NOT_THERE = "The evidence for {} in the records at hand is too weak to name it; it counts as"


def rivals_at_hand(
    task: Task, effects: Sequence[type[Effect]], fit: Identification | None, tell: Progress
) -> tuple[list[Explanation], tuple[str, ...], Beside, float | None]:
    """Rivals, if any, with the values they have in the records at hand, remarks on those without any, and noise.

    One without evidence for it has the strength that would just be found, as by itself it would be none; of its
    typical size are those that the records cannot show, and all where nothing is measured. Noise, and how much records
    differ, are those that the better one leaves; where the records show both, the nats by which the first is ahead.

    Parameters
    ----------
    task : Task
        Of the model without the rivals.
    effects : sequence of Effect classes
        The rivals.
    fit : Identification or None
        Of the task; None where nothing is measured.
    tell : callable
        Called with what is being done.
    """
    if fit is None:
        return [_typical(task, effect, task.start) for effect in effects], (), Beside(), None
    search, base = prepared_search(task, fit, effects, tell)
    gains = dict[type[Effect], tuple[LaplaceFit, float]]()
    if effects:
        compared = in_one_noise(search, base, search.tried(base, effects, "fitting the rivals"))
        search, base = compared.search, compared.parent
        # One that was not followed is but what slopes promise of it.
        followed = [one for one in compared.found if one.evidence.mode.steps]
        gains = {one.effects[-1]: (one, compared.gain(one)) for one in followed}
    found, remarks = [], []
    shown = [effect for effect in effects if effect in gains and gains[effect][1] > NAMED]
    for effect in effects:
        if effect in shown:
            found.append(_as_found(gains[effect][0]))
        elif (weak := just_found(search, base, effect)) is not None:
            found.append(weak)
            remarks.append(f"{NOT_THERE.format(effect.name)} as strong as would just be found.")
        else:
            found.append(_typical(task, effect, fit.plain.values))
            remarks.append(f"{NOT_THERE.format(effect.name)} of its typical size, as they cannot show it.")
    best = max((gains[effect] for effect in shown), key=lambda pair: pair[1], default=(base, 0.0))[0]
    both = len(shown) == len(effects) == 2
    ahead = gains[effects[0]][1] - gains[effects[1]][1] if both else None
    return found, tuple(remarks), Beside.of(search, best), ahead


def _typical(task: Task, effect: type[Effect], values: np.ndarray) -> Explanation:
    local = np.asarray(task.problem.layout.local(values))
    named = {name: local[:, j] for j, name in enumerate(task.problem.layout.names)}
    sizes = {f"{effect.name}.{p.name}": np.full(len(local), p.typical) for p in effect.parameters}
    return Explanation(effect, named | sizes)


def _as_found(one: LaplaceFit) -> Explanation:
    return Explanation.by(one.effects[-1], one.supermodel.names, one.local, one.shared)
