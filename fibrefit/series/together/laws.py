"""Laws of speed a series is tested for: for each parameter of a rig a power, a power added, and a free curve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.laws.catalogue import HasCapabilities, suits
from fibrefit.laws.functions_of_speed import (
    DampingPowerLaw,
    DampingSpeedCurve,
    DampingSpeedExponent,
    FrictionPowerLaw,
    FrictionSpeedCurve,
    FrictionSpeedExponent,
    FunctionOfSpeed,
    StiffnessPowerLaw,
    StiffnessSpeedCurve,
    StiffnessSpeedExponent,
)
from fibrefit.laws.law import Effect


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
    effect: type[FunctionOfSpeed]


LAWS = (
    SpeedLaw("stiffness", "power", StiffnessSpeedExponent),
    SpeedLaw("stiffness", "added power", StiffnessPowerLaw),
    SpeedLaw("stiffness", "free curve", StiffnessSpeedCurve),
    SpeedLaw("damping", "power", DampingSpeedExponent),
    SpeedLaw("damping", "added power", DampingPowerLaw),
    SpeedLaw("damping", "free curve", DampingSpeedCurve),
    SpeedLaw("friction", "power", FrictionSpeedExponent),
    SpeedLaw("friction", "added power", FrictionPowerLaw),
    SpeedLaw("friction", "free curve", FrictionSpeedCurve),
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
