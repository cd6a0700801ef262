"""What the laws of a rig may depend on, in the motion that a fit found: how far each variable goes."""

from __future__ import annotations

import numpy as np

from fibrefit.core.declarations import FORCES, HELD, HISTORY
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import FORGETS, FORGOTTEN_AFTER, loading

FROM_ZERO = ("speed", "tension", "stretch", *HISTORY)
"""Variables whose range begins at zero."""


def in_motion(found: Identification) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Every variable the rig has while it moves in the simulated motion, in SI units, and the time it stays there in s.

    Returns
    -------
    dict of str to ((n_sample,), (n_sample,))
    """
    times = np.asarray(found.problem.observations.experiment.times)
    counts = np.asarray(found.problem.observations.experiment.count)
    moving = (found.motion.phase != HELD) & (np.arange(times.shape[1]) < counts[:, None])
    steps = np.diff(times, append=times[:, -1:])[moving]
    states = found.motion.states
    speed = np.abs(states["speed"])
    known = states | {"speed": speed, "time": times - times[:, :1]}
    ahead = np.where(found.motion.phase[:, :-1] != HELD, speed[:, :-1] * np.diff(times, axis=1), 0.0)
    known["path"] = np.cumsum(np.pad(ahead, ((0, 0), (1, 0))), axis=1)
    known["time at rest"] = _rested(speed, found.motion.phase != HELD, np.diff(times, axis=1))
    if "stretch" in states:
        # A slack fibre has neither.
        taut = states["stretch"] > 0.0
        known |= {name: np.where(taut, states[name], 0.0) for name in ("stretch", "stretch rate")}
        borne = np.asarray(loading(states["stretch"], states["stretch rate"]))[:, :-1] * np.diff(times, axis=1)
        known["load cycles"] = np.cumsum(np.pad(np.maximum(borne, 0.0), ((0, 0), (1, 0))), axis=1)
    there = {variable: (values[moving], steps) for variable, values in known.items()}
    forces = [values[moving] for channel, values in found.readings.items() if channel in FORCES]
    if found.motion.driven is not None:
        rates = np.asarray(found.problem.observations.experiment.inputs["drive"].slopes)
        there["drive speed"] = np.abs(rates)[moving], steps
    if forces:
        there["force"] = np.concatenate(forces), np.tile(steps, len(forces))
    return there


def _rested(speed: np.ndarray, begun: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """How long the weight of each record has been at rest at each instant, in s: `resting` from step to step."""
    rest = np.zeros(speed.shape)
    for n in range(steps.shape[1]):
        fades = np.minimum(speed[:, n] / FORGOTTEN_AFTER, 1.0 / FORGETS) * steps[:, n]
        # The solution of a linear equation over the step; without motion it is the step itself.
        grown = np.where(fades > 0.0, -np.expm1(-fades) / np.where(fades > 0.0, fades, 1.0), 1.0)
        rest[:, n + 1] = np.where(begun[:, n], rest[:, n] * np.exp(-fades) + grown * steps[:, n], 0.0)
    return rest


def range_of(variable: str, values: np.ndarray) -> tuple[float, float]:
    """Range of a variable that a curve over it has, in SI units.

    Parameters
    ----------
    variable : str
    values : (n_sample,)
        In the motion.
    """
    if variable == "stretch rate":
        fast = float(np.quantile(np.abs(values), 0.995))
        return -fast, fast
    # Rates of a measured drive are noisy.
    most = float(np.quantile(values, 0.995)) if variable == "drive speed" else float(values.max())
    return 0.0 if variable in FROM_ZERO else float(values.min()), most
