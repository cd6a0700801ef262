"""Laws of speed a series is tested for, and the speeds at which each record tells of each parameter.

For each parameter of a rig there is a power, a power added, and a free curve.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import LOADING, UNLOADING
from fibrefit.laws import functions_of_speed as of_speed
from fibrefit.laws.catalogue import HasCapabilities, suits
from fibrefit.laws.law import Effect
from fibrefit.problem import STANDING, Motion


class SpeedLaw(NamedTuple):
    """A law of speed of one parameter.

    Parameters
    ----------
    parameter : str
        Of the base model, which it multiplies.
    form : str
        ``"power"``, ``"added power"`` or ``"free curve"``.
    effect : Effect class
    """

    parameter: str
    form: str
    effect: type[of_speed.FunctionOfSpeed]


LAWS = (
    SpeedLaw("stiffness", "power", of_speed.StiffnessSpeedExponent),
    SpeedLaw("stiffness", "added power", of_speed.StiffnessPowerLaw),
    SpeedLaw("stiffness", "free curve", of_speed.StiffnessSpeedCurve),
    SpeedLaw("damping", "power", of_speed.DampingSpeedExponent),
    SpeedLaw("damping", "added power", of_speed.DampingPowerLaw),
    SpeedLaw("damping", "free curve", of_speed.DampingSpeedCurve),
    SpeedLaw("friction", "power", of_speed.FrictionSpeedExponent),
    SpeedLaw("friction", "added power", of_speed.FrictionPowerLaw),
    SpeedLaw("friction", "free curve", of_speed.FrictionSpeedCurve),
)
BY_EFFECT = {law.effect.name: law for law in LAWS}


def laws_on(rig: HasCapabilities) -> tuple[SpeedLaw, ...]:
    """Laws that make sense on a rig."""
    return tuple(law for law in LAWS if suits(law.effect, rig))


def parameter_of(effect: type[Effect]) -> str:
    """Parameter that a law of speed multiplies; empty for any other effect."""
    return BY_EFFECT[effect.name].parameter if effect.name in BY_EFFECT else ""


def factors(law: SpeedLaw, values: Mapping[str, float], speeds: np.ndarray) -> np.ndarray:
    """What a parameter is multiplied by at speeds ``(n_speed,)`` in m/s.

    Parameters
    ----------
    law : SpeedLaw
    values : mapping of str to float
        Parameters of the effect by their dotted names, in SI units.
    speeds : (n_speed,) in m/s
    """
    own = {p.name: jnp.asarray(values[f"{law.effect.name}.{p.name}"]) for p in law.effect.parameters}
    return np.asarray(jax.vmap(law.effect(**own).factor)(jnp.asarray(speeds)))


def speeds_of(motion: Motion, counts: np.ndarray) -> dict[str, np.ndarray]:
    """Slow end, root mean square and fast end of the speeds that tell of each parameter, ``(n_record, 3)`` in m/s.

    Stiffness and damping by the rate of stretch of the taut fibre, friction by the speed of the weight in its guide;
    NaN where a record shows none.

    Parameters
    ----------
    motion : Motion
    counts : (n_record,) int
        Samples of each record.
    """
    there = np.arange(motion.phase.shape[1]) < counts[:, None]
    guide = np.abs(motion.states["speed"])
    found = {"friction": _spans(guide, there & (guide > STANDING))}
    if "stretch rate" in motion.states:
        rate = np.abs(motion.states["stretch rate"])
        taut = there & np.isin(motion.phase, (LOADING, UNLOADING)) & (rate > STANDING)
        found["stiffness"] = found["damping"] = _spans(rate, taut)
    return found


def _spans(speeds: np.ndarray, moving: np.ndarray) -> np.ndarray:
    rows = []
    for speed, here in zip(speeds, moving, strict=True):
        seen = speed[here]
        if not seen.size:
            rows.append([np.nan] * 3)
            continue
        # All but the slowest and the fastest twentieth of the moving samples.
        slow, fast = np.quantile(seen, [0.05, 0.95])
        rows.append([float(slow), float(np.sqrt(np.mean(seen**2))), float(fast)])
    return np.array(rows)


def span(rows: np.ndarray) -> tuple[float, float]:
    """Slowest and fastest of all records."""
    return float(np.nanmin(rows[:, 0])), float(np.nanmax(rows[:, 2]))
