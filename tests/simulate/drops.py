"""Drops of a weight, and what a model says of them: shared by the tests of laws, rigs and integrator."""

from __future__ import annotations

import functools
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.parameter import ByInverse, Parameter
from fibrefit.effects.law import Effect
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulate.model import Experiment, Model

STEP = 5e-4
CONDITIONS = {"weight_mass": 3.096, "added_mass": 0.0, "inclination": math.pi / 2, "lift": 0.012}
VALUES = {"stiffness": 20e3, "damping": 25.0, "friction": 4.0, "position_zero": 0.0, "release": 0.0}


def drop(samples: int = 1601, **conditions: float) -> Experiment:
    """A drop whose weight is let go with the first sample."""
    known = {name: jnp.asarray(float(value)) for name, value in (CONDITIONS | conditions).items()}
    return Experiment(jnp.arange(samples) * STEP, jnp.int32(samples), known, {})


def given(values: dict[str, float]) -> dict[str, Any]:
    """Values as arrays; infinite ones by their inverse."""
    return {
        name: ByInverse(jnp.zeros(())) if math.isinf(value) else jnp.asarray(float(value))
        for name, value in values.items()
    }


def dotted(effects: tuple[type[Effect], ...], choose: str) -> dict[str, float]:
    """Null or typical values of the parameters of effects under the names they bear in a model.

    At `null`, only the strengths are nil: the others stay typical.
    """

    def value(effect: type[Effect], parameter: Parameter) -> float:
        nil = choose == "null" and parameter.name in effect.strength
        return parameter.null if nil else parameter.typical

    return {f"{effect.name}.{p.name}": value(effect, p) for effect in effects for p in effect.parameters}


@functools.cache
def _compiled(kind: str, effects: tuple[type[Effect], ...], tension_law: str, jacobian: bool) -> Any:
    model = Model(RIGS[kind], effects, tension_law)

    def channels(values: Any, experiment: Experiment) -> dict[str, jax.Array]:
        return model.respond(values, experiment).channels

    return jax.jit(jax.jacfwd(channels) if jacobian else channels)


def respond(
    experiment: Experiment,
    effects: tuple[type[Effect], ...] = (),
    tension_law: str = "clamped",
    kind: str = "fibre_mass",
    **values: float,
) -> dict[str, np.ndarray]:
    """Channels of a model with the values of the reference, changed as asked (dots of names as `__`)."""
    changed = {name.replace("__", "."): value for name, value in values.items()}
    channels = _compiled(kind, effects, tension_law, False)(given(VALUES | changed), experiment)
    return {role: np.asarray(reading) for role, reading in channels.items()}


def jacobian(
    experiment: Experiment, effects: tuple[type[Effect], ...] = (), kind: str = "fibre_mass", **values: float
) -> dict[str, dict[str, np.ndarray]]:
    """Derivatives of the channels; of a parameter given by its inverse, in that."""
    changed = {name.replace("__", "."): value for name, value in values.items()}
    found = _compiled(kind, effects, "clamped", True)(given(VALUES | changed), experiment)
    return {
        role: {n: np.asarray(d.inverse if isinstance(d, ByInverse) else d) for n, d in columns.items()}
        for role, columns in found.items()
    }


def deviation(found: np.ndarray, true: np.ndarray) -> float:
    """Root mean square of the difference over the range."""
    return float(np.sqrt(np.mean((found - true) ** 2)) / np.ptp(true))
