"""The inverted pendulum: a rod on a pivot, held upright and driven by two fibres whose far ends move together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.core.errors import DataError
from fibrefit.laws.law import Effect, FibreLaw, fast, laws_of
from fibrefit.rigs.parts.fibre import ChainState, End, Fibre, Memories, PointChain, spring_and_damper
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Rig, Start, Starting, Stated, Values
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.trace import Trace


class InvertedPendulumState(NamedTuple):
    """Angle φ [rad] from upright, towards the first fibre, and its rate [rad/s]; memories of both fibres.

    Points of both fibres where the model gives them a mass.
    """

    angle: jax.Array
    rate: jax.Array
    memories_1: Memories
    memories_2: Memories
    chain_1: Any = None
    chain_2: Any = None


class InvertedPendulumMode(NamedTuple):
    """Modes of the two fibres, and of their segments where they have any.

    A fibre with segments of its own is only known to be longer than its free length or not.
    """

    fibre_1: jax.Array
    fibre_2: jax.Array
    chain_1: Any = None
    chain_2: Any = None


class Leg(NamedTuple):
    """One fibre as the pendulum has it now: length beyond the free one [m], its rate [m/s], lever of its pull [m]."""

    length: jax.Array
    rate: jax.Array
    lever: jax.Array


class InvertedPendulum(eqx.Module):
    """Rod and fibres as a switched system.

    Law
    ---
    ``I φ'' = F_1 d sin α_1 - F_2 d sin α_2 + m g (l/2) sin φ``, ``sin α_1 = (a + x) cos φ / l_1``,
    ``sin α_2 = (a - x) cos φ / l_2``, ``l_{1,2}² = (d cos φ)² + (a ± x ∓ d sin φ)²``; free length
    ``sqrt(a² + d²) - N/k``.

    Parameters
    ----------
    moment_of_inertia : () in kg m^2, about the pivot
    tipping : () in N m, m g l/2
    height : () in m
        d, from the pivot to where the fibres are attached.
    distance : () in m
        a, from the pivot to each driven end.
    preload : () in N
        N, of both fibres where the rod stands upright and the drive is in the middle.
    fibre : Fibre
        Both are alike.

    Source
    ------
    Polach and Václavík (docs/rigs.md), eqs (1)-(4), Fig. 1.
    """

    moment_of_inertia: jax.Array
    tipping: jax.Array
    height: jax.Array
    distance: jax.Array
    preload: jax.Array
    fibre: Fibre

    def stiff(self) -> jax.Array | None:
        """Whether a law of the fibres is fast against the sampling."""
        return fast(self.fibre.laws)

    def leg(self, side: float, angle: jax.Array, rate: jax.Array, drive: Any) -> Leg:
        """The fibre on one side: +1 the first, -1 the second."""
        x, x_rate = drive
        reach = self.distance + side * x
        across, up = reach - side * self.height * jnp.sin(angle), self.height * jnp.cos(angle)
        length, shortness = _root(across**2 + up**2)
        lever = reach * up * shortness
        upright = _root(self.distance**2 + self.height**2)[0]
        slack = self.preload / self.fibre.stiffness
        return Leg(length - upright + slack, side * (across * x_rate * shortness - lever * rate), lever)

    def legs(self, state: InvertedPendulumState, inputs: Any) -> tuple[Leg, Leg]:
        """Both fibres."""
        first, second = (self.leg(side, state.angle, state.rate, inputs["drive"]) for side in (1.0, -1.0))
        return first, second

    def tensions(
        self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any
    ) -> tuple[jax.Array, jax.Array]:
        """Tension of each fibre where it is driven, in N: what its gauge feels."""
        first, second = self._loads(state, mode, inputs)
        return first[0], second[0]

    def derivative(
        self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any
    ) -> InvertedPendulumState:
        """Rate of the state."""
        first, second = self.legs(state, inputs)
        (_, pull_1), (_, pull_2) = self._loads(state, mode, inputs)
        moment = pull_1 * first.lever - pull_2 * second.lever + self.tipping * jnp.sin(state.angle)
        return InvertedPendulumState(
            state.rate,
            moment / self.moment_of_inertia,
            self.fibre.memory_rates(first.length, first.rate, state.memories_1, mode.fibre_1),
            self.fibre.memory_rates(second.length, second.rate, state.memories_2, mode.fibre_2),
            self._chain_rate(state.chain_1, mode.chain_1, self._ends(1.0, first, inputs)),
            self._chain_rate(state.chain_2, mode.chain_2, self._ends(-1.0, second, inputs)),
        )

    def margins(self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any) -> InvertedPendulumMode:
        """Margins of each mode."""
        first, second = self.legs(state, inputs)
        plain = InvertedPendulumMode(
            self.fibre.margin(first.length, first.rate, state.memories_1, mode.fibre_1),
            self.fibre.margin(second.length, second.rate, state.memories_2, mode.fibre_2),
        )
        if (chain := self._chain()) is None:
            return plain
        there = chain.there()
        return InvertedPendulumMode(
            jnp.where(there, self.fibre.margin_of_length(first.length, mode.fibre_1), plain.fibre_1),
            jnp.where(there, self.fibre.margin_of_length(second.length, mode.fibre_2), plain.fibre_2),
            chain.margins(state.chain_1, mode.chain_1, *self._ends(1.0, first, inputs)),
            chain.margins(state.chain_2, mode.chain_2, *self._ends(-1.0, second, inputs)),
        )

    def switch(
        self, state: InvertedPendulumState, mode: InvertedPendulumMode, crossed: InvertedPendulumMode, inputs: Any
    ) -> tuple[InvertedPendulumState, InvertedPendulumMode]:
        """State and mode after the switches `crossed`."""
        first, second = self.legs(state, inputs)
        memories_1, mode_1 = self.fibre.switch(
            first.length, first.rate, state.memories_1, mode.fibre_1, crossed.fibre_1
        )
        memories_2, mode_2 = self.fibre.switch(
            second.length, second.rate, state.memories_2, mode.fibre_2, crossed.fibre_2
        )
        state = state._replace(memories_1=memories_1, memories_2=memories_2)
        after = InvertedPendulumMode(mode_1, mode_2)
        if (chain := self._chain()) is None:
            return state, after
        ends = self._ends(1.0, first, inputs), self._ends(-1.0, second, inputs)
        points_1, segments_1 = chain.switch(state.chain_1, mode.chain_1, crossed.chain_1, *ends[0])
        points_2, segments_2 = chain.switch(state.chain_2, mode.chain_2, crossed.chain_2, *ends[1])
        return state._replace(chain_1=points_1, chain_2=points_2), after._replace(
            chain_1=segments_1, chain_2=segments_2
        )

    def begin(
        self, angle: jax.Array, rate: jax.Array, inputs: Any
    ) -> tuple[InvertedPendulumState, InvertedPendulumMode]:
        """State and mode of a pendulum that has stood still and is now at `angle` [rad] with `rate` [rad/s]."""
        first, second = (self.leg(side, angle, rate, inputs["drive"]) for side in (1.0, -1.0))
        chain = self._chain()
        chains: list[Any] = [None, None]
        if chain is not None:
            still = [leg._replace(rate=jnp.zeros(())) for leg in (first, second)]
            at_rest = {"drive": (inputs["drive"][0], jnp.zeros(()))}
            sides = zip((1.0, -1.0), still, strict=True)
            chains = [chain.at_rest(*self._ends(side, leg, at_rest)) for side, leg in sides]
        memories = self.fibre.memories(first.length), self.fibre.memories(second.length)
        state = InvertedPendulumState(angle, rate, *memories, *chains)
        return state, self.mode_of(state, inputs)

    def mode_of(self, state: InvertedPendulumState, inputs: Any) -> InvertedPendulumMode:
        """The mode a state is in by itself, without what was before."""
        first, second = self.legs(state, inputs)
        mode = InvertedPendulumMode(
            self.fibre.mode_of(first.length, first.rate, state.memories_1),
            self.fibre.mode_of(second.length, second.rate, state.memories_2),
        )
        if (chain := self._chain()) is None:
            return mode
        ends = self._ends(1.0, first, inputs), self._ends(-1.0, second, inputs)
        return mode._replace(chain_1=chain.modes(state.chain_1, *ends[0]), chain_2=chain.modes(state.chain_2, *ends[1]))

    def _chain(self) -> PointChain | None:
        return PointChain.of(self.fibre, jnp.zeros(()))

    def _ends(self, side: float, leg: Leg, inputs: Any) -> tuple[End, End]:
        """A fibre from its driven end to the rod, along the line it has where the rod stands upright."""
        x, x_rate = inputs["drive"]
        share = -side * self.distance * _root(self.distance**2 + self.height**2)[1]
        near = End(share * x, share * x_rate)
        return near, End(near.place + leg.length, near.rate + leg.rate)

    def _loads(self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any) -> Any:
        """Pair of tensions of each fibre, at its driven end and at the rod, in N."""
        first, second = self.legs(state, inputs)
        one = self.fibre.tension(first.length, first.rate, state.memories_1, mode.fibre_1)
        two = self.fibre.tension(second.length, second.rate, state.memories_2, mode.fibre_2)
        chain = self._chain()
        if chain is None:
            return (one, one), (two, two)
        loads_1 = chain.tensions(state.chain_1, mode.chain_1, *self._ends(1.0, first, inputs))
        loads_2 = chain.tensions(state.chain_2, mode.chain_2, *self._ends(-1.0, second, inputs))
        there = chain.there()
        with_mass = lambda loads, plain: tuple(jnp.where(there, load, plain) for load in loads)  # noqa: E731
        return with_mass(loads_1, one), with_mass(loads_2, two)

    def _chain_rate(self, state: Any, modes: Any, ends: tuple[End, End]) -> ChainState | None:
        chain = self._chain()
        return None if chain is None else chain.derivative(state, modes, *ends)


def _root(square: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Root of a number, and its inverse.

    The compiler may or may not turn a division by a root into a product, as the rest of a program suggests: an effect
    that is zero would then change the last bits.
    """
    inverse = jax.lax.rsqrt(square)
    return square * inverse, inverse


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> InvertedPendulum:
    """System of one record."""
    return InvertedPendulum(
        moment_of_inertia=conditions["moment_of_inertia"],
        tipping=0.5 * conditions["rod_mass"] * STANDARD_GRAVITY * conditions["rod_length"],
        height=conditions["attachment_height"],
        distance=conditions["anchor_distance"],
        preload=conditions["preload"],
        fibre=Fibre(values["stiffness"], values["damping"], laws_of(FibreLaw, laws), tension_law),
    )


SMOOTH = 0.008
"""Length in s of the stretches over which the angle is taken for a parabola."""
SURELY_TAUT = 0.1
"""Share of the largest force above which a fibre is surely taut."""
HORIZON = 0.25
"""Time in s that the guesses are trusted to predict."""


def _starting(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Stiffness and damping by least squares wherever a fibre carries load; the start from the first samples."""
    loads, starts = [], []
    for trace in traces:
        angle, rate = (derivative(trace.channels["angle"], trace.times, SMOOTH, order) for order in (0, 1))
        starts.append((angle[0], rate[0]))
        a, d = trace.conditions["anchor_distance"], trace.conditions["attachment_height"]
        x, x_rate = trace.inputs["drive"][:, 0], trace.inputs["drive"][:, 1]
        for side, role in ((1.0, "force_1"), (-1.0, "force_2")):
            # Length of the fibre beyond that upright, and its rate.
            across, up = a + side * (x - d * np.sin(angle)), d * np.cos(angle)
            length = np.hypot(across, up)
            speed = side * (across * x_rate - (a + side * x) * up * rate) / length
            force = trace.channels[role]
            taut = (force > SURELY_TAUT * np.nanmax(force)) & (force > 0.0)
            loads.append(((length - np.hypot(a, d))[taut], speed[taut], force[taut] - trace.conditions["preload"]))
    got = "the forces do not grow as the fibres are stretched"
    expected = "an angle that grows towards the first fibre, and a drive that draws at it"
    do = "Check the signs and units of angle, drive and forces."
    stiffness, damping = spring_and_damper(loads, DataError(traces[0].name, got, expected, do))
    begin, end = (np.array([trace.times[i] for trace in traces]) for i in (0, -1))
    angles, rates = (np.array(values) for values in zip(*starts, strict=True))
    return Starting(
        shared={"stiffness": stiffness, "damping": damping},
        each={"start_angle": angles, "start_rate": rates},
        moving=begin,
        settled=np.minimum(begin + HORIZON, end),
        spread={"stiffness": 1.5, "damping": 4.0},
        horizons=((1.0, 3.0), (2.0, 6.0)),
    )


INVERTED_PENDULUM = Rig(
    kind="inverted_pendulum",
    parameters=(
        Parameter("stiffness", "N/m", "stiffness of each fibre", 8e3, lower=10.0, upper=1e7, log=True),
        Parameter("damping", "N s/m", "damping of each fibre", 4.0, lower=0.0, upper=1e4),
    ),
    nuisances=(
        Parameter("start_angle", "rad", "angle of the pendulum at the first sample", 0.05),
        Parameter("start_rate", "rad/s", "angular velocity of the pendulum at the first sample", 0.5),
    ),
    conditions=(
        Parameter("rod_length", "m", "length of the pendulum", math.nan, lower=0.0),
        Parameter("rod_mass", "kg", "mass of the pendulum", math.nan, lower=0.0),
        Parameter("moment_of_inertia", "kg m^2", "moment of inertia about the pivot", math.nan, lower=0.0),
        Parameter(
            "attachment_height", "m", "distance from the pivot to where the fibres are attached", math.nan, lower=0.0
        ),
        Parameter("anchor_distance", "m", "distance from the pivot to each driven end", math.nan, lower=0.0),
        Parameter("preload", "N", "tension of both fibres where the rod stands upright", 0.0, lower=0.0),
    ),
    capabilities=frozenset({Capability.FIBRE, Capability.TAUT_POINT}),
    channels=("angle", "force_1", "force_2"),
    inputs=("drive",),
    build=_build,
    # The pendulum is where it is at the first sample; unless said, upright and at rest.
    start=lambda system, values, _, inputs: Start(
        *system.begin(values.get("start_angle", jnp.zeros(())), values.get("start_rate", jnp.zeros(())), inputs)
    ),
    observe=lambda system, state, mode, inputs: (
        {"angle": state.angle} | dict(zip(("force_1", "force_2"), system.tensions(state, mode, inputs), strict=True))
    ),
    fibres=lambda system, state, mode, inputs: tuple(
        (system.fibre.stretch(leg.length), leg.rate) for leg in system.legs(state, inputs)
    ),
    starting=_starting,
)
