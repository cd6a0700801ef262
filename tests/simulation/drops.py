"""Drops of a weight and movements of a drive, and what a model says of them: shared by many tests."""

from __future__ import annotations

import functools
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import ByInverse, Parameter
from fibrefit.laws.law import Effect
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.excitation import Excitation
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import Experiment, Model

STEP = 5e-4
CONDITIONS = {"weight_mass": 3.096, "added_mass": 0.0, "inclination": math.pi / 2, "lift": 0.012}
VALUES = {"stiffness": 20e3, "damping": 25.0, "friction": 4.0, "position_zero": 0.0, "release": 0.0}
SECOND = {"order": 2.0}
"""Place in the series: what changes from record to record shows from the second on."""

DRIVE_CONDITIONS = {
    "weight_mass": 8.131,
    "added_mass": 0.0,
    "inclination": math.radians(30.0),
    "pulley_diameter": 0.08,
    "wrap_angle": math.radians(150.0),
    "near_share": 0.5,
    "lateral_offset": 0.0,
    "guide_distance": 0.9,
}
START_TENSION = DRIVE_CONDITIONS["weight_mass"] * 9.81 * 0.5
TRAPEZOID = Excitation("trapezoid", amplitude=0.06, rate=0.25, lead=0.1, hold=0.4, cycles=1)
QUICK = Excitation("trapezoid", amplitude=0.02, rate=0.25, lead=0.02, hold=0.1, cycles=1)
"""One movement within 0.4 s, with slack, sticking and reversals."""
PENDULUM_CONDITIONS = {
    "rod_length": 1.0,
    "rod_mass": 9.864,
    "moment_of_inertia": 3.288,
    "attachment_height": 0.75,
    "anchor_distance": 1.2,
    "preload": 0.0,
}
OF_RIG = {kind: {p.name: p.typical for p in (*rig.parameters, *rig.nuisances)} for kind, rig in RIGS.items()} | {
    "fibre_mass": VALUES,
    "pulley_drive": {"stiffness": 20e3, "damping": 25.0, "friction": 4.0, "position_zero": 0.0}
    | {"start_tension": START_TENSION},
    "inverted_pendulum": {"stiffness": 8264.0, "damping": 4.132, "start_angle": 0.0, "start_rate": 0.0},
    "guided_mass": {"mass": 10.0, "friction": 4.0, "force_offset": 0.3},
    "pendulum": {"length": 0.4, "damping": 2e-3, "friction": 5e-3}
    | {"angle_zero": 0.02, "start_angle": 0.5, "start_rate": 0.0},
}


def drop(samples: int = 1601, **conditions: float) -> Experiment:
    """A drop whose weight is let go with the first sample."""
    known = {name: jnp.asarray(float(value)) for name, value in (CONDITIONS | SECOND | conditions).items()}
    return Experiment(jnp.arange(samples) * STEP, jnp.int32(samples), known, {})


def drive(samples: int = 3201, excitation: Excitation = TRAPEZOID, **conditions: float) -> Experiment:
    """A movement of the drive."""
    known = {name: jnp.asarray(float(value)) for name, value in (DRIVE_CONDITIONS | SECOND | conditions).items()}
    times = np.arange(samples) * STEP
    signal = Signals(*map(jnp.asarray, excitation.motion(times)))
    return Experiment(jnp.asarray(times), jnp.int32(samples), known, {"drive": signal})


def pendulum(
    samples: int = 1601, frequency: float = 3.0, amplitude: float = 0.02, step: float = STEP, **conditions: float
) -> Experiment:
    """A pendulum whose drive sets in with the first sample."""
    known = {name: jnp.asarray(float(value)) for name, value in (PENDULUM_CONDITIONS | SECOND | conditions).items()}
    times, omega = np.arange(samples) * step, 2.0 * np.pi * frequency
    signal = Signals(*map(jnp.asarray, (amplitude * np.sin(omega * times), amplitude * omega * np.cos(omega * times))))
    return Experiment(jnp.asarray(times), jnp.int32(samples), known, {"drive": signal})


def pushed(samples: int = 801, frequency: float = 3.0, amplitude: float = 30.0) -> Experiment:
    """A mass on a guide that a force drives to and fro, at rest with the first sample; followed as a whole."""
    times, omega = np.arange(samples) * STEP, 2.0 * np.pi * frequency
    force = Signals(*map(jnp.asarray, (amplitude * np.sin(omega * times), amplitude * omega * np.cos(omega * times))))
    still = Signals(jnp.zeros(samples), jnp.zeros(samples))
    known = {"gain": jnp.ones(()), "added_mass": jnp.zeros(())} | {
        name: jnp.asarray(place) for name, place in SECOND.items()
    }
    return Experiment(jnp.asarray(times), jnp.int32(samples), known, {"force": force, "anchor": still})


def swung(samples: int = 801) -> Experiment:
    """A plain pendulum that is let go with the first sample."""
    known = {"moment_of_inertia": 0.05, "mass": 0.0, "centre_distance": 0.0} | SECOND
    conditions = {name: jnp.asarray(float(value)) for name, value in known.items()}
    return Experiment(jnp.arange(samples) * 5e-3, jnp.int32(samples), conditions, {})


def kind_of(experiment: Experiment) -> str:
    """The rig whose conditions and inputs these are."""
    asked = {*experiment.conditions, *experiment.inputs} - {*SECOND, "anchor"}
    return next(kind for kind, rig in RIGS.items() if {*(c.name for c in rig.conditions), *rig.inputs} == asked)


def usual(kind: str, samples: int = 801) -> Experiment:
    """A rig under its usual conditions, each of its inputs to and fro."""
    known = {condition.name: condition.typical for condition in RIGS[kind].conditions} | SECOND
    times, omega = np.arange(samples) * STEP, 6.0 * np.pi
    course = Signals(*map(jnp.asarray, (0.02 * np.sin(omega * times), 0.02 * omega * np.cos(omega * times))))
    conditions = {name: jnp.asarray(float(value)) for name, value in known.items()}
    return Experiment(jnp.asarray(times), jnp.int32(samples), conditions, dict.fromkeys(RIGS[kind].inputs, course))


def given(values: dict[str, float]) -> dict[str, Any]:
    """Values as arrays; infinite ones by their inverse."""
    return {
        name: ByInverse(jnp.zeros(())) if math.isinf(value) else jnp.asarray(float(value))
        for name, value in values.items()
    }


def dotted(effects: tuple[type[Effect], ...], choose: str) -> dict[str, float]:
    """Null or typical values of the parameters of effects under the names they bear in a model.

    At `null`, only the strengths are zero: the others stay typical.
    """

    def value(effect: type[Effect], parameter: Parameter) -> float:
        zero = choose == "null" and parameter.name in effect.strength
        return parameter.null if zero else parameter.typical

    return {f"{effect.name}.{p.name}": value(effect, p) for effect in effects for p in effect.parameters}


@functools.cache
def _compiled(kind: str, effects: tuple[type[Effect], ...], tension_law: str, jacobian: bool) -> Any:
    model = Model(RIGS[kind], effects, tension_law)

    def channels(values: Any, experiment: Experiment) -> dict[str, jax.Array]:
        return model.respond(values, experiment).channels

    return jax.jit(jax.jacfwd(channels) if jacobian else channels)


def respond(
    experiment: Experiment, effects: tuple[type[Effect], ...] = (), tension_law: str = "clamped", **values: float
) -> dict[str, np.ndarray]:
    """Channels of a model with the values of the reference, changed as asked."""
    kind = kind_of(experiment)
    channels = _compiled(kind, effects, tension_law, False)(given(OF_RIG[kind] | values), experiment)
    return {role: np.asarray(reading) for role, reading in channels.items()}


def jacobian(
    experiment: Experiment, effects: tuple[type[Effect], ...] = (), **values: float
) -> dict[str, dict[str, np.ndarray]]:
    """Derivatives of the channels; of a parameter given by its inverse, in that."""
    kind = kind_of(experiment)
    found = _compiled(kind, effects, "clamped", True)(given(OF_RIG[kind] | values), experiment)
    return {
        role: {n: np.asarray(d.inverse if isinstance(d, ByInverse) else d) for n, d in columns.items()}
        for role, columns in found.items()
    }


def deviation(found: np.ndarray, true: np.ndarray) -> float:
    """Root mean square of the difference over the range."""
    return float(np.sqrt(np.mean((found - true) ** 2)) / np.ptp(true))
