"""A mass on a guide, driven by a measured force, let go once, or along a measured motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.core.errors import DataError
from fibrefit.laws.law import Effect, GuideLaw, fast, laws_of
from fibrefit.rigs.parts.guide import CREEPING, Guide, Sliding, band_after, band_margin, first_band
from fibrefit.rigs.rig import Initial, Rig, Start, Starting, Stated, Values
from fibrefit.rigs.signals.rates import along_motion, derivative, from_motion, period_of, rates_of, with_place
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import FEWEST_SLIDING, PROVEN


class GuidedMassState(NamedTuple):
    """Position [m] and velocity [m/s] of the mass; force [N] of the guide's bristles where the model has them."""

    position: jax.Array
    velocity: jax.Array
    bristle: jax.Array | None


class GuidedMassMode(NamedTuple):
    """Mode of the guide; band of speed, None in a model without one."""

    guide: jax.Array
    band: Any


class GuidedMass(eqx.Module):
    """Mass and guide as a switched system.

    Law
    ---
    ``M v' = gain F(t) - offset - guide``.

    Parameters
    ----------
    mass : () in kg
    gain : () a pure number
        Force on the mass per measured force.
    offset : () in N
        Constant force against the + direction.
    """

    mass: jax.Array
    gain: jax.Array
    offset: jax.Array
    guide: Guide

    def stiff(self) -> jax.Array | None:
        """Whether friction that sets in over a short distance is there now."""
        return fast(self.guide.laws)

    def derivative(self, state: GuidedMassState, mode: GuidedMassMode, inputs: Any) -> GuidedMassState:
        """Rate of the state."""
        now, drive = self._sliding(state, inputs)
        return GuidedMassState(
            self.guide.speed(mode.guide, state.velocity),
            self.guide.net_force(drive, mode.guide, now) / self.mass,
            self.guide.bristle_rate(mode.guide, now),
        )

    def margins(self, state: GuidedMassState, mode: GuidedMassMode, inputs: Any) -> GuidedMassMode:
        """Margins of each mode."""
        now, drive = self._sliding(state, inputs)
        band = band_margin(self.guide.laws, mode.band, state.velocity)
        return GuidedMassMode(self.guide.margin(drive, mode.guide, now), band)

    def switch(
        self, state: GuidedMassState, mode: GuidedMassMode, crossed: GuidedMassMode, inputs: Any
    ) -> tuple[GuidedMassState, GuidedMassMode]:
        """State and mode after the switches `crossed`."""
        velocity = self.guide.stop(mode.guide, crossed.guide, state.velocity)
        state = state._replace(velocity=velocity)
        mode = mode._replace(band=band_after(self.guide.laws, mode.band, velocity, crossed.band))
        now, drive = self._sliding(state, inputs)
        return state, mode._replace(guide=self.guide.settle(drive, mode.guide, crossed.guide, now))

    def begin(self, position: jax.Array, velocity: jax.Array, inputs: Any) -> tuple[GuidedMassState, GuidedMassMode]:
        """State and mode of a mass at `position` [m] that moves with `velocity` [m/s]."""
        state = GuidedMassState(position, velocity, None)
        now, drive = self._sliding(state, inputs)
        resting = self.guide.bristle_at_rest(drive, now)
        if resting is not None:
            # Bristles under a mass that has slid for long are bent as far as they go.
            bent = jnp.sign(velocity) * self.guide.level(jnp.sign(velocity), velocity, now)
            state = state._replace(bristle=jnp.where(velocity == 0.0, resting, bent))
            now, drive = self._sliding(state, inputs)
        direction = jnp.sign(velocity).astype(jnp.int32)
        laws = self.guide.laws
        band = band_after(laws, first_band(laws), velocity, jnp.array(True))
        still = self.guide.settle(drive, jnp.int32(0), jnp.array(True), now)
        moving = jnp.where(jnp.abs(still) == CREEPING, CREEPING * direction, direction)
        return state, GuidedMassMode(jnp.where(velocity == 0.0, still, moving), band)

    def _sliding(self, state: GuidedMassState, inputs: Any) -> tuple[Sliding, jax.Array]:
        """What the guide feels, and the force on the mass besides the guide's, in N."""
        now = _now(state)
        pushed = self.gain * inputs["force"][0] if "force" in inputs else 0.0
        return now, pushed - self.offset


class FollowedMode(NamedTuple):
    """Nothing switches where the motion is known: its direction is that of the measured speed."""

    none: jax.Array


class FollowedMass(eqx.Module):
    """Mass and guide along a measured motion.

    Law
    ---
    ``gain F = M v' + offset + guide(u, v)`` (inverse dynamics).

    Parameters
    ----------
    moved : GuidedMass
        The mass and its guide, with what drives it left out.
    """

    moved: GuidedMass

    def stiff(self) -> jax.Array | None:
        """As the mass that is driven."""
        return self.moved.stiff()

    def derivative(self, state: GuidedMassState, mode: FollowedMode, inputs: Any) -> GuidedMassState:
        """Rate of the measured motion, and of the guide's bristles along it."""
        sliding = self._direction(state.velocity)
        return GuidedMassState(
            inputs["position"][1], inputs["speed"][1], self.moved.guide.bristle_rate(sliding, _now(state))
        )

    def margins(self, state: GuidedMassState, mode: FollowedMode, inputs: Any) -> FollowedMode:
        """Nothing to cross."""
        return FollowedMode(jnp.ones(()))

    def switch(
        self, state: GuidedMassState, mode: FollowedMode, crossed: FollowedMode, inputs: Any
    ) -> tuple[GuidedMassState, FollowedMode]:
        """Nothing changes."""
        return state, mode

    def begin(self, inputs: Any) -> tuple[GuidedMassState, FollowedMode]:
        """State and mode at the first sample."""
        bristle = jnp.zeros(()) if self.moved.guide.may_creep else None
        return GuidedMassState(inputs["position"][0], inputs["speed"][0], bristle), FollowedMode(jnp.int32(0))

    def force(self, state: GuidedMassState, inputs: Any) -> jax.Array:
        """Force that was to be measured, in N."""
        # What `net_force` leaves of no drive is the guide's own force.
        held = self.moved.guide.net_force(jnp.zeros(()), self._direction(state.velocity), _now(state))
        return (self.moved.mass * inputs["speed"][1] + self.moved.offset - held) / self.moved.gain

    def _direction(self, velocity: jax.Array) -> jax.Array:
        return self.moved.guide.sliding(jnp.sign(velocity).astype(jnp.int32))


def _now(state: GuidedMassState) -> Sliding:
    return Sliding(state.position, state.velocity, jnp.zeros(()), state.bristle)


ADDED = Parameter("added_mass", "kg", "mass added to the moving one", 0.0, lower=0.0)
SMOOTH = 0.03
"""Length in s of the stretches over which position is taken for a parabola."""
FREE_SMOOTH = 0.15
"""The same for a free decay, as a share of its period."""
PERIODS = 1.5
"""Length of the first horizon of a free decay, in periods."""
VISCOUS = "guide.viscous_friction.viscous_coefficient"
SPRING, ZERO = "guide.spring.spring_stiffness", "guide.spring.spring_zero"
SLOW = 0.05
"""Share of the largest speed below which the direction of motion is not believed."""


def _starting(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Mass, frictions, spring and offset by least squares wherever the mass moves; what is stated as it is."""
    free = not traces[0].inputs
    parts = [_terms(trace, SPRING in initial, free) for trace in traces]
    terms = {name: np.concatenate([part[name] for part, _ in parts]) for name in parts[0][0]}
    found = _solved(terms, np.concatenate([force for _, force in parts]), initial, traces[0].name)
    shared = {name: found[name] for name in ("mass", "force_offset")}
    shared |= {name: max(found[name], 1e-2) for name in ("friction", VISCOUS)}
    if SPRING in found:
        stiffness = max(found[SPRING], 1e-3 * shared["mass"])
        shared |= {SPRING: stiffness, ZERO: -found["force_offset"] / stiffness, "force_offset": 0.0}
    begin, settled = (np.array([trace.times[i] for trace in traces]) for i in (0, -1))
    each = {}
    if free:
        begun = [rates_of(trace.channels["position"], trace.times, _length(trace)) for trace in traces]
        each = {"start_position": np.array([position[0] for position, _, _ in begun])}
        each |= {"start_speed": np.array([speed[0] for _, speed, _ in begun])}
        horizon = np.array([PERIODS * _length(trace) / FREE_SMOOTH for trace in traces])
        settled = np.minimum(begin + horizon, settled)
    return Starting(
        shared=shared,
        each=each,
        moving=begin,
        settled=settled,
        spread=dict.fromkeys(("mass", "friction", "force_offset", VISCOUS), 1.5) | {SPRING: 1.2, ZERO: 1.5},
        # Windows do not get longer: there is nothing to be learnt from a part of them first.
        horizons=((1.0, 3.0, 9.0), (2.0, 6.0, 18.0)) if free else ((),),
    )


def _length(trace: Trace) -> float:
    """Length in s over which the position of a free decay is smoothed."""
    values = trace.channels["position"]
    seen = np.isfinite(values)
    period = period_of(np.interp(trace.times, trace.times[seen], values[seen]), trace.times)
    return FREE_SMOOTH * (period if np.isfinite(period) else float(np.ptp(trace.times)))


def _terms(trace: Trace, spring: bool, free: bool) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Where a mass moves, terms of the force by the parameter that multiplies each, ``(n_moving,)``; and the force."""
    times, inputs, channels = trace.times, trace.inputs, trace.channels
    if "speed" in inputs:
        position, (speed, acceleration) = inputs["position"][:, 0], inputs["speed"][:, :2].T
    elif "velocity" in channels:
        speed, acceleration = (derivative(channels["velocity"], times, SMOOTH, order) for order in (0, 1))
        position = inputs["position"][:, 0]
    elif "anchor" in inputs:
        position, speed, acceleration = rates_of(inputs["anchor"][:, 0], times, SMOOTH)
    else:
        position, speed, acceleration = rates_of(channels["position"], times, _length(trace))
    moving = np.abs(speed) > SLOW * np.nanmax(np.abs(speed))
    if moving.sum() < FEWEST_SLIDING:
        raise DataError(trace.name, "the mass hardly moves", "a position that changes", "Check its column and unit.")
    terms = {"mass": acceleration, "friction": np.sign(speed), VISCOUS: speed}
    terms |= ({SPRING: position} if spring else {}) | {"force_offset": np.ones_like(speed)}
    force = np.zeros_like(speed)
    if not free:
        measured = inputs["force"][:, 0] if "force" in inputs else channels["force"]
        force = trace.conditions["gain"] * measured
        moving = moving & np.isfinite(force)
    force = force - trace.conditions["added_mass"] * acceleration
    return {name: term[moving] for name, term in terms.items()}, force[moving]


def _solved(terms: Mapping[str, np.ndarray], force: np.ndarray, initial: Initial, where: str) -> dict[str, float]:
    """Values of all terms; those that are stated as they are."""
    known = {name: value for name in terms if (value := initial.get(name)) is not None}
    if ZERO in initial and SPRING in known and initial[ZERO] is not None:
        known["force_offset"] = -known[SPRING] * float(initial[ZERO] or 0.0)
    force = force - sum((value * terms[name] for name, value in known.items()), np.zeros_like(force))
    sought = [name for name in terms if name not in known]
    columns = np.column_stack([terms[name] for name in sought]) if sought else np.zeros((len(force), 0))
    size = np.linalg.norm(columns, axis=0)
    values = np.linalg.lstsq(columns / np.where(size > 0.0, size, 1.0), force, rcond=1e-8)[0]
    found = known | dict(zip(sought, (values / np.where(size > 0.0, size, 1.0)).tolist(), strict=True))
    if not found["mass"] > 0.0:
        # The share of what the other columns leave of the force that the acceleration explains.
        place = sought.index("mass")
        others = np.delete(columns, place, axis=1)
        residual, own = (
            one - others @ np.linalg.lstsq(others, one, rcond=None)[0] for one in (force, columns[:, place])
        )
        explained = float((own @ residual) ** 2 / max((own @ own) * (residual @ residual), 1e-300))
        if explained > PROVEN:
            raise DataError(
                where,
                "the force does not go with the acceleration",
                "a force that is positive where the position speeds up",
                "Check the sign and unit of the force and position channels; a negative scale of a channel turns it.",
            )
        # The motion is too slow, or too regular, to tell: a mass that hardly matters beside the other terms.
        found["mass"] = 0.1 * float(np.std(force) / max(np.std(terms["mass"]), 1e-12)) or 1.0
    return found


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> GuidedMass:
    """System of one record."""
    guide = Guide(values["friction"], laws_of(GuideLaw, laws))
    mass = values["mass"] + conditions["added_mass"]
    return GuidedMass(mass, conditions.get("gain", jnp.ones(())), values["force_offset"], guide)


def _start_at_speed(system: GuidedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The mass is as fast as it was measured at the first sample, where the measured speed has taken it."""
    return Start(*system.begin(inputs["position"][0], inputs["anchor"][0], inputs))


_DRIVEN = Rig(
    kind="guided_mass",
    parameters=(
        Parameter("mass", "kg", "moving mass", 50.0, lower=1e-3, upper=1e6, log=True),
        Parameter("friction", "N", "Coulomb friction of the guide", 10.0, lower=0.0, upper=1e5),
        Parameter("force_offset", "N", "constant force against the direction in which the position grows", 1.0),
    ),
    nuisances=(),
    conditions=(Parameter("gain", "-", "force on the mass per measured force", 1.0, lower=0.0), ADDED),
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH, Capability.PLACE}),
    channels=("position",),
    inputs=("force",),
    build=_build,
    # The mass is where it was measured at the first sample, and as fast.
    start=lambda system, values, conditions, inputs: Start(*system.begin(*inputs["anchor"], inputs)),
    observe=lambda system, state, mode, inputs: {"position": state.position},
    starting=_starting,
    planned=None,
    anchor="position",
)

BY_VELOCITY = replace(
    _DRIVEN,
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH}),
    channels=("velocity",),
    inputs=("force", "position"),
    derived=("position",),
    start=_start_at_speed,
    observe=lambda system, state, mode, inputs: {"velocity": state.velocity},
    anchor="velocity",
    prepared=with_place,
)
"""The same where the velocity was measured: a place is known as far as that velocity leads to it from zero."""

FREE_MASS = replace(
    _DRIVEN,
    nuisances=(
        Parameter("start_position", "m", "position at the first sample", 0.01),
        Parameter("start_speed", "m/s", "speed at the first sample", 0.1),
    ),
    conditions=(ADDED,),
    capabilities=frozenset({Capability.GUIDE, Capability.PLACE}),
    inputs=(),
    # It is somewhere, and moves by itself.
    start=lambda system, values, _, inputs: Start(
        *system.begin(values["start_position"], values["start_speed"], inputs)
    ),
    anchor=None,
    prepared=partial(from_motion, channel="position"),
    per_unit_of="mass",
)
"""The same where nothing drives it: followed from its start to its end."""

FOLLOWED_MASS = replace(
    _DRIVEN,
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH}),
    channels=("force",),
    inputs=("position", "speed"),
    build=lambda values, conditions, laws, tension_law: FollowedMass(_build(values, conditions, laws, tension_law)),
    start=lambda system, values, conditions, inputs: Start(*system.begin(inputs)),
    observe=lambda system, state, mode, inputs: {"force": system.force(state, inputs)},
    anchor=None,
    derived=("speed",),
    prepared=along_motion,
)
"""The same where the motion was measured: the force that it asks for is what is explained (inverse dynamics)."""

FOLLOWED_BY_VELOCITY = replace(FOLLOWED_MASS, inputs=("velocity", "position", "speed"), derived=("position", "speed"))
"""The same along a measured velocity."""

GUIDED_MASS = replace(
    _DRIVEN,
    variants={
        "free": FREE_MASS,
        "followed": FOLLOWED_MASS,
        "by_velocity": BY_VELOCITY,
        "followed_by_velocity": FOLLOWED_BY_VELOCITY,
    },
)
