"""A plain pendulum that is let go once: its angle alone is measured."""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.capability import Capability
from fibrefit.core.parameter import Parameter
from fibrefit.effects.law import Effect, PivotLaw, laws_of
from fibrefit.rigs.guide import Guide, Sliding
from fibrefit.rigs.rig import STANDARD_GRAVITY, Rig, Start, Values


class PendulumState(NamedTuple):
    """Angle [rad] from hanging down, and its rate [rad/s]."""

    angle: jax.Array
    rate: jax.Array


class PendulumMode(NamedTuple):
    """Mode of the pivot, as that of a guide: direction of turning, or at rest."""

    guide: jax.Array


class Pendulum(eqx.Module):
    """A pendulum on a pivot that rubs.

    Law
    ---
    ``I φ'' = -I (g / L) sin φ - c φ' - Σ torque - F sign φ'``; at rest while the weight's torque is no larger than F.

    Parameters
    ----------
    length : () in m
        L, equivalent length: moment of inertia over mass and distance of the centre of mass.
    inertia : () in kg m^2
    damping : () in N m s
    zero : () in rad
        Reading of the angle where the pendulum hangs down.
    pivot : Guide
        With the friction in N m.
    laws : tuple of PivotLaw
    """

    length: jax.Array
    inertia: jax.Array
    damping: jax.Array
    zero: jax.Array
    pivot: Guide
    laws: tuple[PivotLaw, ...] = ()

    def stiff(self) -> None:
        """Nothing is fast."""

    def derivative(self, state: PendulumState, mode: PendulumMode, inputs: Any) -> PendulumState:
        """Rate of the state."""
        now = _turning(state)
        torque = self.pivot.net_force(self._torque(state.angle, state.rate), mode.guide, now)
        return PendulumState(self.pivot.speed(mode.guide, state.rate), torque / self.inertia)

    def margins(self, state: PendulumState, mode: PendulumMode, inputs: Any) -> PendulumMode:
        """Margins of each mode."""
        torque = self._torque(state.angle, state.rate)
        return PendulumMode(self.pivot.margin(torque, mode.guide, _turning(state)))

    def switch(
        self, state: PendulumState, mode: PendulumMode, crossed: PendulumMode, inputs: Any
    ) -> tuple[PendulumState, PendulumMode]:
        """State and mode after the switches `crossed`."""
        state = state._replace(rate=self.pivot.stop(mode.guide, crossed.guide, state.rate))
        settled = self.pivot.settle(
            self._torque(state.angle, jnp.zeros(())), mode.guide, crossed.guide, _turning(state)
        )
        return state, PendulumMode(settled)

    def begin(self, angle: jax.Array, rate: jax.Array) -> tuple[PendulumState, PendulumMode]:
        """State and mode of a pendulum at `angle` [rad] that turns with `rate` [rad/s]."""
        state = PendulumState(angle, rate)
        still = self.pivot.settle(self._torque(angle, jnp.zeros(())), jnp.int32(0), jnp.array(True), _turning(state))
        return state, PendulumMode(jnp.where(rate == 0.0, still, jnp.sign(rate).astype(jnp.int32)))

    def _torque(self, angle: jax.Array, rate: jax.Array) -> jax.Array:
        """Torque besides that of the Coulomb friction, in N m."""
        weight = self.inertia * STANDARD_GRAVITY / self.length * jnp.sin(angle)
        resisting = self.damping * rate
        for law in self.laws:
            resisting = resisting + law.torque(angle, rate)
        return -weight - resisting


def _turning(state: PendulumState) -> Sliding:
    return Sliding(state.angle, state.rate, jnp.zeros(()))


PARAMETERS = (
    Parameter(
        "length",
        "m",
        "equivalent length: inertia over mass and distance of its centre",
        0.5,
        lower=1e-3,
        upper=1e3,
        log=True,
    ),
    Parameter("damping", "N m s", "viscous damping of the pivot", 1e-3, lower=0.0, upper=1e6),
    Parameter("friction", "N m", "Coulomb friction of the pivot", 1e-3, lower=0.0, upper=1e6),
)
NUISANCES = (
    Parameter("angle_zero", "rad", "reading of the angle where the pendulum hangs down", 0.01),
    Parameter("start_angle", "rad", "angle from hanging down at the first sample", 0.3),
    Parameter("start_rate", "rad/s", "its rate at the first sample", 0.1),
)
CONDITIONS = (
    Parameter("moment_of_inertia", "kg m^2", "moment of inertia about the pivot", 1.0, lower=0.0),
    Parameter("mass", "kg", "mass of the pendulum", 0.0, lower=0.0),
    Parameter("centre_distance", "m", "distance of the centre of mass from the pivot", 0.0, lower=0.0),
)


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> Pendulum:
    """System of one record; its inertia is that stated, or follows from mass, distance and length."""
    known = conditions["mass"] * conditions["centre_distance"]
    inertia = jnp.where(known > 0.0, known * values["length"], conditions["moment_of_inertia"])
    pivot = Guide(values["friction"])
    length, damping, zero = (values[name] for name in ("length", "damping", "angle_zero"))
    return Pendulum(length, inertia, damping, zero, pivot, laws_of(PivotLaw, laws))


def _start(system: Pendulum, values: Values, conditions: Values, inputs: Any) -> Start:
    """The pendulum is somewhere, and swings by itself."""
    return Start(*system.begin(values["start_angle"], values["start_rate"]))


def _observe(system: Pendulum, state: PendulumState, mode: PendulumMode, inputs: Any) -> dict[str, jax.Array]:
    """Angle in rad."""
    return {"angle": state.angle + system.zero}


PENDULUM = Rig(
    kind="pendulum",
    parameters=PARAMETERS,
    nuisances=NUISANCES,
    conditions=CONDITIONS,
    capabilities=frozenset({Capability.PIVOT}),
    channels=("angle",),
    inputs=(),
    build=_build,
    start=_start,
    observe=_observe,
    released="angle",
)
