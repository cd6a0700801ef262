"""What an effect is: a small frozen pytree whose fields are the values of its declared parameters.

Each port of a rig accepts laws of one kind. A law is written for one instant and scalars; every method answers "nothing
is added" unless an effect overrides it, and at its null value it changes nothing to the last bit.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import operator
from typing import Any, ClassVar, NamedTuple, Self, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.declarations import FORCES, Capability, Parameter, inverse_of

Memory = tuple[jax.Array, ...]
Channels = dict[str, jax.Array]
INSTANTS = (0.06, 0.12, 0.18, 0.26, 0.36, 0.48, 0.62, 0.8)
"""Shares of a record at which a search looks for a sudden change; most of what happens, happens early."""
ALWAYS_LEFT = 0.02
"""Share of a stiffness or friction that is always left."""
FORGOTTEN_AFTER = 1e-3
"""m that surfaces slide until they have forgotten how long they were at rest."""
FORGETS = 5e-3
"""s in which they forget it at the least: a state that changes faster would ask for steps finer than the samples."""
CYCLE = 2.0 * math.pi**2 * 10.0 * 1e-3**2
"""m^2/s: squared rate of stretch, integrated over one cycle of 1 mm at 10 Hz."""
HISTORY_OF_MOTION = ("path", "rest", "cycles")
"""What comes together in a motion, of a `Moment`; the simulation follows what a law asks for."""


class Moment(NamedTuple):
    """When a law is evaluated.

    Parameters
    ----------
    time : () in s
        Since the first sample of the record.
    past : () a pure number
        1 where the law's own instant is over, 0 before; the share that is over of a span that holds it.
    path : () in m
        That the weight has travelled since its motion began, to and fro.
    rest : () in s
        For how long the weight has been at rest since its motion began; forgotten when it slides.
    cycles : () a pure number
        Load cycles that the fibre has borne since then, as equivalent ones of 1 mm at 10 Hz.
    drive_speed : () in m/s
        Of the drive, without its sign; 0 on a rig without one.
    """

    time: jax.Array
    past: jax.Array
    path: jax.Array
    rest: jax.Array
    cycles: jax.Array
    drive_speed: jax.Array


def resting(rest: jax.Array, speed: jax.Array) -> jax.Array:
    """Rate of the time at rest: ``d rest/dt = 1 - |v| rest / s``, s the `FORGOTTEN_AFTER`.

    Source
    ------
    Aging law of the age of contacts: Dieterich, J. Geophys. Res. 84 (1979) 2161-2168; Ruina, ibid. 88 (1983).
    """
    return 1.0 - rest * jnp.minimum(speed / FORGOTTEN_AFTER, 1.0 / FORGETS)


def loading(stretch: Any, rate: Any) -> jax.Array:
    """Rate of the load cycles, per s: ``(d stretch/dt)^2`` over what one cycle has of it, none where slack.

    A cycle of another amplitude counts by its square, one of another frequency in proportion to that.

    Source
    ------
    Linear accumulation, here with an exponent of two: Miner, J. Appl. Mech. 12 (1945) A159-A164.
    """
    return jnp.where(stretch > 0.0, rate**2, 0.0) / CYCLE


def quantity(unit: str, doc: str, typical: float, **more: Any) -> Any:
    """Field of an effect: the value of one parameter.

    Parameters
    ----------
    unit, doc, typical : str, str, float
        SI unit; one sentence that says what it is; a plausible size, which sets scales and search ranges.
    **more
        ``lower``, ``upper``; ``null``, where it vanishes (0); ``log``, ``relative`` if searched so; ``spread``, where a
        shape may well lie farther from the typical value than that is from zero; ``source``; ``symbol``.

    Examples
    --------
    >>> from fibrefit.laws.law import quantity
    >>> quantity("N", "Friction at rest.", 1.0, lower=0.0).metadata["parameter"].unit
    'N'
    """
    return eqx.field(metadata={"parameter": Parameter("", unit, doc, typical, **more)})


class Effect(eqx.Module):
    """Common to all effects.

    Attributes
    ----------
    name : str
        Name in the catalogue, ``port.effect``.
    stands_for : tuple of str
        Parameters of the rig that it holds at zero where a study does not state them: it says the same as they do.
    parameters : tuple of Parameter
        Made from the fields declared with `quantity`, in their order; ``parameter.name`` is the field's name.
    strength : tuple of str
        The parameters at whose null values the effect vanishes; the first one unless said.
    acts_on : frozenset of Capability
        What a rig must have for the effect to make sense on it.
    needs, excludes : tuple of str
        Effects that must be present too, and that must not.
    singular : float
        Where the model changes its kind at the null: share of the typical strength from which the slope there is taken.
    stiff : bool
        Whether it brings rates that are fast against the sampling, so that steps must be stiffly stable.
    speeds : tuple of float
        Speeds of the weight, in m/s, between which the law bends so sharply that a step must not run across them.
    timed : bool
        Whether it changes within a record, so that `as_of` is called.
    sudden : bool
        Whether that happens at one instant, given by its parameter `instant` as a share of the record.
    history : tuple of str
        What it depends on that comes together in a motion: "path", "rest", "cycles" of its `Moment`.
    family : {"", "in", "since"}
        Whether there is one for each record of a series, named ``port.effect@3`` after its place there, and where it
        acts: in that one, or in that one and all that follow. What acts "in" one may act in several, ``@2+4``.
    records : tuple of int
        Those places, from 1, in their order; empty where it acts in all records.
    recurs : int
        Records in each of which it happens at an instant of its own: `instant`, ``instant_2``, ...; 0 for others.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    strength: ClassVar[tuple[str, ...]] = ()
    acts_on: ClassVar[frozenset[Capability]] = frozenset()
    needs: ClassVar[tuple[str, ...]] = ()
    excludes: ClassVar[tuple[str, ...]] = ()
    stands_for: ClassVar[tuple[str, ...]] = ()
    singular: ClassVar[float] = 0.0
    stiff: ClassVar[bool] = False
    speeds: ClassVar[tuple[float, ...]] = ()
    timed: ClassVar[bool] = False
    sudden: ClassVar[bool] = False
    history: ClassVar[tuple[str, ...]] = ()
    family: ClassVar[str] = ""
    records: ClassVar[tuple[int, ...]] = ()
    recurs: ClassVar[int] = 0

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        declared = {
            name: dataclasses.replace(field.metadata["parameter"], name=name)
            for name, field in vars(cls).items()
            if isinstance(field, dataclasses.Field) and "parameter" in field.metadata
        }
        # One that is declared anew keeps its place, as it does among the fields.
        known = {parameter.name: parameter for parameter in cls.parameters}
        cls.parameters = tuple((known | declared).values())
        if cls.parameters and not cls.strength:
            cls.strength = (cls.parameters[0].name,)

    def absent(self) -> jax.Array:
        """Whether the effect is at its null value and must leave no trace."""
        zero = jnp.array(True)
        for declared in self.parameters:
            if declared.name in self.strength:
                value = getattr(self, declared.name)
                zero &= inverse_of(value) == 0.0 if declared.reciprocal else value == declared.null
        return zero

    def in_record(self, number: jax.Array, duration: jax.Array) -> Self:
        """The law as it is in the record of that `number` in the series, from 1, which lasts `duration` [s]."""
        law = self
        if self.sudden:
            law = dataclasses.replace(law, instant=law.instant * duration)  # type: ignore[attr-defined, call-arg]
        if not self.records:
            return law
        places = jnp.asarray(self.records)
        there = number >= places[0] if self.family == "since" else jnp.any(number == places)
        return law.scaled(jnp.where(there, 1.0, 0.0))

    def as_of(self, moment: Moment) -> Self:
        """The law as it is at a moment of the record it was made for."""
        return self

    def scaled(self, factor: jax.Array) -> Self:
        """The law with strengths, which vanish at 0, multiplied."""
        return dataclasses.replace(self, **{name: getattr(self, name) * factor for name in self.strength})


class FibreLaw(Effect):
    """A change of the tension of a fibre; `stretch` in m, `rate` in m/s, tensions in N.

    Attributes
    ----------
    memory : tuple of str
        Names of the states the law owns.
    forgets : bool
        Whether they jump when the fibre goes slack.
    """

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    memory: ClassVar[tuple[str, ...]] = ()
    forgets: ClassVar[bool] = False

    def initial_slack(self) -> jax.Array:
        """Stretch at which the fibre is just taut, in m."""
        return jnp.zeros(())

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """Factor on the elastic tension."""
        return jnp.ones(())

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """Factor on the viscous tension."""
        return jnp.ones(())

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """Tension added, in N."""
        return jnp.zeros(())

    def memory_at_rest(self, stretch: jax.Array) -> Memory:
        """The law's own states in a fibre that has been at rest at `stretch` for long; slack where it is negative."""
        return tuple(jnp.zeros(()) for _ in self.memory)

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Rate of the law's own states; while `slack` too, which is just what is meant where the law `forgets`."""
        return ()

    def when_slack(self, memory: Memory) -> Memory:
        """The law's own states just after the fibre has gone slack, where the law `forgets`."""
        return memory


class GuideLaw(Effect):
    """A change of the forces on the weight besides the fibre's, in N; positive opposes motion in the + direction.

    Attributes
    ----------
    creeps : bool
        Whether the weight moves before it breaks away, held by bristles.
    carries : bool
        Whether a part of the weight moves by itself.
    """

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE})
    creeps: ClassVar[bool] = False
    carries: ClassVar[bool] = False

    def loose(self) -> tuple[jax.Array, jax.Array, jax.Array]:
        """Share of the mass that hangs loosely, its own angular frequency in rad/s, and its damping ratio."""
        return jnp.zeros(()), jnp.ones(()), jnp.zeros(())

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Addition to the level of the set-valued friction that acts in `direction` (+1 or -1) of motion."""
        return jnp.zeros(())

    def roughness(self, position: jax.Array) -> jax.Array:
        """Addition to that level where the weight is at `position` [m]."""
        return jnp.zeros(())

    def viscosity(self) -> jax.Array:
        """Addition to the coefficient of viscous friction, in N s/m."""
        return jnp.zeros(())

    def viscosity_factor(self, velocity: jax.Array) -> jax.Array:
        """Factor on the sum of those coefficients."""
        return jnp.ones(())

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """Addition to the single-valued force."""
        return jnp.zeros(())

    def compliance(self) -> jax.Array:
        """Displacement of the bristles per force, in m/N."""
        return jnp.zeros(())

    def bristle_damping_coefficient(self) -> jax.Array:
        """Force of the bristles per speed of bending, in N s/m."""
        return jnp.zeros(())


class PulleyLaw(Effect):
    """A change of what the pulley does to the fibre.

    Attributes
    ----------
    turns : bool
        Whether the rim moves by itself, with tensions of its own on either side.
    rubs : bool
        Whether its bearing holds it at rest.
    """

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PULLEY})
    turns: ClassVar[bool] = False
    rubs: ClassVar[bool] = False

    def inertia(self) -> jax.Array:
        """Moment of inertia over the square of the radius, in kg."""
        return jnp.zeros(())

    def rubbing(self) -> jax.Array:
        """Friction of the bearing, as a force at the rim, in N."""
        return jnp.zeros(())

    def grip(self, wrap_angle: jax.Array, velocity: jax.Array) -> jax.Array:
        """Factor from the tension before the pulley to that on the weight, which moves with `velocity`."""
        return jnp.ones(())


class DriveLaw(Effect):
    """A change between the measured drive and the end of the fibre.

    Attributes
    ----------
    yields : bool
        Whether the end of the fibre moves by itself.
    remembers : bool
        Whether what the drive does depends on where it was before.
    """

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.DRIVE})
    yields: ClassVar[bool] = False
    remembers: ClassVar[bool] = False

    def passed_on(self, course: jax.Array, rates: jax.Array) -> tuple[jax.Array, jax.Array]:
        """What reaches the fibre of the measured course of the drive ``(n_time,)``, in m, and its rates."""
        return course, rates

    def travel(self, position: jax.Array, rate: jax.Array, radius: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Fibre taken in, in m, and its rate; `radius` of the pulley in m."""
        return position, rate

    def compliance(self) -> jax.Array:
        """Displacement of the end of the fibre per tension, in m/N."""
        return jnp.zeros(())


class PivotLaw(Effect):
    """A change of the torques on a pendulum, in N m; positive opposes turning in the + direction."""

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PIVOT})

    def torque(self, angle: jax.Array, rate: jax.Array) -> jax.Array:
        """Addition to the torque, from the angle [rad] and its rate [rad/s]."""
        return jnp.zeros(())


class RigLaw(Effect):
    """An error in what is known of a rig."""

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """Conditions as they truly were, in SI units."""
        return conditions


class StudyLaw(RigLaw):
    """An error in what a study states.

    Attributes
    ----------
    condition : str
        Key of the study that is wrong; empty where it is none.
    retimes : bool
        Whether the clock is.
    """

    condition: ClassVar[str] = ""
    retimes: ClassVar[bool] = False

    def pace(self) -> jax.Array:
        """True time over the time that the record tells."""
        return jnp.ones(())


class SensorLaw(Effect):
    """A change between what a sensor feels and what the logger writes.

    Attributes
    ----------
    dynamic : bool
        Whether `lags` or `late_by` say anything: they need the force between the samples, which costs time.
    feels : tuple of str
        What `measure` is given besides the readings, under these names: ``acceleration`` of the weight, in m/s^2.
    """

    dynamic: ClassVar[bool] = False
    feels: ClassVar[tuple[str, ...]] = ()

    def lags(self) -> tuple[tuple[jax.Array, jax.Array], ...]:
        """Force channels: weights and time constants [s] of the parallel first-order lags the sensor consists of.

        The real parts of the weights add up to 1. The reading is the real part of the sum.
        """
        return ()

    def late_by(self) -> jax.Array:
        """Force channels: time by which the reading is late, in s."""
        return jnp.zeros(())

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """Readings of all channels, ``(n_time,)`` each in SI units, at `times` [s]."""
        return channels


Law = TypeVar("Law", bound=Effect)


def laws_of(kind: type[Law], laws: tuple[Effect, ...]) -> tuple[Law, ...]:
    """Those of `laws` that belong to one kind of port, in their order."""
    return tuple(law for law in laws if isinstance(law, kind))


def extends(effect: type[Effect]) -> bool:
    """Whether a law is more than a rig by itself can follow: it changes with time, or brings a motion of its own."""
    return effect.timed or getattr(effect, "carries", False) or getattr(effect, "retimes", False)


def fast(laws: tuple[Effect, ...]) -> jax.Array | None:
    """Whether any stiff law is there now; None where there is none in the model."""
    stiff = [law for law in laws if law.stiff]
    return ~functools.reduce(operator.and_, (law.absent() for law in stiff)) if stiff else None


def of_force(channels: Channels, change: Any) -> Channels:
    """Channels with `change` applied to the readings of each force gauge."""
    return {role: change(reading) if role in FORCES else reading for role, reading in channels.items()}
