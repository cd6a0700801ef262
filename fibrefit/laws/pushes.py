"""Laws between a force that was measured and the mass it pushes: the one kind that sees a whole course at once.

A force acts late, behind a lag, held from one instant of a controller to the next, or is off by a factor.
"""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Effect, quantity

SHORT = 1e-3
"""Share of a sample below which a mean over the period is taken from its first terms."""


class PushLaw(Effect):
    """A change between a force that was measured and the force that pushes the mass."""

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PUSH})

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Force on the mass ``(n_time,)`` in N and its rate, from the measured one, at `times` [s]."""
        return force, rates

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """Force ``(n_time,)`` in N to be measured, from that on the mass: the inverse of `applied`."""
        return force


def between_samples(
    values: jax.Array, rates: jax.Array, times: jax.Array, instants: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """A course and its rate at some instants, by cubics between samples; constant beyond its ends.

    Parameters
    ----------
    values, rates : (n_time,)
    times : (n_time,) in s
    instants : (n,) in s

    Returns
    -------
    values, rates : (n,)
        Where an instant is a sample, that sample to the last bit.
    """
    inside = jnp.clip(instants, times[0], times[-1])
    step = jnp.clip(jnp.searchsorted(times, inside, side="right") - 1, 0, times.shape[0] - 2)
    length, t = times[step + 1] - times[step], inside - times[step]
    rise = (values[step + 1] - values[step]) / length
    square = (3.0 * rise - 2.0 * rates[step] - rates[step + 1]) / length
    cube = (rates[step] + rates[step + 1] - 2.0 * rise) / length**2
    value = values[step] + t * (rates[step] + t * (square + t * cube))
    rate = rates[step] + t * (2.0 * square + t * (3.0 * cube))
    # The last sample is the end of a step: there the cubic is right but for its rounding.
    end = (inside == times[-1]) & (t == length)
    value = jnp.where(end, values[-1] + (value - jax.lax.stop_gradient(value)), value)
    rate = jnp.where(end, rates[-1] + (rate - jax.lax.stop_gradient(rate)), rate)
    return value, jnp.where((instants < times[0]) | (instants > times[-1]), 0.0, rate)


def ahead_of(values: jax.Array, times: jax.Array, lead: jax.Array) -> jax.Array:
    """A course ``(n_time,)`` some time [s] later, by lines between samples; constant beyond its ends."""
    return jnp.interp(times + lead, times, values)


class PushGain(PushLaw):
    """A force channel that is off by a factor from the force on the mass.

    Law
    ---
    ``g F`` pushes, F is measured.

    Valid range
    -----------
    Records of which some have a known mass added; else mass, friction and offset take the factor up.

    Source
    ------
    A motor constant, or the sensitivity of a load cell.
    """

    name: ClassVar[str] = "push.force_gain"
    gain: jax.Array = quantity(
        "-", "force on the mass per measured force", 1.1, lower=0.0, upper=1e4, null=1.0, symbol="g"
    )

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """``g F``."""
        return self.gain * force, self.gain * rates * jnp.ones_like(times)

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """F over g."""
        return force / self.gain


class PushDelay(PushLaw):
    """A force that acts later than it is recorded.

    Law
    ---
    ``F(t - δ)`` pushes.

    Valid range
    -----------
    Shorter than the record; beyond its ends the force is taken as constant.

    Source
    ------
    Controllers that log what they ask for, and loggers whose channels are read in turn.
    """

    name: ClassVar[str] = "push.force_delay"
    delay: jax.Array = quantity(
        "s",
        "time by which the force acts late; negative where it is recorded late",
        1e-3,
        lower=-0.2,
        upper=0.2,
        symbol="δ",
    )

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """F(t - δ)."""
        return between_samples(force, rates, times, times - self.delay)

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """The force on the mass a delay later."""
        return ahead_of(force, times, self.delay)


class PushLag(PushLaw):
    """A force that builds up behind what is recorded, as the current of a motor does.

    Law
    ---
    ``τ p' + p = F``, p pushes. Solved for the difference ``F - p = τ e`` with the rate of F linear between samples.

    Valid range
    -----------
    Any; settled when the record begins.

    Source
    ------
    Armature circuits, e.g. Leonhard, Control of Electrical Drives (2001), ch. 5.
    """

    name: ClassVar[str] = "push.force_lag"
    time_constant: jax.Array = quantity(
        "s", "time constant with which the force builds up", 2e-3, lower=0.0, upper=1.0, symbol="τ"
    )

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """``p`` and its rate."""
        tau, length = self.time_constant, times[1:] - times[:-1]
        there = tau > 0.0
        left = jnp.where(there, jnp.exp(-length / jnp.where(there, tau, 1.0)), 0.0)
        bend = tau * (rates[1:] - rates[:-1]) / length

        def follow(e: jax.Array, step: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
            before, after, bend, left = step
            e = after - bend + (e - before + bend) * left
            return e, e

        _, later = jax.lax.scan(follow, rates[0], (rates[:-1], rates[1:], bend, left))
        lagging = jnp.concatenate([rates[:1], later])
        return force - tau * lagging, lagging

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """``p + τ p'``."""
        return force + self.time_constant * jnp.asarray(jnp.gradient(force)) / (times[1] - times[0])


class PushHold(PushLaw):
    """A force that a controller holds from one of its instants to the next (zero-order hold).

    Law
    ---
    ``p(t) = (1/T) ∫ F`` over the last T: the transfer function ``(1 - exp(-s T)) / (s T)`` of a hold.

    Valid range
    -----------
    Motions slow against the period: the steps themselves, above 1/(2 T), are left out.

    Source
    ------
    Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), ch. 5.
    """

    name: ClassVar[str] = "push.hold"
    period: jax.Array = quantity("s", "time for which a force is held", 2e-3, lower=0.0, upper=0.5, symbol="T")

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Mean over the last period, and its rate."""
        length = times[1:] - times[:-1]
        steps = 0.5 * length * (force[1:] + force[:-1]) + length**2 / 12.0 * (rates[:-1] - rates[1:])
        whole = jnp.concatenate([jnp.zeros(1), jnp.cumsum(steps)])
        short = self.period < SHORT * length[0]
        period = jnp.where(short, 1.0, self.period)
        then = times - period
        before, _ = between_samples(force, rates, times, then)
        mean = (whole - _integral(force, rates, times, whole, then)) / period
        bend = jnp.asarray(jnp.gradient(rates)) / length[0]
        value = jnp.where(short, force - 0.5 * self.period * rates, mean)
        return value, jnp.where(short, rates - 0.5 * self.period * bend, (force - before) / period)

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """The force on the mass half a period later: a hold, to first order in its period."""
        return ahead_of(force, times, 0.5 * self.period)


def _integral(force: jax.Array, rates: jax.Array, times: jax.Array, whole: jax.Array, instants: jax.Array) -> jax.Array:
    """Integral of the force from the first sample to each instant; before it the force is constant."""
    step = jnp.clip(jnp.searchsorted(times, instants, side="right") - 1, 0, times.shape[0] - 2)
    length = times[step + 1] - times[step]
    t = jnp.maximum(instants - times[step], 0.0)
    rise = (force[step + 1] - force[step]) / length
    square = (3.0 * rise - 2.0 * rates[step] - rates[step + 1]) / length
    cube = (rates[step] + rates[step + 1] - 2.0 * rise) / length**2
    inside = t * (force[step] + t * (rates[step] / 2.0 + t * (square / 3.0 + t * cube / 4.0)))
    return whole[step] + inside + jnp.minimum(instants - times[0], 0.0) * force[0]
