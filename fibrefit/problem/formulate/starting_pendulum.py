"""Starting values of a plain pendulum: a regression of its angular acceleration, and the period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.problem.formulate.rates import rates_of
from fibrefit.problem.formulate.starting import NOTHING, Initial, Starting
from fibrefit.problem.statement.observations import Trace
from fibrefit.rigs.rig import STANDARD_GRAVITY

SMOOTH = 0.15
"""Share of a period over which the angle is taken for a parabola."""
SLOW = 0.1
"""Share of the largest rate below which the direction of turning is not believed."""
PERIODS = 1.5
"""Length of the first horizon."""
LATE = 1.0 / 3.0
"""Share of a record, at its end, whose middle is where the pendulum hangs."""


def starting_pendulum(
    traces: Sequence[Trace], stated: Sequence[Mapping[str, float]] = (), initial: Initial = NOTHING
) -> Starting:
    """Length, damping and friction by least squares; the zero from the end of each record, the start from its begin.

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
        If the angle does not swing.
    """
    found = [_swing(trace) for trace in traces]
    length, damping, friction = (float(np.median([one[i] for one in found])) for i in range(3))
    inertia = float(np.median([_inertia(trace, length) for trace in traces]))
    periods = np.array([one[3] for one in found])
    begin, end = (np.array([trace.times[i] for trace in traces]) for i in (0, -1))
    zero, angle, rate = (np.array([one[i] for one in found]) for i in (4, 5, 6))
    return Starting(
        shared={"length": length, "damping": damping * inertia, "friction": friction * inertia},
        each={"angle_zero": zero, "start_angle": angle, "start_rate": rate},
        moving=begin,
        settled=np.minimum(begin + PERIODS * periods, end),
        spread={"length": 1.1, "damping": 3.0, "friction": 3.0},
        ladders=((1.0, 3.0, 9.0), (2.0, 6.0, 18.0)),
    )


def _inertia(trace: Trace, length: float) -> float:
    known = trace.conditions["mass"] * trace.conditions["centre_distance"]
    return known * length if known > 0.0 else trace.conditions["moment_of_inertia"]


def period_of(values: np.ndarray, times: np.ndarray) -> float:
    """Period of a signal in s from its spectrum; not a number where it does not swing once."""
    count = len(values)
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(count), 8 * count)) ** 2
    frequency = np.fft.rfftfreq(8 * count, float(np.diff(times).mean()))
    power[frequency < 1.5 / (times[-1] - times[0])] = 0.0
    best = int(np.argmax(power))
    return 1.0 / float(frequency[best]) if power[best] > 0.0 else float("nan")


def _swing(trace: Trace) -> tuple[float, ...]:
    """Length, damping and friction over inertia, period, zero, first angle and rate."""
    measured, times = trace.channels["angle"], trace.times
    seen = np.isfinite(measured)
    whole = np.interp(times, times[seen], measured[seen])
    period = period_of(whole, times)
    if not np.isfinite(period):
        do = "Record at least two swings, and check the column and unit of the angle."
        raise DataError(trace.name, "the angle does not swing", "a pendulum that is let go", do)
    late = whole[-max(round(LATE * len(whole)), 2) :]
    zero = 0.5 * float(np.quantile(late, 0.02) + np.quantile(late, 0.98))
    angle, rate, second = rates_of(whole - zero, times, SMOOTH * period)
    turning = np.abs(rate) > SLOW * np.abs(rate).max()
    columns = np.column_stack([-np.sin(angle), -rate, -np.sign(rate)])[turning]
    (pull, damping, friction), *_ = np.linalg.lstsq(columns, second[turning], rcond=None)
    if not pull > 0.0:
        pull = (2.0 * np.pi / period) ** 2
    # At once nothing and far too much lose the swing; a share of what damps it at all keeps it.
    floor = 1e-3 * np.sqrt(pull)
    return (
        STANDARD_GRAVITY / float(pull),
        max(float(damping), floor),
        max(float(friction), 0.1 * floor * float(np.abs(rate).max())),
        period,
        zero,
        float(angle[0]),
        float(rate[0]),
    )
