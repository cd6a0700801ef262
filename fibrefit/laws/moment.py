"""When a law is evaluated, and what has come together by then."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

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
