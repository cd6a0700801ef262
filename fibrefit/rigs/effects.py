"""An effect for a person: what its docstring and its parameters say, as data, and a small picture of what it does."""

from __future__ import annotations

import inspect
import math
import re
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.laws.catalogue import CATALOGUE, suits
from fibrefit.laws.law import DriveLaw, Effect, FibreLaw, GuideLaw, PulleyLaw, SensorLaw
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.parts.fibre import LOADED, SLACK, Fibre
from fibrefit.rigs.parts.guide import Guide, Sliding

_SECTION = re.compile(r"^(Law|Parameters|Valid range|Source)\n-+\n", re.MULTILINE)


def described_effects() -> dict[str, dict[str, Any]]:
    """The catalogue of effects that can be added to a model.

    Returns
    -------
    dict of str to dict
        By name: ``says``, ``law``, ``parameters`` (name, symbol, unit, limits, typical), ``rigs``, ``source``...

    Examples
    --------
    >>> fibrefit.effects()["guide.viscous_friction"]["parameters"][0]["unit"]
    'N s/m'
    """
    return {effect.name: effect_facts(effect) for effect in CATALOGUE.values()}


def effect_facts(effect: type[Effect]) -> dict[str, Any]:
    """Effect as data, for programs."""
    parts = sections(effect)
    return {
        "name": effect.name,
        "says": parts[""],
        "law": parts.get("Law", ""),
        "valid_range": parts.get("Valid range", ""),
        "source": parts.get("Source", ""),
        "rigs": rigs_of(effect),
        "needs": list(effect.needs),
        "strength": list(effect.strength),
        "parameters": [
            {
                "name": f"{effect.name}.{parameter.name}",
                "symbol": parameter.symbol,
                "unit": parameter.unit,
                "says": parameter.doc,
                # JSON has no infinity: a limit that is none is null.
                **{
                    key: value if math.isfinite(value := getattr(parameter, key)) else None
                    for key in ("null", "typical", "lower", "upper")
                },
            }
            for parameter in effect.parameters
        ],
    }


def rigs_of(effect: type[Effect]) -> list[str]:
    """Kinds of rig an effect makes sense on."""
    return sorted(kind for kind, rig in RIGS.items() if suits(effect, rig))


def sections(effect: type[Effect]) -> dict[str, str]:
    """Sections of the docstring; the summary has no title."""
    parts = _SECTION.split(inspect.cleandoc(effect.__doc__ or ""))
    titles, texts = ["", *parts[1::2]], parts[0::2]
    return {title: " ".join(text.split()).replace("`", "") for title, text in zip(titles, texts, strict=True)}


POINTS = 161
STIFFNESS, DAMPING, FRICTION, TENSION = 20e3, 25.0, 4.0, 30.0
"""Of the base model that is drawn, and the tension that draws at its guide; in SI units."""
STRETCH, FREQUENCY = 2e-3, 10.0
"""Stretch in m, and frequency in Hz at which the fibre goes through it."""
FASTEST, LONGEST, STEP = 0.4, 0.04, 0.002
"""Largest speed [m/s] of a weight; time [s] for which a sensor is watched, and at which its force sets in."""


@dataclass(frozen=True)
class Picture:
    """A quantity over another, without and with an effect.

    Parameters
    ----------
    across, up : str
        What the axes show, with units.
    x, without, with_it : (n_point,)
    """

    across: str
    up: str
    x: np.ndarray
    without: np.ndarray
    with_it: np.ndarray


def picture_of(effect: type[Effect]) -> Picture | None:
    """Picture of an effect at its typical values; None where none says anything."""
    law = effect(**{p.name: jnp.asarray(p.typical) for p in effect.parameters})
    kinds = ((GuideLaw | PulleyLaw, _over_speed), (FibreLaw, _fibre), (DriveLaw, _drive), (SensorLaw, _sensor))
    for kind, draw in kinds:
        if isinstance(law, kind):
            found = draw(law)
            return None if found is None or np.allclose(found.without, found.with_it, rtol=1e-9) else found
    return None


def _over_speed(law: Any) -> Picture:
    """Force of a guide against the motion, set-valued at rest; tension behind a pulley."""
    speeds, across = np.linspace(-FASTEST, FASTEST, POINTS), "speed of the weight / (m/s)"
    if isinstance(law, PulleyLaw):
        grip = np.asarray(jax.vmap(lambda v: law.grip(jnp.asarray(math.radians(150.0)), v))(speeds))
        return Picture(across, "tension behind over before", speeds, np.ones(POINTS), grip)

    def force(laws: tuple, v: jax.Array) -> jax.Array:
        guide, now = Guide(jnp.asarray(FRICTION), laws), Sliding(jnp.asarray(0.01), v, jnp.asarray(TENSION))
        return jnp.sign(v) * guide.level(jnp.sign(v), v, now) + guide.single_valued(now.position, v)

    plain, found = (np.asarray(jax.vmap(lambda v, laws=laws: force(laws, v))(speeds)) for laws in ((), (law,)))
    return Picture(across, "force of the guide / N", speeds, plain, found)


def _fibre(law: Any) -> Picture:
    """Tension over stretch, once round a cycle that goes slack."""
    times = jnp.linspace(0.0, 1.5 / FREQUENCY, 12 * POINTS)
    omega = 2.0 * math.pi * FREQUENCY
    lengths, rates = STRETCH * (0.4 - 0.6 * jnp.cos(omega * times)), 0.6 * STRETCH * omega * jnp.sin(omega * times)

    def tensions(laws: tuple) -> np.ndarray:
        fibre = Fibre(jnp.asarray(STIFFNESS), jnp.asarray(DAMPING), laws)

        def step(memories: Any, now: Any) -> tuple[Any, jax.Array]:
            length, rate = now
            taut = (fibre.stretch(length) > 0.0) & (fibre.pull(length, rate, memories) > 0.0)
            mode = jnp.where(taut, LOADED, SLACK)
            changes = fibre.memory_rates(length, rate, memories, mode)
            moved = jax.tree.map(lambda m, d: m + d * (times[1] - times[0]), memories, changes)
            return moved, fibre.tension(length, rate, memories, mode)

        return np.asarray(jax.lax.scan(step, fibre.memories(lengths[0]), (lengths, rates))[1])

    last = slice(4 * POINTS, None, 8)
    x = 1e3 * np.asarray(lengths)[last]
    return Picture("stretch / mm", f"tension / N, at {FREQUENCY:g} Hz", x, tensions(())[last], tensions((law,))[last])


def _drive(law: Any) -> Picture | None:
    places = np.linspace(0.0, 0.3, POINTS)
    zero = jnp.zeros(())
    taken = np.asarray(jax.vmap(lambda x: law.travel(x, zero, jnp.asarray(0.04))[0])(places))
    if not np.allclose(taken, places):
        return Picture(
            "drive / mm", "fibre taken in beside it / mm", 1e3 * places, np.zeros(POINTS), 1e3 * (taken - places)
        )
    tensions = np.linspace(0.0, 100.0, POINTS)
    gives = 1e6 * float(law.compliance()) * tensions
    return Picture("tension / N", "mount gives way / um", tensions, np.zeros(POINTS), gives)


def _sensor(law: Any) -> Picture:
    """Reading of a force that sets in at once."""
    times = np.linspace(0.0, LONGEST, POINTS)
    true = np.where(times >= STEP, TENSION, 0.0)
    late = times - STEP - float(law.late_by())
    felt = np.where(late >= 0.0, TENSION, 0.0)
    if lags := law.lags():
        after = np.maximum(late, 0.0)
        shares = [np.asarray(w) * (1.0 - np.exp(-after / np.asarray(tau))) for w, tau in lags]
        felt = TENSION * np.real(np.sum(shares, axis=0))
    places = np.linspace(0.0, 0.02, POINTS)
    channels = {"force": jnp.asarray(felt), "position": jnp.asarray(places)}
    channels |= {name: jnp.gradient(channels["position"]) for name in law.feels}
    readings = law.measure(channels, jnp.asarray(25.0 * times))
    if not np.array_equal(readings["position"], channels["position"]):
        read = 1e3 * np.asarray(readings["position"])
        return Picture("true position / mm", "reading / mm", 1e3 * places, 1e3 * places, read)
    return Picture("time / ms", "reading of the force / N", 1e3 * times, true, np.asarray(readings["force"]))
