"""A plain pendulum that is let go once: its angle alone is measured."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.core.errors import DataError
from fibrefit.laws.law import Effect, PivotLaw, laws_of
from fibrefit.rigs.parts.guide import Guide, Sliding
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Rig, Start, Starting, Stated, Values
from fibrefit.rigs.signals.rates import from_motion, period_of, rates_of
from fibrefit.rigs.signals.trace import Trace


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
    pivot : Guide
        With the friction in N m.
    """

    length: jax.Array
    inertia: jax.Array
    damping: jax.Array
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
        torque = self._torque(state.angle, jnp.zeros(()))
        return state, PendulumMode(self.pivot.settle(torque, mode.guide, crossed.guide, _turning(state)))

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


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> Pendulum:
    """System of one record; its inertia is that stated where mass and distance, with the length, do not give it."""
    known = conditions["mass"] * conditions["centre_distance"]
    inertia = jnp.where(known > 0.0, known * values["length"], conditions["moment_of_inertia"])
    pivot = Guide(values["friction"])
    return Pendulum(values["length"], inertia, values["damping"], pivot, laws_of(PivotLaw, laws))


SMOOTH = 0.15
"""Share of a period over which the angle is taken for a parabola."""
SLOW = 0.1
"""Share of the largest rate below which the direction of turning is not believed."""
PERIODS = 1.5
"""Length of the first horizon."""
LATE = 1.0 / 3.0
"""Share of a record, at its end, whose middle is where the pendulum hangs."""


def _starting(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Length, damping and friction by least squares; the zero from the end of each record, the start from its begin."""
    found = zip(*map(_swing, traces), strict=True)
    lengths, dampings, frictions, periods, zero, angle, rate = (np.array(values) for values in found)
    length, damping, friction = (float(np.median(values)) for values in (lengths, dampings, frictions))
    inertias = []
    for trace in traces:
        known = trace.conditions["mass"] * trace.conditions["centre_distance"]
        inertias.append(known * length if known > 0.0 else trace.conditions["moment_of_inertia"])
    inertia = float(np.median(inertias))
    begin, end = (np.array([trace.times[i] for trace in traces]) for i in (0, -1))
    return Starting(
        shared={"length": length, "damping": damping * inertia, "friction": friction * inertia},
        each={"angle_zero": zero, "start_angle": angle, "start_rate": rate},
        moving=begin,
        settled=np.minimum(begin + PERIODS * periods, end),
        spread={"length": 1.1, "damping": 3.0, "friction": 3.0},
        horizons=((1.0, 3.0, 9.0), (2.0, 6.0, 18.0)),
    )


def _swing(trace: Trace) -> tuple[float, ...]:
    """Length, damping and friction over inertia, period, zero, first angle and rate."""
    measured, times = trace.channels["angle"], trace.times
    seen = np.isfinite(measured)
    whole = np.interp(times, times[seen], measured[seen])
    period = period_of(whole, times)
    if not np.isfinite(period):
        do = "Record at least two swings, and check the column and unit of the angle."
        raise DataError(trace.name, "the angle does not swing", "a pendulum that is let go", do)
    late = whole[-max(round(LATE * len(whole)), 2) :]
    zero = 0.5 * float(np.quantile(late, 0.02) + np.quantile(late, 0.98))
    angle, rate, second = rates_of(whole - zero, times, SMOOTH * period)
    turning = np.abs(rate) > SLOW * np.abs(rate).max()
    columns = np.column_stack([-np.sin(angle), -rate, -np.sign(rate)])[turning]
    (pull, damping, friction), *_ = np.linalg.lstsq(columns, second[turning], rcond=None)
    if not pull > 0.0:
        pull = (2.0 * np.pi / period) ** 2
    # At once nothing and far too much lose the swing; a share of what damps it at all keeps it.
    floor = 1e-3 * np.sqrt(pull)
    length, damping = STANDARD_GRAVITY / float(pull), max(float(damping), floor)
    friction = max(float(friction), 0.1 * floor * float(np.abs(rate).max()))
    return length, damping, friction, period, zero, float(angle[0]), float(rate[0])


PENDULUM = Rig(
    kind="pendulum",
    parameters=(
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
    ),
    nuisances=(
        Parameter("angle_zero", "rad", "reading of the angle where the pendulum hangs down", 0.01),
        Parameter("start_angle", "rad", "angle from hanging down at the first sample", 0.3),
        Parameter("start_rate", "rad/s", "its rate at the first sample", 0.1),
    ),
    conditions=(
        Parameter("moment_of_inertia", "kg m^2", "moment of inertia about the pivot", 1.0, lower=0.0),
        Parameter("mass", "kg", "mass of the pendulum", 0.0, lower=0.0),
        Parameter("centre_distance", "m", "distance of the centre of mass from the pivot", 0.0, lower=0.0),
    ),
    capabilities=frozenset({Capability.PIVOT}),
    channels=("angle",),
    inputs=(),
    build=_build,
    # It is somewhere, and swings by itself.
    start=lambda system, values, conditions, _: Start(*system.begin(values["start_angle"], values["start_rate"])),
    observe=lambda system, state, mode, inputs: {"angle": state.angle},
    starting=_starting,
    planned=None,
    prepared=partial(from_motion, channel="angle"),
)
