"""The drive rig: a weight on an incline, pulled by a drive through a fibre over a pulley, whose rim may move."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.core.errors import DataError
from fibrefit.laws.law import DriveLaw, Effect, FibreLaw, GuideLaw, PulleyLaw, fast, laws_of
from fibrefit.rigs.parts.fibre import LOADED, End, Fibre, Memories, PointChain, spring_and_damper
from fibrefit.rigs.parts.guide import Guide, Sliding, band_after, band_margin, first_band
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Rig, Start, Starting, Stated, Values, Variation
from fibrefit.rigs.signals.newton import Pull
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.rest import RestAsked, first_rest, mean_at_rest
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import DRIVE_BEGINS, DRIVE_STANDS


class Mount(eqx.Module):
    """A drive that moves the end of the fibre as measured, but for the laws that were added."""

    laws: tuple[DriveLaw, ...] = ()

    @property
    def may_yield(self) -> bool:
        """Whether the model has a mount that yields."""
        return any(law.yields for law in self.laws)

    def travel(self, drive: tuple[jax.Array, jax.Array], radius: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Fibre taken in, in m, and its rate, for the position and rate that were measured."""
        position, rate = drive
        for law in self.laws:
            position, rate = law.travel(position, rate, radius)
        return position, rate

    def compliance(self) -> jax.Array:
        """Displacement of the end of the fibre per tension, in m/N."""
        return sum((law.compliance() for law in self.laws), start=jnp.zeros(()))


RIM_OF_A_RUBBING_PULLEY = 0.05
"""Mass of the rim, in kg, where its bearing rubs and nothing is known of its inertia."""


class Path(eqx.Module):
    """Length of fibre between pulley and weight.

    Law
    ---
    ``ℓ(u) = sqrt((s - u)^2 + d^2)``; the weight at u takes up ``ℓ(0) - ℓ(u)``. Without lateral offset that is u.

    Parameters
    ----------
    lateral_offset : () in m
        d, distance of the weight from the plane of the pulley.
    guide_distance : () in m
        s, distance along the guide from u = 0 to the foot of the pulley.
    """

    lateral_offset: jax.Array
    guide_distance: jax.Array

    def follow(self, position: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Fibre the weight has given back, in m, and the cosine between fibre and guide."""
        askew = self.lateral_offset > 0.0
        ahead = self.guide_distance - position
        length = jnp.sqrt(jnp.where(askew, ahead**2 + self.lateral_offset**2, 1.0))
        return jnp.where(askew, self._whole() - length, position), jnp.where(askew, ahead / length, 1.0)

    def position(self, given_back: jax.Array) -> jax.Array:
        """Position of the weight, in m."""
        askew = self.lateral_offset > 0.0
        length = self._whole() - given_back
        ahead = jnp.sqrt(jnp.where(askew, length**2 - self.lateral_offset**2, 1.0))
        return jnp.where(askew, self.guide_distance - ahead, given_back)

    def _whole(self) -> jax.Array:
        return jnp.sqrt(jnp.where(self.lateral_offset > 0.0, self.guide_distance**2 + self.lateral_offset**2, 1.0))


class Pulley(eqx.Module):
    """A pulley that turns without resistance, but for the laws that were added.

    Parameters
    ----------
    radius : () in m
    wrap_angle : () in rad
    near_share : () a pure number
        Share of the fibre between drive and rim.
    """

    radius: jax.Array
    wrap_angle: jax.Array
    near_share: jax.Array
    laws: tuple[PulleyLaw, ...] = ()

    @property
    def turns(self) -> bool:
        """Whether the model has a rim that moves by itself."""
        return any(law.turns for law in self.laws)

    @property
    def rubs(self) -> bool:
        """Whether the model has a bearing that holds the rim."""
        return any(law.rubs for law in self.laws)

    def turning(self) -> jax.Array:
        """Whether such a rim is there now, and not only at the null value of its laws."""
        return (self._inertia() > 0.0) | (self._rubbing() > 0.0)

    def mass(self) -> jax.Array:
        """Mass of the rim, in kg."""
        inertia = self._inertia()
        return jnp.where(inertia > 0.0, inertia, RIM_OF_A_RUBBING_PULLEY)

    def bearing(self) -> Guide:
        """The bearing, as a guide of the rim."""
        return Guide(self._rubbing())

    def grip(self, velocity: jax.Array) -> jax.Array:
        """Factor on the tension that reaches the weight."""
        factor = jnp.ones(())
        for law in self.laws:
            factor = factor * law.grip(self.wrap_angle, velocity)
        return factor

    def _inertia(self) -> jax.Array:
        return sum((law.inertia() for law in self.laws), start=jnp.zeros(()))

    def _rubbing(self) -> jax.Array:
        return sum((law.rubbing() for law in self.laws), start=jnp.zeros(()))


class Rim(NamedTuple):
    """Travel [m] and speed [m/s] of the rim, and the memories of the fibre between it and the weight."""

    travel: jax.Array
    speed: jax.Array
    memories: Memories


class PulleyDriveState(NamedTuple):
    """Position u [m] and velocity [m/s] of the weight, up the slope; memories of the fibre, as far as a rim.

    The rim, the forces [N] in a mount that yields and of bristles, and the points of a fibre with a mass of its own are
    there only in a model that has them.
    """

    position: jax.Array
    velocity: jax.Array
    memories: Memories
    rim: Rim | None
    mount_force: jax.Array | None
    bristle: jax.Array | None
    chain: Any = None


class PulleyDriveMode(NamedTuple):
    """Modes of the fibre, as far as a rim; of the guide; of the fibre behind a rim; of its bearing; band of speed.

    Each is a (), and one for each segment of a fibre with a mass of its own; those that a model lacks are None.
    """

    fibre: jax.Array
    guide: jax.Array
    behind: Any
    bearing: Any
    band: Any
    chain: Any = None


class Side(NamedTuple):
    """Fibre on one side of the rim, or all of it: scaled to the whole length, so that the same laws hold."""

    length: jax.Array
    rate: jax.Array
    memories: Memories


class PulleyDrive(eqx.Module):
    """Weight, guide, fibre, pulley and drive as a switched system.

    Law
    ---
    ``m ü = c T_2 - m g sin α - guide``; stretch ``e = x - (ℓ(0) - ℓ(u))``, symmetric ``x - u``. With a rim
    ``e_1 = x - s``, ``e_2 = s - u`` and ``m_r s'' = T_1 - T_2 - bearing``. A mount that yields takes its share off x.

    Parameters
    ----------
    mass : () in kg
    pull_of_gravity : () in N, down the guide

    Source
    ------
    Polach and Václavík (docs/rigs.md), Figs 6-9.
    """

    mass: jax.Array
    pull_of_gravity: jax.Array
    fibre: Fibre
    guide: Guide
    path: Path
    pulley: Pulley
    mount: Mount

    def stiff(self) -> jax.Array | None:
        """Whether a rim, a mount, or friction that sets in over a short distance is there now."""
        return fast((*self.guide.laws, *self.pulley.laws, *self.mount.laws, *self.fibre.laws))

    def rigid_sides(self, state: PulleyDriveState, inputs: Any) -> tuple[Side, Side]:
        """Fibre before and behind the rim, twice the whole where no rim moves by itself; the mount does not yield."""
        x, x_rate = self.mount.travel(inputs["drive"], self.pulley.radius)
        y, cosine = self.path.follow(state.position)
        y_rate = cosine * state.velocity
        if state.rim is None:
            whole = Side(x - y, x_rate - y_rate, state.memories)
            return whole, whole
        there, far = self.pulley.turning(), 1.0 - self.pulley.near_share
        near = self._share()
        length = jnp.where(there, (x - state.rim.travel) / near, x - y)
        rate = jnp.where(there, (x_rate - state.rim.speed) / near, x_rate - y_rate)
        behind = Side((state.rim.travel - y) / far, (state.rim.speed - y_rate) / far, state.rim.memories)
        return Side(length, rate, state.memories), behind

    def sides(self, state: PulleyDriveState, mode: PulleyDriveMode, inputs: Any) -> tuple[Side, Side]:
        """Fibre before and behind the rim."""
        near, far = self.rigid_sides(state, inputs)
        if state.mount_force is not None:
            loaded = self._mount_is_loaded(mode)
            length = near.length - self.mount.compliance() * state.mount_force / self._share()
            creep = lambda: self.fibre.rate_under(state.mount_force, length, near.memories)  # noqa: E731
            rate = jax.lax.cond(loaded, creep, lambda: near.rate)
            near = Side(jnp.where(loaded, length, near.length), rate, near.memories)
        return near, far

    def tensions(
        self, near: Side, far: Side, state: PulleyDriveState, mode: PulleyDriveMode
    ) -> tuple[jax.Array, jax.Array]:
        """At the gauge on the drive, and behind the pulley, in N."""
        at_gauge = self.fibre.tension(*near, mode.fibre)
        if state.mount_force is not None:
            at_gauge = jnp.where(self._mount_is_loaded(mode), state.mount_force, at_gauge)
        if (chain := self._chain()) is not None:
            loads = chain.tensions(state.chain, mode.chain, *self._ends(state, near))
            at_gauge, whole = (jnp.where(chain.there(), load, at_gauge) for load in loads)
        else:
            whole = at_gauge
        if state.rim is None:
            return at_gauge, whole
        # What is not there is not computed: the laws of a fibre are the dearest part of a step.
        behind = lambda: self.fibre.tension(*far, mode.behind)  # noqa: E731
        return at_gauge, jax.lax.cond(self.pulley.turning(), behind, lambda: whole)

    def force(self, state: PulleyDriveState, mode: PulleyDriveMode, inputs: Any) -> jax.Array:
        """At the gauge on the drive, in N."""
        return self.tensions(*self.sides(state, mode, inputs), state, mode)[0]

    def stretch(self, state: PulleyDriveState, mode: PulleyDriveMode, inputs: Any) -> tuple[jax.Array, jax.Array]:
        """Stretch in m and its rate in m/s, of the fibre at the gauge as if it were the whole."""
        near, _ = self.sides(state, mode, inputs)
        return self.fibre.stretch(near.length), near.rate

    def derivative(self, state: PulleyDriveState, mode: PulleyDriveMode, inputs: Any) -> PulleyDriveState:
        """Rate of the state."""
        near, far = self.sides(state, mode, inputs)
        at_gauge, behind = self.tensions(near, far, state, mode)
        now, drive = self._sliding(state, behind)
        return PulleyDriveState(
            self.guide.speed(mode.guide, state.velocity),
            self.guide.net_force(drive, mode.guide, now) / self.mass,
            self.fibre.memory_rates(*near, mode.fibre),
            None if state.rim is None else self._rim_rate(state.rim, far, at_gauge - behind, mode),
            None if state.mount_force is None else self._mount_rate(state, near, mode, inputs),
            self.guide.bristle_rate(mode.guide, now),
            None
            if (chain := self._chain()) is None
            else chain.derivative(state.chain, mode.chain, *self._ends(state, near)),
        )

    def margins(self, state: PulleyDriveState, mode: PulleyDriveMode, inputs: Any) -> PulleyDriveMode:
        """Margins of each mode."""
        near, far = self.sides(state, mode, inputs)
        at_gauge, behind = self.tensions(near, far, state, mode)
        now, drive = self._sliding(state, behind)
        fibre = self.fibre.margin(*near, mode.fibre)
        if state.mount_force is not None:
            fibre = jnp.where(self._mount_is_loaded(mode), state.mount_force / self.fibre.stiffness, fibre)
        guide = self.guide.margin(drive, mode.guide, now)
        fibre_behind = bearing = None
        if state.rim is not None:
            there = self.pulley.turning()
            fibre_behind = jax.lax.cond(there, lambda: self.fibre.margin(*far, mode.behind), lambda: jnp.ones(()))
            if mode.bearing is not None:
                bearing = self.pulley.bearing().margin(at_gauge - behind, mode.bearing, _of_rim(state.rim))
                bearing = jnp.where(there, bearing, 1.0)
        band = band_margin(self._bent(), mode.band, state.velocity)
        segments = None
        if (chain := self._chain()) is not None:
            fibre = jnp.where(chain.there(), self.fibre.margin_of_length(near.length, mode.fibre), fibre)
            segments = chain.margins(state.chain, mode.chain, *self._ends(state, near))
        return PulleyDriveMode(fibre, guide, fibre_behind, bearing, band, segments)

    def switch(
        self, state: PulleyDriveState, mode: PulleyDriveMode, crossed: PulleyDriveMode, inputs: Any
    ) -> tuple[PulleyDriveState, PulleyDriveMode]:
        """State and mode after the switches `crossed`."""
        near, far = self.sides(state, mode, inputs)
        memories, taut = self.fibre.switch(*near, mode.fibre, crossed.fibre)
        velocity = self.guide.stop(mode.guide, crossed.guide, state.velocity)
        state = state._replace(memories=memories, velocity=velocity)
        if state.mount_force is not None:
            state = state._replace(mount_force=jnp.where(crossed.fibre, 0.0, state.mount_force))
        after = mode._replace(fibre=taut)
        if (chain := self._chain()) is not None:
            points, segments = chain.switch(state.chain, mode.chain, crossed.chain, *self._ends(state, near))
            state, after = state._replace(chain=points), after._replace(chain=segments)
        if state.rim is not None:
            memories, taut = self.fibre.switch(*far, mode.behind, crossed.behind)
            speed, after = state.rim.speed, after._replace(behind=taut)
            if mode.bearing is not None:
                speed = self.pulley.bearing().stop(mode.bearing, crossed.bearing, speed)
            state = state._replace(rim=Rim(state.rim.travel, speed, memories))
        after = after._replace(band=band_after(self._bent(), mode.band, state.velocity, crossed.band))
        return state, self._settle(state, after, crossed, inputs)

    def at_rest(self, tension: jax.Array, inputs: Any) -> tuple[PulleyDriveState, PulleyDriveMode]:
        """State and mode of a weight that rests under `tension`."""
        length = self.fibre.at_rest(tension)
        x = self.mount.travel(inputs["drive"], self.pulley.radius)[0] - self.mount.compliance() * tension
        memories, zero, none = self.fibre.memories(length), jnp.zeros(()), jnp.int32(0)
        position = self.path.position(x - length)
        rim = Rim(x - self._share() * length, zero, memories) if self.pulley.turns else None
        mount_force = tension + zero if self.mount.may_yield else None
        state = PulleyDriveState(position, zero, memories, rim, mount_force, None)
        now, drive = self._sliding(state, tension)
        state = state._replace(bristle=self.guide.bristle_at_rest(drive, now))
        taut = (tension > 0.0).astype(jnp.int32)
        behind, bearing = taut if self.pulley.turns else None, none if self.pulley.rubs else None
        mode = PulleyDriveMode(taut, none, behind, bearing, first_band(self._bent()))
        if (chain := self._chain()) is not None:
            ends = self._ends(state, Side(length, zero, memories))
            points = chain.at_rest(*ends)
            state, mode = state._replace(chain=points), mode._replace(chain=chain.modes(points, *ends))
        nowhere = jax.tree.map(lambda _: jnp.array(False), mode)
        return state, self._settle(state, mode, nowhere, inputs)

    def _chain(self) -> PointChain | None:
        return PointChain.of(self.fibre, jnp.zeros(()))

    def _ends(self, state: PulleyDriveState, near: Side) -> tuple[End, End]:
        """The fibre from the drive to the weight."""
        y, cosine = self.path.follow(state.position)
        far = End(-y, -cosine * state.velocity)
        return End(far.place - near.length, far.rate - near.rate), far

    def _bent(self) -> tuple[Effect, ...]:
        return (*self.guide.laws, *self.pulley.laws)

    def _share(self) -> jax.Array:
        """Share of the fibre that `near` stands for."""
        if not self.pulley.turns:
            return jnp.ones(())
        return jnp.where(self.pulley.turning(), self.pulley.near_share, 1.0)

    def _mount_is_loaded(self, mode: PulleyDriveMode) -> jax.Array:
        return (self.mount.compliance() > 0.0) & (mode.fibre == LOADED)

    def _sliding(self, state: PulleyDriveState, behind: jax.Array) -> tuple[Sliding, jax.Array]:
        """What the guide feels, and the force on the weight besides the guide's, in N."""
        felt = behind * self.pulley.grip(state.velocity)
        drive = felt * self.path.follow(state.position)[1] - self.pull_of_gravity
        return Sliding(state.position, state.velocity, felt, state.bristle), drive

    def _rim_rate(self, rim: Rim, far: Side, net: jax.Array, mode: PulleyDriveMode) -> Rim:
        moves = there = self.pulley.turning()
        if mode.bearing is not None:
            net = self.pulley.bearing().net_force(net, mode.bearing, _of_rim(rim))
            moves = there & (mode.bearing != 0)
        speed, acceleration = jnp.where(moves, rim.speed, 0.0), jnp.where(there, net / self.pulley.mass(), 0.0)
        rates = lambda: self.fibre.memory_rates(*far, mode.behind)  # noqa: E731
        return Rim(speed, acceleration, jax.lax.cond(there, rates, lambda: jax.tree.map(jnp.zeros_like, rim.memories)))

    def _mount_rate(self, state: PulleyDriveState, near: Side, mode: PulleyDriveMode, inputs: Any) -> jax.Array:
        """What the mount gives way, the fibre need not stretch."""
        loaded = self._mount_is_loaded(mode)
        gives = self._share() * (self.rigid_sides(state, inputs)[0].rate - near.rate)
        return jnp.where(loaded, gives / jnp.where(loaded, self.mount.compliance(), 1.0), 0.0)

    def _settle(
        self, state: PulleyDriveState, mode: PulleyDriveMode, crossed: PulleyDriveMode, inputs: Any
    ) -> PulleyDriveMode:
        """Mode with what has stopped, or was at rest, at rest or set in motion."""
        at_gauge, behind = self.tensions(*self.sides(state, mode, inputs), state, mode)
        now, drive = self._sliding(state, behind)
        mode = mode._replace(guide=self.guide.settle(drive, mode.guide, crossed.guide, now))
        if state.rim is None or mode.bearing is None:
            return mode
        bearing, net = self.pulley.bearing(), at_gauge - behind
        return mode._replace(bearing=bearing.settle(net, mode.bearing, crossed.bearing, _of_rim(state.rim)))


def _of_rim(rim: Rim) -> Sliding:
    return Sliding(rim.travel, rim.speed, jnp.zeros(()))


SMOOTHING = 0.020
"""Window in s over which positions are differentiated."""
SLIDES = 0.02
"""Speed in m/s from which the weight is taken to slide."""
FIRST = 0.25
"""Length in s of motion that the guesses can be trusted to predict."""
REST = RestAsked(
    called="rest",
    expected="a rest before the drive starts, from which tension and zero are found",
    moves="the rig moves from the first sample",
    do="Let the record begin earlier, with a rest of some hundred samples, or cut it so that it begins at one.",
    masked="Set the range of the {channel} sensor so that it reads the rest; fibrefit inspect says what was masked.",
)


def _starting(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Rests give tension and zero, loads the fibre, sliding the friction."""
    still = [first_rest(trace, REST) for trace in traces]
    places, tensions = (
        np.array([mean_at_rest(trace, channel, rest, REST) for trace, rest in zip(traces, still, strict=True)])
        for channel in ("position", "force")
    )
    # Wherever the fibre carries load: force over stretch and its rate.
    loads = []
    for trace, rest, place, tension in zip(traces, still, places, tensions, strict=True):
        drive, position, measured = trace.inputs["drive"], trace.channels["position"], trace.channels["force"]
        stretch = (drive[:, 0] - drive[rest, 0].mean()) - (position - place)
        rate, force = drive[:, 1] - _derivative(trace, 1), measured - tension
        loaded = (measured > 0.15 * np.nanmax(measured)) & np.isfinite(force + rate + stretch)
        loads.append((stretch[loaded], rate[loaded], force[loaded]))
    got = "the force does not grow as the fibre is stretched"
    expected = "a force that grows as the drive takes fibre in"
    do = "Check the sign and unit of the force, position and drive channels."
    stiffness, damping = spring_and_damper(loads, DataError(traces[0].name, got, expected, do))
    zeros = [
        place - np.mean(t.inputs["drive"][rest, 0]) + tension / stiffness
        for t, rest, place, tension in zip(traces, still, places, tensions, strict=True)
    ]
    begins = np.array([_begins(trace, rest) for trace, rest in zip(traces, still, strict=True)])
    # While the weight slides: the mean of what opposes it besides gravity and inertia.
    opposed, weight = [], 0.0
    for trace in traces:
        mass = trace.conditions["weight_mass"] + trace.conditions["added_mass"]
        weight = mass * STANDARD_GRAVITY
        velocity, acceleration = _derivative(trace, 1), _derivative(trace, 2)
        driving = trace.channels["force"] - weight * np.sin(trace.conditions["inclination"]) - mass * acceleration
        slides = np.abs(velocity) > SLIDES
        opposed.append((np.sign(velocity) * driving)[slides & np.isfinite(driving)])
    friction = float(np.mean(np.concatenate(opposed))) if any(len(part) for part in opposed) else 0.0
    return Starting(
        shared={"stiffness": stiffness, "damping": damping, "friction": max(friction, 0.01 * weight)},
        each={"position_zero": np.array(zeros), "start_tension": tensions},
        moving=begins,
        settled=begins + FIRST,
        spread={"stiffness": 1.5, "damping": 5.0, "friction": 3.0},
        # Every stroke brings new contacts to time: longer horizons than a single drop needs.
        horizons=((1.0, 2.5, 5.0), (2.0, 4.0, 8.0)),
    )


def _begins(trace: Trace, rest: slice) -> float:
    drive = trace.inputs["drive"][:, 0]
    away = np.abs(drive - drive[rest].mean()) > max(DRIVE_BEGINS * drive[rest].std(), DRIVE_STANDS)
    if not away.any():
        got, expected = "the drive does not move", "a motion that stretches the fibre"
        raise DataError(trace.name, got, expected, "Check the drive channel.")
    return float(trace.times[int(np.argmax(away))])


def _derivative(trace: Trace, order: int) -> np.ndarray:
    position = trace.channels["position"]
    found = derivative(position, trace.times, SMOOTHING, order, degree=3)
    return np.where(np.isfinite(position), found, np.nan)


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> PulleyDrive:
    """System of one record."""
    mass = conditions["weight_mass"] + conditions["added_mass"]
    return PulleyDrive(
        mass=mass,
        pull_of_gravity=mass * STANDARD_GRAVITY * jnp.sin(conditions["inclination"]),
        fibre=Fibre(values["stiffness"], values["damping"], laws_of(FibreLaw, laws), tension_law),
        guide=Guide(values["friction"], laws_of(GuideLaw, laws)),
        path=Path(conditions["lateral_offset"], conditions["guide_distance"]),
        pulley=Pulley(
            0.5 * conditions["pulley_diameter"],
            conditions["wrap_angle"],
            conditions["near_share"],
            laws_of(PulleyLaw, laws),
        ),
        mount=Mount(laws_of(DriveLaw, laws)),
    )


def _start(system: PulleyDrive, values: Values, conditions: Values, inputs: Any) -> Start:
    """The weight rests under the `start_tension`, or if it is not given, as if there were no friction."""
    balance = system.pull_of_gravity / system.path.follow(jnp.zeros(()))[1]
    return Start(*system.at_rest(values.get("start_tension", balance), inputs))


def _drawn_up(conditions: Mapping[str, float], position: np.ndarray) -> Pull:
    """The fibre draws the weight up the slope, as far as it lies along it; gravity draws it down.

    Parameters
    ----------
    position : (n_time,) in m
    """
    mass, offset = conditions["weight_mass"] + conditions["added_mass"], conditions["lateral_offset"]
    along = conditions["guide_distance"] - position
    lever = along / np.hypot(along, offset) if offset else np.ones(len(position))
    return Pull(mass, -STANDARD_GRAVITY * float(np.sin(conditions["inclination"])), lever)


def _planned(conditions: Mapping[str, float]) -> dict[str, float]:
    """Tension that holds the weight where it begins, without friction, in N: more than its pull if the fibre slants."""
    pull = _drawn_up(conditions, np.zeros(1))
    return {"start_tension": float(-pull.mass * pull.gravity / pull.lever[0])}


PULLEY_DRIVE = Rig(
    kind="pulley_drive",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness of the fibre", 2e4, lower=10.0, upper=1e7, log=True),
        Parameter("damping", "N s/m", "damping of the fibre", 25.0, lower=0.0, upper=1e4),
        Parameter("friction", "N", "Coulomb friction between weight and guide", 4.0, lower=0.0, upper=1e3),
    ),
    nuisances=(
        Parameter("position_zero", "m", "reading of the position channel where the whole fibre is just taut", 1e-3),
        Parameter("start_tension", "N", "tension of the fibre before the drive moves", 20.0, lower=0.0, upper=1e5),
    ),
    conditions=(
        Parameter("weight_mass", "kg", "mass of the weight", math.nan, lower=0.0),
        Parameter("added_mass", "kg", "mass added to the weight", 0.0, lower=0.0),
        Parameter("inclination", "rad", "slope of the guide", math.nan, lower=0.0, upper=math.pi / 2),
        Parameter("pulley_diameter", "m", "diameter of the pulley", 0.08, lower=0.0),
        Parameter("wrap_angle", "rad", "angle over which the fibre lies on the pulley", math.radians(150.0), lower=0.0),
        Parameter("near_share", "-", "share of the fibre between drive and pulley", 0.5, lower=0.0, upper=1.0),
        Parameter("lateral_offset", "m", "distance of the weight from the plane of the pulley", 0.0, lower=0.0),
        Parameter("guide_distance", "m", "distance along the guide to the foot of the pulley", 0.9, lower=0.0),
    ),
    capabilities=frozenset(
        {Capability.FIBRE, Capability.GUIDE, Capability.PULLEY, Capability.DRIVE, Capability.INCLINE, Capability.PLACE}
    ),
    channels=("force", "position"),
    inputs=("drive",),
    build=_build,
    start=_start,
    observe=lambda system, state, mode, inputs: {
        "force": system.force(state, mode, inputs),
        "position": state.position,
    },
    fibres=lambda system, state, mode, inputs: (system.stretch(state, mode, inputs),),
    starting=_starting,
    pulled=_drawn_up,
    planned=_planned,
    directions=("up", "down"),
    further=(Variation("added_mass", onto="weight_mass"), Variation("inclination")),
)
