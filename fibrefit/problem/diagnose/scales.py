"""Whether scales and times of force and position can be those of the rig, before anything is fitted.

What a file or its user leaves unsaid, a gain, a decimation or a unit, shows in the numbers: a weight of a known mass
does not move so under such a force. Signs are `signs`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.units import format_number, format_quantity
from fibrefit.problem.thresholds import HOLDS, MISREAD, PROVEN_FACTOR
from fibrefit.rigs.rig import Rig
from fibrefit.rigs.signals.newton import Sizes, newton_of
from fibrefit.rigs.signals.trace import Trace

EXPLAINED = ("study.", "sensor.force_gain", "sensor.position_gain", "pulley.", "rig.")
"""Beginnings of names of effects by which a model has other scales, slopes or inertias than the study states."""


def refuse_misread(traces: Sequence[Trace], rig: Rig, effects: Sequence[str] = (), known: Collection[str] = ()) -> None:
    """Refuse records whose force or position is not that of the weight, by a factor.

    Parameters
    ----------
    rig : Rig
        One that does not say what acts on its weight is not examined.
    effects : sequence of str
        Names of those in the model: where one of them may be the reason, the fit has to tell.
    known : collection of str
        Constants of the rig that are parameters of the model and known beforehand too well to be the reason.

    Raises
    ------
    DataError
        With the factor, and what to check.
    """
    found_too = {parameter.name for parameter in rig.parameters} & {condition.name for condition in rig.conditions}
    if rig.pulled is None or found_too - set(known) or any(name.startswith(EXPLAINED) for name in effects):
        return
    for trace in traces:
        position, force = trace.channels.get("position"), trace.channels.get("force")
        if position is None or force is None:
            continue
        pulled = rig.pulled(trace.conditions, position)
        sizes = newton_of(trace.times, position, force, pulled)
        if sizes is not None and sizes.explained >= HOLDS:
            _refuse(trace.name, sizes, pulled.mass)


def _refuse(name: str, sizes: Sizes, mass: float) -> None:
    """Gravity alone is no reason: a slope or a zero that a study states wrongly can be found, and the fit tells it."""
    if not (sizes.force > 0.0 and is_off(sizes.force, sizes.force_error)):
        return
    law = "a weight that moves as gravity and the measured force have it"
    falls = is_off(sizes.gravity, sizes.gravity_error)
    if falls and sizes.gravity and not is_off(sizes.force / sizes.gravity, 0.0):
        got = f"the weight is accelerated by {_written(sizes.gravity)} times what gravity and the measured force do"
        pace = f"{_written(1.0 / sizes.gravity)}, or that of the times by {_written(np.sqrt(sizes.gravity))}"
        do = f"Check the scale and unit of the position, which would be off by {pace} (the rate, a decimation)."
        raise DataError(name, got, law, do)
    got = f"the measured force is {_written(1.0 / sizes.force)} times the one that moves the weight so"
    do = f"Check the scale and unit of the force, to be multiplied by {_written(sizes.force)}, or weight_mass: with "
    do += f"{format_quantity(mass / sizes.force, 'kg', 2)} in motion the force would fit."
    raise DataError(name, got, law, do)


def _written(size: float) -> str:
    return format_number(size, 3)


def rules_out_a_factor(relative: float) -> bool:
    """Whether a value known with such a relative standard deviation is not off by what is refused as misread."""
    return PROVEN_FACTOR * relative < MISREAD - 1.0


def is_off(size: float, error: float) -> bool:
    """Whether a size that should be 1 is surely another one."""
    return abs(size - 1.0) > PROVEN_FACTOR * error and not 1.0 / MISREAD < size < MISREAD
