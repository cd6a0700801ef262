"""What a fit leaves: all that is needed to say where model and measurement part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import jax.numpy as jnp
import numpy as np

from fibrefit.problem.diagnose.phases import Motion, motion
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Problem

WINDOW = 0.010
"""Length in s of the shortest windows whose gap is compared: a fraction of a contact."""


class ResidualSet(Protocol):
    """Residuals of a fit, with the motion and the noise behind them; an Identification is one.

    Attributes
    ----------
    problem : Problem
    residuals : (n_record, n_channel, n_time) in units of the noise
    motion : Motion
    noise : mapping of channel to Noise
    """

    @property
    def problem(self) -> Problem: ...  # noqa: D102
    @property
    def residuals(self) -> np.ndarray: ...  # noqa: D102
    @property
    def motion(self) -> Motion: ...  # noqa: D102
    @property
    def noise(self) -> Mapping[str, Noise]: ...  # noqa: D102


@dataclass(frozen=True)
class Remains:
    """The same, of any values of any problem; see `ResidualSet`."""

    problem: Problem
    residuals: np.ndarray
    motion: Motion
    noise: Mapping[str, Noise]


def residual_set_at(problem: Problem, values: np.ndarray, noise: Mapping[str, Noise]) -> Remains:
    """What values leave of a problem whose inputs are taken as they are.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    noise : mapping of channel to Noise
    """
    moved, data = motion(problem, jnp.asarray(values)), problem.observations
    channels = problem.model.rig.channels
    residuals = np.stack(
        [np.asarray(data.weight[c]) * (moved.readings[c] - np.asarray(data.measured[c])) for c in channels], axis=1
    )
    return Remains(problem, residuals, moved, noise)


class Strand(NamedTuple):
    """One channel of one record.

    Parameters
    ----------
    record, channel : int
    residual : (n_sample,) in units of the noise
    counted : (n_sample,) bool
    times : (n_sample,) in s
    phase : (n_sample,) int
    sigma : float
        Noise rms, in SI units.
    noise : Noise
    """

    record: int
    channel: int
    residual: np.ndarray
    counted: np.ndarray
    times: np.ndarray
    phase: np.ndarray
    sigma: float
    noise: Noise

    @property
    def rate(self) -> float:
        """Sampling rate in Hz."""
        return float((len(self.times) - 1) / (self.times[-1] - self.times[0]))

    @property
    def window(self) -> int:
        """Samples of the shortest windows that are compared."""
        return max(round(WINDOW * self.rate), 4)

    @property
    def excess(self) -> np.ndarray:
        """Squared residuals beyond what noise leaves on average, ``(n_sample,)``; nil where a sample does not count."""
        return np.where(self.counted, self.residual**2 - 1.0, 0.0)


def strands(found: ResidualSet) -> list[Strand]:
    """All channels of all records, without the padding."""
    data, channels = found.problem.observations, found.problem.model.rig.channels
    times, counts = np.asarray(data.experiment.times), np.asarray(data.experiment.count)
    weights = [np.asarray(data.weight[channel]) for channel in channels]
    return [
        Strand(
            r,
            c,
            found.residuals[r, c, :count],
            weights[c][r, :count] > 0.0,
            times[r, :count],
            found.motion.phase[r, :count],
            float(1.0 / max(weights[c][r].max(), 1e-300)),
            found.noise[channel],
        )
        for r, count in enumerate(counts)
        for c, channel in enumerate(channels)
    ]
