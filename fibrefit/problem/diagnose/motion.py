"""What a rig is doing at each sample: phase and states of its motion; and what a fit leaves of the readings there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from fibrefit.core.declarations import BACK, FORCES, FORWARDS, HELD, LOADING, REST, SLACK, STICKING, UNLOADING
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Problem, Trajectories
from fibrefit.problem.thresholds import CREEPS

AVERAGED = 0.02
"""Length in s over which the rate of a drive is averaged, and of a pause that is none."""


@dataclass(frozen=True)
class Motion:
    """The simulated motion behind the readings; NumPy, SI units.

    Parameters
    ----------
    phase : (n_record, n_time) int
        Index into `fibrefit.core.declarations.PHASES`. Loading and unloading go by the rate of the stretch. A guide
        sticks where it will slide again, or while the drive moves; it is at rest before the first motion and after the
        last, and with the drive.
    states : dict of (n_record, n_time)
        ``position`` [m], ``speed`` [m/s]; where there is a fibre ``tension`` [N], ``stretch`` [m], negative while it is
        slack, and ``stretch rate`` [m/s], of two fibres those of the one that is stretched more.
    trouble : (n_record,) bool
        Whether the integrator had to give up on locating switches somewhere.
    readings : dict of channel to (n_record, n_time)
        What the sensors make of it.
    sliding : (n_record, n_time) int or None
        Direction in which the weight slides in its guide: 1, -1, or 0 where it does not; None without a guide.
    driven : (n_record, n_time) bool or None
        Whether the drive moves; None without a drive.
    """

    phase: np.ndarray
    states: dict[str, np.ndarray]
    trouble: np.ndarray
    readings: dict[str, np.ndarray]
    sliding: np.ndarray | None = None
    driven: np.ndarray | None = None

    @classmethod
    def of(cls, problem: Problem, values: np.ndarray | jax.Array) -> Motion:
        """Simulated motion of all records at `values` ``(n_free,)`` or ``(n_record, n_local)`` in SI units."""
        local = np.asarray(values if np.ndim(values) == 2 else problem.layout.local(jnp.asarray(values)))
        return cls._of_moved(problem, local, problem.trajectories_at(local))

    @classmethod
    def of_fit(cls, problem: Problem, local: np.ndarray) -> Motion:
        """The same at their own values ``(n_record, n_local)``, by the program a fit has compiled for its slopes."""
        local = np.asarray(local)
        return cls._of_moved(problem, local, problem.evaluate(local)[1])

    @classmethod
    def _of_moved(cls, problem: Problem, local: np.ndarray, moved: Trajectories) -> Motion:
        moved = jax.tree.map(np.asarray, moved)
        experiment, modes, known = problem.observations.experiment, moved.modes, _known(moved)
        times = np.asarray(experiment.times)
        held = np.zeros(times.shape, dtype=bool)
        if "release" in problem.layout.names:
            held = times < local[:, [problem.layout.names.index("release")]]
        driven = sliding = None
        if "drive" in experiment.inputs:
            driven = moves(np.asarray(experiment.inputs["drive"].slopes), times)
        if hasattr(modes, "guide"):
            sliding = np.where(held, 0, np.sign(modes.guide))
            # The time beyond the end of a record holds no motion.
            sliding = np.where(np.arange(times.shape[1]) < np.asarray(experiment.count)[:, None], sliding, 0)
        phase = np.where(held, HELD, _phase(modes, known, sliding, driven))
        return cls(phase, known, moved.trouble, moved.channels, sliding, driven)


def moves(rates: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Whether a drive moves, ``(n_record, n_time)``; where it only turns round it does.

    Parameters
    ----------
    rates : (n_record, n_time) in m/s
    times : (n_record, n_time) in s
    """
    found = []
    for rate, time in zip(rates, times, strict=True):
        width = 2 * round(0.5 * AVERAGED / float(time[1] - time[0])) + 1
        size = np.abs(uniform_filter1d(rate, width, mode="nearest"))
        found.append(minimum_filter1d(maximum_filter1d(size > CREEPS * size.max(), width), width))
    return np.stack(found)


def _known(moved: Trajectories) -> dict[str, np.ndarray]:
    """States a missing effect may depend on, by what the rig has."""
    states, channels = moved.states, moved.channels
    if hasattr(states, "angle"):
        known = {"position": states.angle, "speed": states.rate}
    else:
        known = {"position": states.position, "speed": states.velocity}
    forces = [reading for name, reading in channels.items() if name in FORCES]
    if forces:
        known["tension"] = np.maximum.reduce(forces)
    if moved.fibres:
        stretches, rates = (np.stack(parts) for parts in zip(*moved.fibres, strict=True))
        more = stretches.argmax(axis=0)[None]
        known["stretch"] = np.take_along_axis(stretches, more, axis=0)[0]
        known["stretch rate"] = np.take_along_axis(rates, more, axis=0)[0]
    return known


def _phase(
    modes: Any, known: dict[str, np.ndarray], sliding: np.ndarray | None, driven: np.ndarray | None
) -> np.ndarray:
    """Phase by the modes of the fibres, where the rig has any, and of the guide."""
    speed = known["speed"]
    fibres = [getattr(modes, name) for name in ("fibre", "fibre_1", "fibre_2") if hasattr(modes, name)]
    still = np.zeros(speed.shape, dtype=bool) if sliding is None else sliding == 0
    if driven is None:
        ahead = np.logical_or.accumulate(~still, axis=1)
        after = np.logical_or.accumulate(~still[:, ::-1], axis=1)[:, ::-1]
        sticks = still & ahead & after
    else:
        sticks = still & driven
    resting = np.where(sticks, STICKING, REST)
    if not fibres:
        return np.where(still, resting, np.where(speed >= 0.0, FORWARDS, BACK))
    taut = np.logical_or.reduce([mode > 0 for mode in fibres])
    phase = np.where(taut, np.where(known["stretch rate"] >= 0.0, LOADING, UNLOADING), SLACK)
    return np.where(still & taut, resting, phase)


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
