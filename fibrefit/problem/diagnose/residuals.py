"""What a fit leaves: all that is needed to say where model and measurement part, and whether that is noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fibrefit.problem.diagnose.phases import Motion
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Problem


@dataclass(frozen=True)
class ResidualSet:
    """Residuals of some values, with the motion and the noise behind them.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time) in units of the noise
    noise : mapping of channel to Noise
        At rest.
    fitted : mapping of channel to Noise
        Of the residuals, where that was requested.
    rests : mapping of channel to readings at rest in SI units and their rates in Hz
    stated : tuple of str
        Channels whose noise the study states.
    """

    problem: Problem
    residuals: np.ndarray
    motion: Motion
    noise: Mapping[str, Noise]
    fitted: Mapping[str, Noise] = field(default_factory=dict)
    rests: Mapping[str, Sequence[tuple[np.ndarray, float]]] = field(default_factory=dict)
    stated: tuple[str, ...] = ()

    @property
    def channels(self) -> tuple[str, ...]:
        """In the order of the residuals."""
        return self.problem.model.rig.channels

    @property
    def _weight(self) -> np.ndarray:
        return np.stack([np.asarray(self.problem.observations.weight[c]) for c in self.channels], axis=1)

    @cached_property
    def counted(self) -> np.ndarray:
        """Samples that count, ``(n_record, n_channel, n_time)``."""
        return self._weight > 0.0

    @cached_property
    def sigma(self) -> np.ndarray:
        """Noise rms, ``(n_record, n_channel)`` in SI units."""
        return 1.0 / np.maximum(self._weight.max(axis=2), 1e-300)

    @cached_property
    def times(self) -> np.ndarray:
        """Instants ``(n_record, n_time)`` in s."""
        return np.asarray(self.problem.observations.experiment.times)

    @cached_property
    def counts(self) -> np.ndarray:
        """Samples of each record, ``(n_record,)``."""
        return np.asarray(self.problem.observations.experiment.count)

    @cached_property
    def rates(self) -> np.ndarray:
        """Samples a second of each record, ``(n_record,)`` in Hz."""
        return np.array([1.0 / np.diff(times[:n]).mean() for times, n in zip(self.times, self.counts, strict=True)])

    @cached_property
    def rate(self) -> float:
        """Their mean, in Hz."""
        return float(self.rates.mean())
