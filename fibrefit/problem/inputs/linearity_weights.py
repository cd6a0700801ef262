"""Which samples the linearised problem predicts, where inputs are measured with noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import equinox as eqx
import numpy as np
from scipy.ndimage import maximum_filter1d

from fibrefit.core.threads import for_each
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, InputErrors, residuals
from fibrefit.problem.statement.problem import Problem

STRONG = 5.0
"""What unknown errors of the inputs do to a sample, in units of its own noise, beyond which it counts less and less."""
MISSED = 0.5
"""Miss of the linearised problem, in units of a sample's noise, beyond which the sample counts less and less."""
NEARBY = 0.005
"""Time in s about such a miss in which it counts: other values of a model move it."""
DRAWS = 4
"""Of the errors of the inputs, to see where the linearised problem misses."""


def downweights(
    problem: Problem,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    sensitivities: Sequence[np.ndarray],
    roots: Sequence[np.ndarray] | None = None,
) -> np.ndarray:
    """Factor ``(n_record, n_channel, n_time)`` on the weights of samples of which the linearised problem tells little.

    A motion that bounces may depend on the errors of the inputs so strongly, or bend so soon, that such samples say
    nothing of the model and only bar the way of a search. The first is seen from the sensitivities. For the second,
    errors are drawn, and what the model makes of them is held against what the linearised one predicts.

    Parameters
    ----------
    problem, known, values, coefficients
        As in `expanded`.
    sensitivities : sequence of (n_wave, n_channel * n_time), one for each record
        As `expanded` finds them.
    roots : sequence of (n_wave, n_wave), one for each record, optional
        Of the covariance of what is not known of the coefficients; what is known of them beforehand by default.
    """
    random, missed = np.random.default_rng(0), np.zeros(1)
    here, ends = residuals(problem, known, values, coefficients), np.cumsum([w.shape[1] for w in coefficients.values()])
    for _ in range(DRAWS):
        flat = random.standard_normal((len(here), ends[-1]))
        if roots is not None:
            flat = np.stack([root @ wave for root, wave in zip(roots, flat, strict=True)])
        drawn = dict(zip(coefficients, np.split(flat, ends[:-1], axis=1), strict=True))
        there = residuals(problem, known, values, {name: wave + drawn[name] for name, wave in coefficients.items()})
        predicted = np.stack(for_each(np.matmul, flat, sensitivities))
        missed = np.maximum(missed, np.abs(there - here - predicted.reshape(here.shape)))
    missed = np.where(np.isfinite(missed), missed, np.inf)
    about = samples_about(problem, NEARBY)
    missed = np.stack([maximum_filter1d(one, size, axis=-1) for one, size in zip(missed, about, strict=True)])
    sizes = for_each(_size, sensitivities, [None] * len(here) if roots is None else roots)
    strength = np.stack(sizes).reshape(here.shape)
    return 1.0 / np.sqrt((1.0 + (missed / MISSED) ** 4) * (1.0 + (strength / STRONG) ** 4))


def _size(rows: np.ndarray, root: np.ndarray | None) -> np.ndarray:
    """Size of what errors do to each sample, seen through the root of their covariance if there is one."""
    # In single precision, as the size alone is needed.
    reached = rows if root is None else root.T.astype(np.float32) @ rows.astype(np.float32)
    return np.asarray(np.linalg.norm(reached, axis=0))


def downweighted(problem: Problem, downweight: np.ndarray) -> Problem:
    """The problem with factors ``(n_record, n_channel, n_time)`` on the weights of its samples."""
    weights = problem.observations.weight
    weaker = {channel: weights[channel] * downweight[:, c] for c, channel in enumerate(problem.model.rig.channels)}
    return eqx.tree_at(lambda p: p.observations.weight, problem, weaker)


def counted(problem: Problem, downweight: np.ndarray | float = 1.0) -> np.ndarray:
    """How much each instant of a record counts, ``(n_record, n_time)``: by the channels read then, and `downweight`."""
    weights = problem.observations.weight
    seen = np.stack([np.asarray(weights[channel]) > 0.0 for channel in problem.model.rig.channels], axis=1)
    return np.sum(seen * np.square(downweight), axis=1)


def samples_about(problem: Problem, reach: float) -> list[int]:
    """Samples of each record within a `reach` [s] of one of them, it among them."""
    experiment = problem.observations.experiment
    counts = np.asarray(experiment.count)
    steps = [np.median(np.diff(times[:n])) for times, n in zip(np.asarray(experiment.times), counts, strict=True)]
    return [1 + 2 * round(reach / float(step)) for step in steps]
