"""A mass on a spring whose stiffness grows with its deflection, let go once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.laws.law import Effect
from fibrefit.rigs.rig import Initial, Rig, Start, Starting, Stated, Values
from fibrefit.rigs.signals.rates import from_motion, period_of, rates_of
from fibrefit.rigs.signals.trace import Trace


class SpringState(NamedTuple):
    """Position [m] and speed [m/s]."""

    position: jax.Array
    velocity: jax.Array


class SpringMode(NamedTuple):
    """Nothing switches."""

    none: jax.Array


class CubicSpring(eqx.Module):
    """Mass and spring.

    Law
    ---
    ``m v' = -k u - q u^3 - c v``.

    Parameters
    ----------
    mass : () in kg
    stiffness : () in N/m
    cubic : () in N/m^3
    damping : () in N s/m
    """

    mass: jax.Array
    stiffness: jax.Array
    cubic: jax.Array
    damping: jax.Array

    def stiff(self) -> None:
        """Nothing is fast."""

    def derivative(self, state: SpringState, mode: SpringMode, inputs: Any) -> SpringState:
        """Rate of the state."""
        u, v = state
        return SpringState(v, -(self.stiffness * u + self.cubic * u**3 + self.damping * v) / self.mass)

    def margins(self, state: SpringState, mode: SpringMode, inputs: Any) -> SpringMode:
        """Nothing to cross."""
        return SpringMode(jnp.ones(()))

    def switch(
        self, state: SpringState, mode: SpringMode, crossed: SpringMode, inputs: Any
    ) -> tuple[SpringState, SpringMode]:
        """Nothing changes."""
        return state, mode


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> CubicSpring:
    return CubicSpring(conditions["mass"], values["stiffness"], values["cubic"], values["damping"])


def _start(system: CubicSpring, values: Values, conditions: Values, inputs: Any) -> Start:
    return Start(SpringState(values["start_position"], values["start_speed"]), SpringMode(jnp.int32(0)))


def _observe(system: CubicSpring, state: SpringState, mode: SpringMode, inputs: Any) -> dict[str, jax.Array]:
    return {"position": state.position}


def _starting(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """A regression of the acceleration."""
    columns, wanted, first, periods = [], [], [], []
    for trace in traces:
        period = period_of(np.nan_to_num(trace.channels["position"]), trace.times)
        u, v, a = rates_of(trace.channels["position"], trace.times, 0.1 * period)
        columns.append(-np.column_stack([u, u**3, v]))
        wanted.append(trace.conditions["mass"] * a)
        first.append((u[0], v[0]))
        periods.append(period)
    (stiffness, cubic, damping), *_ = np.linalg.lstsq(np.concatenate(columns), np.concatenate(wanted), rcond=None)
    begin = np.array([trace.times[0] for trace in traces])
    return Starting(
        shared={"stiffness": abs(stiffness), "cubic": max(cubic, 0.0), "damping": max(damping, 1e-3)},
        each={"start_position": np.array([f[0] for f in first]), "start_speed": np.array([f[1] for f in first])},
        moving=begin,
        settled=begin + 1.5 * np.array(periods),
        spread={"stiffness": 1.2, "cubic": 2.0, "damping": 2.0},
        horizons=((1.0, 3.0, 9.0), (2.0, 6.0, 18.0)),
    )


CUBIC_SPRING = Rig(
    kind="cubic_spring",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness of the spring at rest", 100.0, lower=1e-3, upper=1e8, log=True),
        Parameter("cubic", "N/m^3", "growth of the stiffness", 1e4, lower=0.0),
        Parameter("damping", "N s/m", "viscous damping", 0.1, lower=0.0),
    ),
    nuisances=(
        Parameter("start_position", "m", "position at the first sample", 0.05),
        Parameter("start_speed", "m/s", "speed at the first sample", 0.1),
    ),
    conditions=(Parameter("mass", "kg", "moving mass", math.nan, lower=0.0),),
    capabilities=frozenset({Capability.PLACE}),
    channels=("position",),
    inputs=(),
    build=_build,
    start=_start,
    observe=_observe,
    starting=_starting,
    prepared=partial(from_motion, channel="position"),
)
