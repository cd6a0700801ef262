"""What an effect is: a small frozen pytree whose fields are the values of its declared parameters.

Each port of a rig accepts laws of one kind. A law is written for one instant and scalars; the neutral answer of every
method is "nothing is added", so that an effect overrides only what it changes, and at its null value it changes nothing
to the last bit.
"""

from __future__ import annotations

from typing import ClassVar, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.parameter import Parameter

Memory = tuple[jax.Array, ...]
EVERY_RIG = frozenset({"fibre_mass", "pulley_drive", "inverted_pendulum", "guided_mass"})
FIBRE_RIGS = frozenset({"fibre_mass", "pulley_drive"})


class Effect(eqx.Module):
    """Common to all effects.

    Attributes
    ----------
    name : str
        Name in the catalogue, ``port.effect``.
    parameters : tuple of Parameter
        In the order of the fields; ``parameter.name`` is the field's name.
    rigs : frozenset of str
        Kinds of rig the effect makes sense for.
    needs : tuple of str
        Effects that must be present too.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    rigs: ClassVar[frozenset[str]] = EVERY_RIG
    needs: ClassVar[tuple[str, ...]] = ()


class FibreLaw(Effect):
    """A change of the tension of a fibre; `stretch` in m, `rate` in m/s, tensions in N.

    Attributes
    ----------
    memory : tuple of str
        Names of the states the law owns, all zero at the start.
    """

    memory: ClassVar[tuple[str, ...]] = ()

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

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, taut: jax.Array) -> Memory:
        """Rate of the law's own states; `taut` tells whether the fibre carries load."""
        return ()

    def at_release(self, memory: Memory) -> Memory:
        """The law's own states just after the fibre has gone slack."""
        return memory


class GuideLaw(Effect):
    """A change of the forces between the weight and its guide, in N; positive opposes motion in the + direction."""

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Addition to the level of the set-valued friction that acts in `direction` (+1 or -1) of motion."""
        return jnp.zeros(())

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """Addition to the single-valued force against the motion."""
        return jnp.zeros(())


class SensorLaw(Effect):
    """A change between what a sensor feels and what the logger writes."""

    def measure(self, channels: dict[str, jax.Array], times: jax.Array) -> dict[str, jax.Array]:
        """Readings of all channels, ``(n_time,)`` each in SI units, at `times` [s]."""
        return channels


Law = TypeVar("Law", bound=Effect)


def laws_of(kind: type[Law], laws: tuple[Effect, ...]) -> tuple[Law, ...]:
    """Those of `laws` that belong to one kind of port, in their order."""
    return tuple(law for law in laws if isinstance(law, kind))
