"""Starting values of a guided mass: a regression of the measured force on acceleration, direction and a constant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.problem.formulate.starting import Starting
from fibrefit.problem.statement.observations import Trace

SMOOTH = 0.03
"""Length in s of the stretches over which position is taken for a parabola."""
VISCOUS = "guide.viscous_friction.viscous_coefficient"
"""Found at once where the model has it."""
SLOW = 0.05
"""Share of the largest speed below which the direction of motion is not believed."""


def starting_guided_mass(traces: Sequence[Trace], stated: Sequence[Mapping[str, float]] = ()) -> Starting:
    """Mass, frictions and offset by least squares wherever the mass moves.

    Parameters
    ----------
    traces : sequence of Trace
    stated : sequence of mapping
        What the study says of each record; nothing of it is needed.

    Returns
    -------
    Starting

    Raises
    ------
    DataError
        If the mass hardly moves, or the force does not go with its acceleration.
    """
    rows, forces = [], []
    for trace in traces:
        speed, acceleration = _rates(trace)
        moving = np.abs(speed) > SLOW * np.nanmax(np.abs(speed))
        if moving.sum() < 16:
            raise DataError(
                trace.name, "the mass hardly moves", "a position that changes", "Check its column and unit."
            )
        gain = trace.conditions["gain"]
        regressors = [acceleration, np.sign(speed), speed, np.ones_like(speed)]
        rows.append(np.column_stack(regressors)[moving])
        forces.append(gain * trace.inputs["force"][moving, 0])
    (mass, friction, viscous, offset), *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(forces), rcond=None)
    if not mass > 0.0:
        raise DataError(
            traces[0].name,
            "the force does not go with the acceleration",
            "a force that is positive where the position speeds up",
            "Check the sign and unit of the force and position channels.",
        )
    return Starting(
        shared={
            "mass": float(mass),
            "friction": float(max(friction, 1e-2)),
            "force_offset": float(offset),
            VISCOUS: float(max(viscous, 1e-2)),
        },
        each={},
        moving=np.array([trace.times[0] for trace in traces]),
        settled=np.array([trace.times[-1] for trace in traces]),
        spread={"mass": 1.5, "friction": 1.5, "force_offset": 1.5, VISCOUS: 1.5},
        # Windows do not get longer: there is nothing to be learnt from a part of them first.
        ladders=((),),
    )


def _rates(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Speed and acceleration from the anchors, by parabolas."""
    from scipy.signal import savgol_filter

    step = float(np.diff(trace.times).mean())
    window = max(5, round(SMOOTH / step) | 1)
    position = trace.inputs["anchor"][:, 0]
    speed, acceleration = (savgol_filter(position, window, 2, deriv=d, delta=step) for d in (1, 2))
    return speed, acceleration
