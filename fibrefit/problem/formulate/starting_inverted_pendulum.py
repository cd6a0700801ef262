"""Starting values of an inverted pendulum: a regression of the measured forces on the stretch of the fibres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.problem.formulate.rates import derivative
from fibrefit.problem.formulate.starting import NOTHING, Initial, Starting
from fibrefit.problem.statement.observations import Trace

SMOOTH = 0.008
"""Length in s of the stretches over which the angle is taken for a parabola."""
LOADED = 0.1
"""Share of the largest force above which a fibre is surely taut."""
HORIZON = 0.25
"""Time in s that the guesses are trusted to predict."""


def starting_inverted_pendulum(
    traces: Sequence[Trace], stated: Sequence[Mapping[str, float]] = (), initial: Initial = NOTHING
) -> Starting:
    """Stiffness and damping by least squares wherever a fibre carries load; the start from the first samples.

    Parameters
    ----------
    traces : sequence of Trace
    stated : sequence of mapping
        What the study says of each record; nothing of it is needed.
    initial : mapping of str to float or None
        Not needed.

    Returns
    -------
    Starting

    Raises
    ------
    DataError
        If the forces do not grow as the fibres are stretched.
    """
    rows, forces, starts = [], [], []
    for trace in traces:
        angle, rate = _smooth(trace)
        starts.append((angle[0], rate[0]))
        for side, role in ((1.0, "force_1"), (-1.0, "force_2")):
            stretch, speed = _stretch(trace, side, angle, rate)
            force = trace.channels[role]
            taut = (force > LOADED * np.nanmax(force)) & (force > 0.0)
            rows.append(np.column_stack([stretch, speed])[taut])
            forces.append(force[taut] - trace.conditions["preload"])
    (stiffness, damping), *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(forces), rcond=None)
    if not stiffness > 0.0:
        raise DataError(
            traces[0].name,
            "the forces do not grow as the fibres are stretched",
            "an angle that grows towards the first fibre, and a drive that draws at it",
            "Check the signs and units of angle, drive and forces.",
        )
    begin = np.array([trace.times[0] for trace in traces])
    end = np.array([trace.times[-1] for trace in traces])
    return Starting(
        shared={"stiffness": float(stiffness), "damping": float(max(damping, 1e-4 * stiffness))},
        each={"start_angle": np.array([s[0] for s in starts]), "start_rate": np.array([s[1] for s in starts])},
        moving=begin,
        settled=np.minimum(begin + HORIZON, end),
        spread={"stiffness": 1.5, "damping": 4.0},
        ladders=((1.0, 3.0), (2.0, 6.0)),
    )


def _smooth(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Angle and its rate, by parabolas."""
    angle, rate = (derivative(trace.channels["angle"], trace.times, SMOOTH, order) for order in (0, 1))
    return angle, rate


def _stretch(trace: Trace, side: float, angle: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length of a fibre beyond that upright, and its rate."""
    a, d = trace.conditions["anchor_distance"], trace.conditions["attachment_height"]
    x, x_rate = trace.inputs["drive"][:, 0], trace.inputs["drive"][:, 1]
    across, up = a + side * (x - d * np.sin(angle)), d * np.cos(angle)
    length = np.hypot(across, up)
    speed = side * (across * x_rate - (a + side * x) * up * rate) / length
    return length - np.hypot(a, d), speed
