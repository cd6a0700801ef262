"""Free-form probes: a force, friction, tension, damping or error of a gauge as an unknown curve of a state of the rig.

A probe has no name to offer, only a place and a variable. It shows what any effect of that kind could at best explain,
and so tells a wrong name that merely helps from a missing one.
"""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import (
    ALWAYS_LEFT,
    Channels,
    Effect,
    FibreLaw,
    GuideLaw,
    Memory,
    Moment,
    SensorLaw,
    of_force,
    quantity,
)

KNOTS, FINE_KNOTS = 10, 80
"""Knots of a curve; of one over the position, where a guide may repeat itself every few millimetres."""


class Curve(Effect):
    """A piecewise linear curve with knots at equal distances between `low` and `high`, level beyond them.

    Attributes
    ----------
    variable, says : str
        What it depends on, and what it is in words.
    knots : int
    heights : tuple of str
        Names of the heights at the knots.
    unit : str
        SI unit of the heights.
    size : float
        By how much neighbouring heights usually differ, in that unit.
    """

    low: jax.Array = quantity("-", "left end of the curve", 0.0)
    high: jax.Array = quantity("-", "right end of the curve", 1.0)

    variable: ClassVar[str] = ""
    says: ClassVar[str] = ""
    knots: ClassVar[int] = KNOTS
    heights: ClassVar[tuple[str, ...]] = ()
    unit: ClassVar[str] = "N"
    size: ClassVar[float] = 1.0

    def __init_subclass__(cls, **keywords: Any) -> None:
        cls.heights = tuple(f"c{i}" for i in range(cls.knots))
        for i, name in enumerate(cls.heights):
            cls.__annotations__[name] = jax.Array
            setattr(cls, name, quantity(cls.unit, f"height at knot {i}", cls.size))
        super().__init_subclass__(**keywords)

    def at(self, x: jax.Array) -> jax.Array:
        """Height of the curve at `x`."""
        heights = jnp.stack([jnp.asarray(getattr(self, name)) for name in self.heights])
        place = jnp.clip((x - self.low) / (self.high - self.low), 0.0, 1.0) * (self.knots - 1)
        left = jnp.clip(place.astype(jnp.int32), 0, self.knots - 2)
        return heights[left] + (place - left) * (heights[left + 1] - heights[left])


class ForceOfPosition(Curve, GuideLaw):
    """A force on the weight that depends on its position."""

    name: ClassVar[str] = "probe.force_of_position"
    knots: ClassVar[int] = FINE_KNOTS
    variable: ClassVar[str] = "position"
    says: ClassVar[str] = "a force on the weight that depends on its position"

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """Height of the curve."""
        return self.at(position)


class FrictionOfPosition(Curve, GuideLaw):
    """A friction of the guide that depends on the position."""

    name: ClassVar[str] = "probe.friction_of_position"
    knots: ClassVar[int] = FINE_KNOTS
    variable: ClassVar[str] = "position"
    says: ClassVar[str] = "a friction in the guide that depends on the position of the weight"

    def roughness(self, position: jax.Array) -> jax.Array:
        """Height of the curve."""
        return self.at(position)


class FrictionOfSpeed(Curve, GuideLaw):
    """A friction of the guide that depends on the speed."""

    name: ClassVar[str] = "probe.friction_of_speed"
    variable: ClassVar[str] = "speed"
    says: ClassVar[str] = "a friction in the guide that depends on the speed of the weight"

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Height of the curve at the speed without its sign."""
        return self.at(jnp.abs(velocity))


class FrictionOfTension(Curve, GuideLaw):
    """A friction of the guide that depends on the tension."""

    name: ClassVar[str] = "probe.friction_of_tension"
    variable: ClassVar[str] = "tension"
    says: ClassVar[str] = "a friction in the guide that depends on the tension of the fibre"

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Height of the curve at the tension."""
        return self.at(tension)


class TensionOfStretch(Curve, FibreLaw):
    """A tension that depends on the stretch in a way of its own."""

    name: ClassVar[str] = "probe.tension_of_stretch"
    variable: ClassVar[str] = "stretch"
    says: ClassVar[str] = "a tension of the fibre that depends on its stretch"

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """Height of the curve at the stretch."""
        return self.at(stretch)


class TensionOfRate(Curve, FibreLaw):
    """A tension that depends on the rate of stretch in a way of its own."""

    name: ClassVar[str] = "probe.tension_of_rate"
    variable: ClassVar[str] = "stretch rate"
    says: ClassVar[str] = "a tension of the fibre that depends on its rate of stretch"

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """Height of the curve at the rate."""
        return self.at(rate)


class DampingOfStretch(Curve, FibreLaw):
    """A damping of the fibre that depends on the stretch in a way of its own."""

    name: ClassVar[str] = "probe.damping_of_stretch"
    variable: ClassVar[str] = "stretch"
    says: ClassVar[str] = "a damping of the fibre that depends on its stretch"
    unit: ClassVar[str] = "-"
    size: ClassVar[float] = 0.3

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """One and the height of the curve at the stretch."""
        return jnp.maximum(1.0 + self.at(stretch), ALWAYS_LEFT)


class ForceErrorOfForce(Curve, SensorLaw):
    """A force gauge that is not linear."""

    name: ClassVar[str] = "probe.force_error_of_force"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    variable: ClassVar[str] = "force"
    says: ClassVar[str] = "an error of the force gauge that depends on the force"

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """Force and the height of the curve there."""
        return of_force(channels, lambda force: force + self.at(force))


class PositionErrorOfPosition(Curve, SensorLaw):
    """A displacement gauge that is not linear."""

    name: ClassVar[str] = "probe.position_error_of_position"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PLACE})
    variable: ClassVar[str] = "position"
    says: ClassVar[str] = "an error of the displacement gauge that depends on the position"
    unit: ClassVar[str] = "m"
    size: ClassVar[float] = 1e-4

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """Position and the height of the curve there."""
        return channels | {"position": channels["position"] + self.at(channels["position"])}


class CurveOverCourse(Curve):
    """A curve over the course of a record: over the time in it, or over what has come together in its motion.

    The first of the heights is the height of the curve at a moment.

    Attributes
    ----------
    over : str
        What it depends on, of a `Moment`.
    """

    timed: ClassVar[bool] = True
    over: ClassVar[str] = "time"

    def as_of(self, moment: Moment) -> Self:
        """The height of the curve by then."""
        height = self.at(getattr(moment, self.over))
        return dataclasses.replace(self, **{self.heights[0]: height})

    @property
    def now(self) -> jax.Array:
        """That height."""
        return getattr(self, self.heights[0])


class FrictionOfTime(CurveOverCourse, GuideLaw):
    """A friction of the guide that changes while a record lasts."""

    name: ClassVar[str] = "probe.friction_of_time"
    variable: ClassVar[str] = "time"
    says: ClassVar[str] = "a friction in the guide that changes with the time in a record"

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Height of the curve."""
        return self.now


class FrictionOfPath(FrictionOfTime):
    """A friction of the guide that changes with the path travelled."""

    name: ClassVar[str] = "probe.friction_of_path"
    history: ClassVar[tuple[str, ...]] = ("path",)
    over: ClassVar[str] = "path"
    variable: ClassVar[str] = "path"
    says: ClassVar[str] = "a friction in the guide that changes with the path that the weight has travelled"


class FrictionOfRest(FrictionOfTime):
    """A friction of the guide that changes with how long the weight has been at rest."""

    name: ClassVar[str] = "probe.friction_of_rest"
    history: ClassVar[tuple[str, ...]] = ("rest",)
    over: ClassVar[str] = "rest"
    variable: ClassVar[str] = "time at rest"
    says: ClassVar[str] = "a friction in the guide that changes with the time for which the weight has been at rest"


class StiffnessOfTime(CurveOverCourse, FibreLaw):
    """A stiffness of the fibre that changes while a record lasts."""

    name: ClassVar[str] = "probe.stiffness_of_time"
    variable: ClassVar[str] = "time"
    says: ClassVar[str] = "a stiffness of the fibre that changes with the time in a record"
    unit: ClassVar[str] = "-"
    size: ClassVar[float] = 0.03

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """One and the height of the curve."""
        return jnp.maximum(1.0 + self.now, ALWAYS_LEFT)


class DampingOfTime(CurveOverCourse, FibreLaw):
    """A damping of the fibre that changes while a record lasts."""

    name: ClassVar[str] = "probe.damping_of_time"
    variable: ClassVar[str] = "time"
    says: ClassVar[str] = "a damping of the fibre that changes with the time in a record"
    unit: ClassVar[str] = "-"
    size: ClassVar[float] = 0.3

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """One and the height of the curve."""
        return jnp.maximum(1.0 + self.now, ALWAYS_LEFT)


class StiffnessOfCycles(StiffnessOfTime):
    """A stiffness of the fibre that changes with its load cycles."""

    name: ClassVar[str] = "probe.stiffness_of_cycles"
    history: ClassVar[tuple[str, ...]] = ("cycles",)
    over: ClassVar[str] = "cycles"
    variable: ClassVar[str] = "load cycles"
    says: ClassVar[str] = "a stiffness of the fibre that changes with its load cycles"


class DampingOfCycles(DampingOfTime):
    """A damping of the fibre that changes with its load cycles."""

    name: ClassVar[str] = "probe.damping_of_cycles"
    history: ClassVar[tuple[str, ...]] = ("cycles",)
    over: ClassVar[str] = "cycles"
    variable: ClassVar[str] = "load cycles"
    says: ClassVar[str] = "a damping of the fibre that changes with its load cycles"


class StiffnessOfDriveSpeed(StiffnessOfTime):
    """A stiffness of the fibre that depends on how fast its drive moves."""

    name: ClassVar[str] = "probe.stiffness_of_drive_speed"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.DRIVE})
    over: ClassVar[str] = "drive_speed"
    variable: ClassVar[str] = "drive speed"
    says: ClassVar[str] = "a stiffness of the fibre that depends on the speed of the drive"


class DampingOfDriveSpeed(DampingOfTime):
    """A damping of the fibre that depends on how fast its drive moves."""

    name: ClassVar[str] = "probe.damping_of_drive_speed"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.DRIVE})
    over: ClassVar[str] = "drive_speed"
    variable: ClassVar[str] = "drive speed"
    says: ClassVar[str] = "a damping of the fibre that depends on the speed of the drive"


PROBES: tuple[type[Curve], ...] = (
    ForceOfPosition,
    FrictionOfPosition,
    FrictionOfSpeed,
    FrictionOfTension,
    TensionOfStretch,
    TensionOfRate,
    DampingOfStretch,
    ForceErrorOfForce,
    PositionErrorOfPosition,
)
"""Curves over states of the rig."""

COURSES: tuple[type[Curve], ...] = (
    FrictionOfTime,
    FrictionOfPath,
    FrictionOfRest,
    StiffnessOfTime,
    StiffnessOfCycles,
    DampingOfTime,
    DampingOfCycles,
    StiffnessOfDriveSpeed,
    DampingOfDriveSpeed,
)
"""Curves over the course of a record. A rig with them takes longer to simulate: where it is asked whether something is
missing they are followed only where slopes predict more of them than a curve over a state gains, or no law over a state
accounts for what tests or curves object to."""
