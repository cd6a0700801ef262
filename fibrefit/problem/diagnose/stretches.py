"""What flights and contacts of a falling weight share: where they are, what they are fitted by, and how surely.

Either is given by the two measured channels alone, whatever the fibre is: positions of each stretch are a sum of a few
shapes whose sizes all stretches share, and of a polynomial of the stretch's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fibrefit.problem.task import Task

POSITION, FORCE = "position", "force"
SMOOTHED_LOAD, TURNED = 8e-3, 20e-3
"""Length in s of the windows in which load and direction are found: noise moves the instant at which a weight turns."""


class SharedShapes(NamedTuple):
    """Least squares of positions in shapes.

    Parameters
    ----------
    sizes : (n_wanted,)
    weights : (n_wanted, n_sample)
        Of the positions in each of the sizes.
    left : (n_sample,) in m
        What these leave.
    """

    sizes: np.ndarray
    weights: np.ndarray
    left: np.ndarray


def fitted_shapes(positions: np.ndarray, shapes: np.ndarray, wanted: int, resolved: float) -> SharedShapes | None:
    """Sizes of shapes in the positions of all stretches; None where the shapes are not distinguished.

    Parameters
    ----------
    positions : (n_sample,) in m
    shapes : (n_sample, n_shape)
        Both without what each stretch has of its own.
    wanted : int
        How many of the shapes, the first ones, have a size that is needed.
    resolved : float
        Smallest singular value over the largest from which shapes are distinguished.
    """
    if not (np.isfinite(positions).all() and np.isfinite(shapes).all()):
        return None
    scale = np.maximum(np.linalg.norm(shapes, axis=0), np.finfo(float).tiny)
    left, size, right = np.linalg.svd(shapes / scale, full_matrices=False)
    if not size[-1] > resolved * size[0]:
        return None
    weights = (left @ (right[:, :wanted] / size[:, None])).T / scale[:wanted, None]
    return SharedShapes(weights @ positions, weights, positions - left @ (left.T @ positions))


def without_polynomial(table: np.ndarray, time: np.ndarray, seen: np.ndarray, degree: int) -> np.ndarray:
    """Columns ``(n_seen, n_column)`` of a stretch, less the polynomials in time that are nearest to them.

    Parameters
    ----------
    table : (n_sample, n_column)
    time : (n_sample,)
    seen : (n_sample,) bool
        Samples that count.
    degree : int
        1 where another start and speed could be, 2 where another constant force could be as well.
    """
    own, _ = np.linalg.qr(np.column_stack([time**power for power in range(degree + 1)])[seen])
    return table[seen] - own @ (own.T @ table[seen])


def measured_positions(task: Task, record: int) -> np.ndarray:
    """Measured positions of a record ``(n_time,)`` in m, NaN where they do not count."""
    data, n = task.problem.observations, len(task.traces[record].times)
    counted = np.asarray(data.weight[POSITION])[record, :n] > 0.0
    return np.where(counted, np.asarray(data.measured[POSITION])[record, :n], np.nan)


def stated_and_found(task: Task, local: np.ndarray, record: int) -> dict[str, float]:
    """Conditions and values of a record by name, in SI units, from the values ``(n_record, n_local)`` of all."""
    values = dict(zip(task.problem.layout.names, local[record], strict=True))
    return {**task.traces[record].conditions, **values}


def error_of_sum(task: Task, places: Sequence[tuple[int, np.ndarray]], weights: np.ndarray, left: np.ndarray) -> float:
    """Standard error of a weighted sum of measured positions.

    Parameters
    ----------
    places : sequence of (int, (n_sample,) int)
        Record and samples of stretches of the positions.
    weights : (n_sample,)
        Of the positions of all stretches, one after the other.
    left : (n_sample,)
        What least squares leave of them, in m: where it is louder than the noise of the rests, noise is as loud.
    """
    noise, variance = task.noise[POSITION], 0.0
    parts = np.split(weights, np.cumsum([len(samples) for _, samples in places])[:-1])
    for r, trace in enumerate(task.traces):
        of_record = np.zeros(len(trace.times))
        for (record, samples), part in zip(places, parts, strict=True):
            if record == r:
                of_record[samples] += part
        variance += noise.variance_of_sum(of_record, trace.rate)
    rate, longest = task.traces[0].rate, max(len(samples) for _, samples in places)
    louder = float(np.sqrt(np.mean(left**2))) / noise.rms(longest / rate, rate)
    return float(np.sqrt(variance)) * max(1.0, louder)
