"""The drop rig: a weight in an inclined guide, caught by a fibre that hangs from a force gauge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_quantity
from fibrefit.laws.law import Effect, FibreLaw, GuideLaw, fast, laws_of
from fibrefit.rigs.parts.fibre import End, Fibre, Memories, PointChain, spring_and_damper
from fibrefit.rigs.parts.guide import Guide, Sliding, band_after, band_margin, first_band
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Rig, Start, Starting, Stated, Values, Variation
from fibrefit.rigs.signals.newton import Pull
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.rest import RestAsked, first_rest, mean_at_rest, rests
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import CAUGHT, FALLEN, FALLS_AT_ALL, FEWEST_FALLING, FORCE_RISES, LIFT_AGREES


class FibreMassState(NamedTuple):
    """Position u [m] and velocity [m/s] of the weight, away from the frame; u = 0 where the fibre is just taut.

    Memories of the fibre's laws; force [N] of the guide's bristles, and the fibre's points, where the model has them.
    """

    position: jax.Array
    velocity: jax.Array
    memories: Memories
    bristle: jax.Array | None
    chain: Any = None


class FibreMassMode(NamedTuple):
    """Modes of the fibre and of the guide; band of speed, and modes of the fibre's segments, None where there are none.

    A fibre with segments of its own is only known to be longer than its free length or not.
    """

    fibre: jax.Array
    guide: jax.Array
    band: Any
    chain: Any = None


class FibreMass(eqx.Module):
    """Weight, guide and fibre as a switched system.

    Law
    ---
    ``m ü = m g sin α - T - guide``, fibre stretch ``e = u``.

    Parameters
    ----------
    mass : () in kg
    pull_of_gravity : () in N, along the guide

    Source
    ------
    Polach and Václavík (docs/rigs.md), Figs 3-5.
    """

    mass: jax.Array
    pull_of_gravity: jax.Array
    fibre: Fibre
    guide: Guide

    def stiff(self) -> jax.Array | None:
        """Whether friction that sets in over a short distance is there now."""
        return fast((*self.guide.laws, *self.fibre.laws))

    def tension(self, state: FibreMassState, mode: FibreMassMode) -> jax.Array:
        """Tension of the fibre, in N: what the gauge at the frame feels."""
        return self._tensions(state, mode)[0]

    def derivative(self, state: FibreMassState, mode: FibreMassMode, inputs: Any) -> FibreMassState:
        """Rate of the state."""
        now, drive = self._sliding(state, mode)
        return FibreMassState(
            self.guide.speed(mode.guide, state.velocity),
            self.guide.net_force(drive, mode.guide, now) / self.mass,
            self.fibre.memory_rates(state.position, state.velocity, state.memories, mode.fibre),
            self.guide.bristle_rate(mode.guide, now),
            None
            if (chain := self._chain()) is None
            else chain.derivative(state.chain, mode.chain, *_ends(state.position, state.velocity)),
        )

    def margins(self, state: FibreMassState, mode: FibreMassMode, inputs: Any) -> FibreMassMode:
        """Margins of each mode."""
        now, drive = self._sliding(state, mode)
        fibre = self.fibre.margin(state.position, state.velocity, state.memories, mode.fibre)
        band = band_margin(self.guide.laws, mode.band, state.velocity)
        segments = None
        if (chain := self._chain()) is not None:
            segments = chain.margins(state.chain, mode.chain, *_ends(state.position, state.velocity))
            fibre = jnp.where(chain.there(), self.fibre.margin_of_length(state.position, mode.fibre), fibre)
        return FibreMassMode(fibre, self.guide.margin(drive, mode.guide, now), band, segments)

    def switch(
        self, state: FibreMassState, mode: FibreMassMode, crossed: FibreMassMode, inputs: Any
    ) -> tuple[FibreMassState, FibreMassMode]:
        """State and mode after the switches `crossed`."""
        here = state.position, state.velocity, state.memories
        memories, taut = self.fibre.switch(*here, mode.fibre, crossed.fibre)
        velocity = self.guide.stop(mode.guide, crossed.guide, state.velocity)
        state, mode = state._replace(velocity=velocity, memories=memories), mode._replace(fibre=taut)
        mode = mode._replace(band=band_after(self.guide.laws, mode.band, velocity, crossed.band))
        if (chain := self._chain()) is not None:
            ends = _ends(state.position, velocity)
            points, segments = chain.switch(state.chain, mode.chain, crossed.chain, *ends)
            state, mode = state._replace(chain=points), mode._replace(chain=segments)
        now, drive = self._sliding(state, mode)
        return state, mode._replace(guide=self.guide.settle(drive, mode.guide, crossed.guide, now))

    def at_rest(self, position: jax.Array) -> tuple[FibreMassState, FibreMassMode]:
        """State and mode of a weight let go at `position`."""
        zero = jnp.zeros(())
        bristle = zero if self.guide.may_creep else None
        chain = self._chain()
        points: Any = None if chain is None else chain.at_rest(*_ends(position, zero))
        state = FibreMassState(position, zero, self.fibre.memories(position), bristle, points)
        taut = (self.fibre.stretch(position) > 0.0).astype(jnp.int32)
        segments = None if chain is None else chain.modes(points, *_ends(position, zero))
        mode = FibreMassMode(taut, jnp.int32(0), first_band(self.guide.laws), segments)
        stopped = jax.tree.map(lambda _: jnp.array(False), mode)._replace(guide=jnp.array(True))
        return self.switch(state, mode, stopped, None)

    def _chain(self) -> PointChain | None:
        return PointChain.of(self.fibre, self.pull_of_gravity / self.mass)

    def _tensions(self, state: FibreMassState, mode: FibreMassMode) -> tuple[jax.Array, jax.Array]:
        """At the frame and at the weight, in N."""
        plain = self.fibre.tension(state.position, state.velocity, state.memories, mode.fibre)
        if (chain := self._chain()) is None:
            return plain, plain
        at_frame, at_weight = chain.tensions(state.chain, mode.chain, *_ends(state.position, state.velocity))
        return jnp.where(chain.there(), at_frame, plain), jnp.where(chain.there(), at_weight, plain)

    def _sliding(self, state: FibreMassState, mode: FibreMassMode) -> tuple[Sliding, jax.Array]:
        """What the guide feels, and the force on the weight besides the guide's, in N."""
        tension = self._tensions(state, mode)[1]
        return Sliding(state.position, state.velocity, tension, state.bristle), self.pull_of_gravity - tension


def _ends(position: jax.Array, velocity: jax.Array) -> tuple[End, End]:
    """The fibre from the frame to the weight."""
    zero = jnp.zeros(())
    return End(zero, zero), End(position, velocity)


NUISANCES = (
    Parameter("position_zero", "m", "reading of the position channel where the fibre is just taut", 1e-3),
    Parameter("release", "s", "instant at which the weight was let go", 0.1),
)

LEAD = 0.1
"""Time in s at rest before the motion of a planned record begins."""

MOST_LIFTS = 8
"""Records of which both lifts are named."""


class LiftShown(NamedTuple):
    """Of a record, in m: the lift that is stated, and the fall after which the force rises."""

    record: str
    stated: float
    measured: float

    @property
    def agrees(self) -> bool:
        """Whether the two are of one lift."""
        return abs(self.measured - self.stated) <= LIFT_AGREES * self.stated


def lifts_that_differ(lifts: Sequence[LiftShown]) -> str:
    """Stated and measured lifts of records, if some differ, and which two would agree if they were exchanged."""
    off = [lift for lift in lifts if not lift.agrees]
    if not off:
        return ""
    each = [
        f"{lift.record} {format_quantity(lift.stated, 'm', 3)} and {format_quantity(lift.measured, 'm', 3)}"
        for lift in lifts[:MOST_LIFTS]
    ]
    others = len(lifts[MOST_LIFTS:])
    more = f"; and {others} more" if others else ""
    said = f"Lifts as stated, and falls after which the force rises: {'; '.join(each)}{more}."
    swapped = [
        f"{one.record} and {other.record}"
        for one, other in combinations(off, 2)
        if one._replace(stated=other.stated).agrees and other._replace(stated=one.stated).agrees
    ]
    return f"{said} With the lifts of {', or of '.join(swapped)} exchanged they would agree." if swapped else said


SMOOTHED_DROP = 8e-3
"""Length [s] of the windows by which the rate of a stretch is found, and where a signal crosses a level."""
LIKE_A_FALL = 0.25
"""Share of its whole way down along which a weight moves nearly as if it fell, even where the fibre is taut from the
start: the root of the way is then a sine of time, there 4 % off its line."""
SWING = 2.5
"""Length of a first contact over the time to its peak, where the fibre does not go slack after it."""
HOLD = RestAsked(
    called="hold",
    moves="the weight moves from the first sample",
    expected="a rest before the release, from which zero and release are found",
    do='Give lift, release = "... s" and position_zero = "... mm" for the record, or let it begin earlier.',
    masked="Set the range of the {channel} sensor so that it reads the hold. For this record give "
    'lift = ".. mm", release = ".. s" and position_zero = ".. mm"; fibrefit inspect says what was masked, and why.',
)


class _Drop(NamedTuple):
    """What a drop shows before and during its fall."""

    zero: float
    lift: float
    release: float
    acceleration: float


def _starting(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Rest gives the zero, the fall gives release and friction, the first contacts give stiffness and damping."""
    try:
        drops = [_fall(trace, said) for trace, said in zip(traces, stated or [{}] * len(traces), strict=True)]
        stiffness, damping = _fibre(traces, drops)
        settled = []
        for trace, drop in zip(traces, drops, strict=True):
            # Where samples lie closer than the noise is wide, the readings themselves cross the taut point many times.
            time, position = trace.times, derivative(trace.channels["position"], trace.times, SMOOTHED_DROP, 0)
            first = _first(position > drop.zero, trace, "does not reach the taut point")
            slack = (position < drop.zero) & (np.arange(len(time)) > first)
            # A weight that the fibre never lets go swings: a little more than half a period counts as the contact.
            swing = time[first] + SWING * (time[np.argmax(position)] - time[first])
            settled.append(float(min(time[np.argmax(slack)] if slack.any() else time[-1], swing, time[-1])))
    except DataError as error:
        shown = []
        for trace in traces:
            with suppress(DataError):
                level = mean_at_rest(trace, "position", first_rest(trace, HOLD), HOLD)
                shown.append(LiftShown(trace.name, trace.conditions["lift"], _onset(trace, level) - level))
        if lifts := lifts_that_differ([lift for lift in shown if not np.isnan(lift.stated)]):
            raise DataError(error.where, error.got, error.expected, f"{lifts} {error.do}") from None
        raise
    friction = []
    for trace, drop in zip(traces, drops, strict=True):
        mass, slope = _mass(trace), np.sin(trace.conditions["inclination"])
        weight = mass * STANDARD_GRAVITY
        friction.append(float(max(weight * slope - mass * drop.acceleration, 0.01 * weight)))
    zero, lift, release, _ = (np.array(values) for values in zip(*drops, strict=True))
    return Starting(
        shared={"stiffness": stiffness, "damping": damping, "friction": float(np.median(friction))},
        each={"position_zero": zero, "release": release, "lift": lift},
        moving=release,
        settled=np.array(settled),
        spread={"stiffness": 2.0, "damping": 5.0, "friction": 5.0},
    )


def _mass(trace: Trace) -> float:
    return trace.conditions["weight_mass"] + trace.conditions["added_mass"]


def _fall(trace: Trace, stated: Mapping[str, float]) -> _Drop:
    position, time = trace.channels["position"], trace.times
    lift = trace.conditions["lift"]
    if np.nanmax(position) - np.nanmin(position) < FALLS_AT_ALL * lift:
        raise _no_drop(trace, "does not fall by its lift")
    if "release" in stated and "position_zero" in stated and not np.isnan(lift):
        level, after, noise = stated["position_zero"] - lift, time >= stated["release"], 0.0
    else:
        held = first_rest(trace, HOLD)
        level, after = mean_at_rest(trace, "position", held, HOLD), np.arange(len(time)) >= held.stop
        noise = float(np.nanstd(position[held]))
        lift = _onset(trace, level) - level if np.isnan(lift) else lift
    fallen = position - level
    # The square root of the way fallen is a line in time, whose foot is the release.
    # Of two samples the smaller: a lone outlier is no way down.
    deepest = float(np.nanmax(np.fmin(fallen[1:], fallen[:-1])))
    fall = max(lift, LIKE_A_FALL * deepest)
    begun = 0.05 * fall if fall == lift else max(0.05 * fall, FORCE_RISES * noise)
    below = _first(after & (fallen > FALLEN * fall), trace, "does not fall by its lift")
    early = after & (np.arange(len(time)) < below) & (fallen > begun)
    if early.sum() < FEWEST_FALLING:
        got, do = (
            f"fewer than {FEWEST_FALLING} samples of the fall",
            "Check lift, and the unit of the position channel.",
        )
        raise DataError(trace.name, got, "a fall of some milliseconds", do)
    slope, foot = np.polyfit(time[early], np.sqrt(fallen[early]), 1)
    release = float(np.clip(-foot / slope, time[0], time[below]))
    zero, release = stated.get("position_zero", level + lift), stated.get("release", release)
    return _Drop(zero, lift, release, float(2.0 * slope**2))


def _onset(trace: Trace, level: float) -> float:
    """Position at which the force first rises, in m."""
    force, position, held = trace.channels["force"], trace.channels["position"], first_rest(trace, HOLD)
    mean = mean_at_rest(trace, "force", held, HOLD)
    rising = _first(force > mean + FORCE_RISES * np.nanstd(force[held]), trace, "shows no force")
    if position[rising] <= level:
        got, expected = "the position falls while the weight does", "a position that grows away from the frame"
        raise DataError(trace.name, got, expected, "Check the sign of the position channel.")
    return float(position[rising])


def _first(flags: np.ndarray, trace: Trace, otherwise: str) -> int:
    if not flags.any():
        raise _no_drop(trace, otherwise)
    return int(np.argmax(flags))


def _no_drop(trace: Trace, otherwise: str) -> DataError:
    lift = "" if np.isnan(trace.conditions.get("lift", np.nan)) else "lift, and "
    do = f"Check {lift}the sign and unit of the position and force channels."
    return DataError(trace.name, f"the record {otherwise}", "a weight that is released, falls and is caught", do)


def _fibre(traces: Sequence[Trace], drops: Sequence[_Drop]) -> tuple[float, float]:
    """Stiffness and damping by regression of force on stretch and its rate, wherever the fibre carries load."""
    loads = []
    for trace, drop in zip(traces, drops, strict=True):
        stretch = trace.channels["position"] - drop.zero
        rate = derivative(stretch, trace.times, SMOOTHED_DROP, 1)
        force = trace.channels["force"]
        loaded = (stretch > 0.1 * np.nanmax(stretch)) & (force > 0.1 * np.nanmax(force)) & np.isfinite(rate)
        loads.append((stretch[loaded], rate[loaded], force[loaded]))
    # What the first record shows of its lift beside the one that is stated.
    trace, drop, read = traces[0], drops[0], ""
    if not np.isnan(trace.conditions["lift"]):
        level = drop.zero - drop.lift
        with suppress(DataError):
            fallen = format_quantity(_onset(trace, level) - level, "m", 3)
            stated = format_quantity(drop.lift, "m", 3)
            read = f" (a lift of {stated} is stated, and the force begins to rise after a fall of {fallen})"
    got = f"the force does not grow as the fibre is stretched{read}"
    do = "Check lift; then the sign and unit of the force and position channels."
    return spring_and_damper(loads, DataError(trace.name, got, "a force that grows with position", do))


def _starting_force_only(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """The first catch gives stiffness, damping and the speed at take-up, that speed the lift and the release.

    Law
    ---
    From take-up on ``v = v0 + ∫ (a - F/m)`` and ``x = ∫ v``; ``F = k x + b v`` is linear in k, b, k v0 and b v0.

    Parameters
    ----------
    traces : sequence of Trace
        Force in N over time in s, one a record; mass, inclination and, where it is known, lift among its conditions.
    stated : sequence of mapping
        What each record states of itself, such as its ``release`` in s.
    initial : mapping
        Values the study gives.

    Raises
    ------
    DataError
        If a weight would have fallen before the first sample.
    """
    caught = zip(*map(_catch, traces), strict=True)
    stiffness, damping, lifts, taken, over = (np.array(values) for values in caught)
    lift = np.array([t.conditions["lift"] for t in traces])
    lift = np.where(np.isnan(lift), lifts, lift)
    pull = np.array([STANDARD_GRAVITY * np.sin(trace.conditions["inclination"]) for trace in traces])
    release = np.array([said.get("release", np.nan) for said in stated]) if stated else np.full(len(traces), np.nan)
    release = np.where(np.isnan(release), taken - np.sqrt(2.0 * lift / pull), release)
    for trace, begun in zip(traces, release, strict=True):
        if begun < trace.times[0]:
            do = "Let the record begin before the weight is let go."
            raise DataError(trace.name, "the weight falls before the first sample", "the whole fall", do)
    weight = np.array([_mass(trace) * STANDARD_GRAVITY for trace in traces])
    return Starting(
        shared={
            "stiffness": float(np.median(stiffness)),
            "damping": float(max(np.median(damping), 1e-4 * np.median(stiffness))),
            "friction": 0.01 * float(np.median(weight)),
        },
        each={"release": release, "lift": lift},
        moving=release,
        settled=over,
        spread={"stiffness": 1.5, "damping": 5.0, "friction": 5.0},
    )


def _catch(trace: Trace) -> tuple[float, float, float, float, float]:
    """Stiffness, damping, lift, instant of take-up, and the end of the first contact."""
    force, times = trace.channels["force"], trace.times
    seen = np.isfinite(force)
    force = np.interp(times, times[seen], force[seen])
    held = [rest for rest in rests(trace) if rest.start == 0]
    force = force - (float(np.mean(force[held[0]])) if held else float(np.min(force)))
    taut = derivative(force, times, SMOOTHED_DROP, 0) > CAUGHT * force.max()
    if not force.max() > 0.0 or taut[0]:
        do = "Check the sign of the force, and let the record begin before the fall."
        raise DataError(trace.name, "no catch in the force", "a force that rises from rest as a fibre goes taut", do)
    first = int(np.argmax(taut))
    slack = ~taut[first:]
    last = first + int(np.argmax(slack)) if slack.any() else len(taut)
    peak = first + int(np.argmax(force[first:last]))
    over = min(last, len(times) - 1, peak + max(2 * (peak - first), 4))
    inside = slice(first, over + 1)
    step, t = float(np.diff(times).mean()), times[inside] - times[first]
    pull = STANDARD_GRAVITY * np.sin(trace.conditions["inclination"])
    speed = np.cumsum(pull - force[inside] / _mass(trace)) * step
    columns = np.column_stack([np.cumsum(speed) * step, speed, t, np.ones_like(t)])
    (stiffness, damping, rise, _), *_ = np.linalg.lstsq(columns, force[inside], rcond=None)
    if not stiffness > 0.0:
        quarter = max(times[peak] - times[first], 2.0 * step)
        stiffness, rise = _mass(trace) * (0.5 * np.pi / quarter) ** 2, 0.0
    speed_at_take_up = rise / stiffness if rise > 0.0 else force.max() / np.sqrt(stiffness * _mass(trace))
    lift = float(speed_at_take_up**2 / (2.0 * pull))
    return float(stiffness), float(damping), lift, float(times[first]), float(times[over])


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> FibreMass:
    """System of one record."""
    mass = conditions["weight_mass"] + conditions["added_mass"]
    return FibreMass(
        mass=mass,
        pull_of_gravity=mass * STANDARD_GRAVITY * jnp.sin(conditions["inclination"]),
        fibre=Fibre(values["stiffness"], values["damping"], laws_of(FibreLaw, laws), tension_law),
        guide=Guide(values["friction"], laws_of(GuideLaw, laws)),
    )


def _pulled(conditions: Mapping[str, float], position: np.ndarray) -> Pull:
    """Gravity draws the weight away from the frame, the fibre back."""
    mass = conditions["weight_mass"] + conditions["added_mass"]
    return Pull(mass, STANDARD_GRAVITY * math.sin(conditions["inclination"]), -np.ones(len(position)))


CAPABILITIES = frozenset(
    {Capability.FIBRE, Capability.GUIDE, Capability.INCLINE, Capability.TAUT_POINT, Capability.FALL, Capability.PLACE}
)

_USUAL = Rig(
    kind="fibre_mass",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness of the fibre", 3e4, lower=10.0, upper=1e7, log=True),
        Parameter("damping", "N s/m", "damping of the fibre", 20.0, lower=0.0, upper=1e4),
        Parameter("friction", "N", "Coulomb friction between weight and guide", 4.0, lower=0.0, upper=1e3),
    ),
    nuisances=NUISANCES,
    conditions=(
        Parameter("weight_mass", "kg", "mass of the weight", math.nan, lower=0.0),
        Parameter("added_mass", "kg", "mass added to the weight", 0.0, lower=0.0),
        Parameter(
            "inclination", "rad", "slope of the guide; pi/2 is free fall", math.nan, lower=0.0, upper=math.pi / 2
        ),
        Parameter("lift", "m", "height above the point where the fibre is just taut", math.nan),
    ),
    capabilities=CAPABILITIES,
    channels=("force", "position"),
    inputs=(),
    build=_build,
    # The weight rests `lift` above the taut point until it is released.
    start=lambda system, values, given, _: Start(*system.at_rest(-given["lift"]))._replace(time=values["release"]),
    observe=lambda system, state, mode, _: {"force": system.tension(state, mode), "position": state.position},
    fibres=lambda system, state, mode, _: ((system.fibre.stretch(state.position), state.velocity),),
    starting=_starting,
    pulled=_pulled,
    directions=("down", "up"),
    planned=lambda _: {"release": LEAD},
    further=(Variation("lift"), Variation("inclination"), Variation("added_mass", onto="weight_mass")),
)

FORCE_ONLY = replace(
    _USUAL,
    nuisances=NUISANCES[1:],
    capabilities=CAPABILITIES - {Capability.TAUT_POINT, Capability.PLACE},
    channels=("force",),
    observe=lambda system, state, mode, _: {"force": system.tension(state, mode)},
    starting=_starting_force_only,
)
"""The same where no position was measured: how far the weight fell is given by how hard it is caught."""

FIBRE_MASS = replace(_USUAL, variants={"force_only": FORCE_ONLY})
