"""What the validation hides, and in which series: every release draws cases that no one has seen before.

A case follows from the label of a release, its kind, its rig and its number alone, by way of a hash. A new label gives
new seeds for everything that is drawn: fibre and guide, shape and sign of effects, releases, noise.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.independent.laws import CATALOGUE, DRIVE, DROP, EFFECTS, applicable
from tests.independent.make import write_study
from tests.independent.noncentrality import Hidden, Ideal, strength_for
from tests.independent.series import Series, draw_shape, scattered, take
from tests.independent.simulate import simulate
from tests.validation.designs import (
    NOISES,
    NOISES_OF_INTERVALS,
    SCATTERS,
    SCATTERS_OF_INTERVALS,
    TUNING_DESIGN,
    USUAL_DESIGN,
    Design,
    noise_of,
)

RIGS = (DROP, DRIVE)
KINDS = ("null", "faint", "outside", "pair", "triple")
STRENGTHS = (30, 60, 120, 500)
"""Noncentralities of the faint effects."""
SEVERAL = (200.0, 1000.0)
"""Range of the noncentralities of each of two or three effects, the others being in the model."""
OUTSIDE = (500.0, 5000.0)
EFFECTS_OF_A_RELEASE = 8
NOT_HIDDEN = {
    "guide.asymmetric_viscous_friction",  # makes no sense without another effect
    "pulley.bearing_friction",  # comes with a rim whose own trace is far from faint
}
NOT_HIDDEN_IN = {
    DROP: NOT_HIDDEN,
    # Point masses are not sought over a pulley; bristles as stiff as to be faint there are past the simulator.
    DRIVE: NOT_HIDDEN | {"fibre.mass", "guide.presliding", "drive.compliance"},
}
TRIES = 8
ENOUGH = 0.9
"""Of the noncentrality wanted: where an effect cannot reach it, another one is taken."""

CLASSES: tuple[frozenset[str], ...] = (
    frozenset({"sensor.force_delay", "sensor.force_lag", "sensor.gauge_resonance"}),
    frozenset({"sensor.force_offset", "sensor.force_drift"}),
    frozenset({"pulley.capstan_friction", "guide.load_dependent_friction"}),
    frozenset({"sensor.force_gain", "study.weight_mass"}),  # stiffness, damping and friction grow with either
)
"""Effects that records of the usual kind separate badly, whatever is done with them."""


def class_of(effect: str) -> frozenset[str]:
    """Effects that an effect is not told apart from in records of the usual kind; itself among them."""
    return next((members for members in CLASSES if effect in members), frozenset({effect}))


class Made(NamedTuple):
    """A series and what is known of it.

    Parameters
    ----------
    series : with its records
    noncentralities : by effect, each with all the others in the model
    """

    series: Series
    noncentralities: dict[str, float]

    def gap_of_truth(self, step: float) -> float:
        """Gap that the true law leaves on a record predicted from others: with base values that all of them share.

        Parameters
        ----------
        step : of the simulator, s
        """
        squares = []
        for record in self.series.records:
            shared = simulate(record.conditions, self.series.base, self.series.effects, record.clean.times, step)
            predicted = shared._replace(position=shared.position + record.zero)
            for channel in ("force", "position"):
                logged, clean, other = (getattr(one, channel) for one in (record.logged, record.clean, predicted))
                squares.append(np.nanmean((logged - other) ** 2) / np.nanmean((logged - clean) ** 2))
        return float(np.sqrt(np.mean(squares)))


@dataclass(frozen=True)
class Case:
    """One series of the validation.

    Parameters
    ----------
    release : label
    kind : one of `KINDS`, or "interval"
    rig : one of `RIGS`
    index : number among those of its release, kind and rig
    noise : one of `NOISES`
    scatter : relative standard deviation of the base parameters between records
    strength : noncentrality wanted of each hidden effect; 0 where it is drawn or nothing is hidden
    first : the effect that is hidden if it can be; "" where effects are drawn
    tuning : whether it is of the tuning set
    """

    release: str
    kind: str
    rig: str
    index: int
    noise: str
    scatter: float
    strength: float = 0.0
    first: str = ""
    tuning: bool = False

    @property
    def name(self) -> str:
        """Tells a case from every other one."""
        part = "tuning" if self.tuning else "release"
        what = f"{self.first or self.kind}{f'/{self.strength:g}' if self.strength else ''}"
        return f"{part} {self.release}/{self.kind}/{self.rig}/{self.index}/{what}/{self.noise}/{100 * self.scatter:g} %"

    @property
    def seed(self) -> int:
        """Of all that is drawn."""
        return seed_of("tuning" if self.tuning else "release", self.release, self.kind, self.rig, str(self.index))

    @property
    def design(self) -> Design:
        """How its records are taken."""
        return TUNING_DESIGN if self.tuning else USUAL_DESIGN

    def make(self) -> Made:
        """Find the strengths of what is hidden and take the records."""
        rng = np.random.default_rng(self.seed)
        base, noise = self.design.base(rng), noise_of(self.noise, rng)
        ideal = Ideal(self.design.plans(self.rig, rng), base, noise, self.scatter)
        found = hidden_in(self, ideal, rng)
        effects = {one.name: one.values(base.stiffness) for one in found.hidden}
        zero = rng.uniform(-3e-4, 3e-4) if self.rig == DROP else 0.0
        records = tuple(
            take(plan, scattered(base, rng, self.scatter), effects, zero, noise, rng, self.design.step)
            for plan in ideal.plans
        )
        return Made(Series(self.rig, base, effects, records, records[0], None, self.seed), found.noncentralities)

    def write(self, folder: Path) -> Made:
        """Make the series and write its records and its study, without the truth."""
        made = self.make()
        write_study(made.series, folder)
        return made


def seed_of(*words: str) -> int:
    """A seed out of words: other words, another seed."""
    return int.from_bytes(hashlib.sha256("\n".join(words).encode()).digest()[:8], "big")


def cases(release: str, kind: str, rig: str, *, tuning: bool = False) -> Iterator[Case]:
    """All cases of a kind, without end; any first few hold something of everything."""
    names = effects_of(release, kind, rig)
    for i in itertools.count():
        rng = np.random.default_rng(seed_of("plan", str(tuning), release, kind, rig, str(i)))
        noise, scatter = str(rng.choice(NOISES)), float(rng.choice(SCATTERS))
        strength, first = 0.0, ""
        if kind == "null":
            noise, scatter = NOISES[i % len(NOISES)], SCATTERS[i // len(NOISES) % len(SCATTERS)]
        elif kind == "faint":
            turn = i // len(STRENGTHS)
            strength, first = float(STRENGTHS[i % len(STRENGTHS)]), names[turn % len(names)]
        elif kind == "outside":
            first, strength = names[i % len(names)], round(_between(OUTSIDE, rng))
        yield Case(release, kind, rig, i, noise, scatter, strength, first, tuning)


def interval_cases(release: str, rig: str, noise: str, scatter: float, *, tuning: bool = False) -> Iterator[Case]:
    """Series in which nothing is hidden, of one noise and scatter, for the intervals of a fit."""
    if noise not in NOISES_OF_INTERVALS or scatter not in SCATTERS_OF_INTERVALS:
        raise ValueError(f"noise is one of {NOISES_OF_INTERVALS}, scatter one of {SCATTERS_OF_INTERVALS}")
    # A number that no other combination has, nor had before there were further kinds of noise.
    kind, spread = NOISES_OF_INTERVALS.index(noise), SCATTERS_OF_INTERVALS.index(scatter)
    set_of, kind = divmod(kind, len(NOISES))
    first = 10_000 * (kind + len(NOISES) * (spread + set_of * len(SCATTERS_OF_INTERVALS)))
    for i in itertools.count(first):
        yield Case(release, "interval", rig, i, noise, scatter, tuning=tuning)


def effects_of(release: str, kind: str, rig: str) -> tuple[str, ...]:
    """Effects a release hides: eight for the faint ones, drawn anew each time; all causes outside the catalogue."""
    outside = kind == "outside"
    names = [name for name in applicable(rig, outside=outside) if name not in NOT_HIDDEN_IN[rig]]
    order = np.random.default_rng(seed_of("effects", release, kind, rig)).permutation(len(names))
    drawn = tuple(names[i] for i in order)
    return drawn if outside else drawn[:EFFECTS_OF_A_RELEASE]


def _between(limits: tuple[float, float], rng: np.random.Generator) -> float:
    return math.exp(rng.uniform(*np.log(limits)))


class Drawn(NamedTuple):
    """What is hidden in a series, and how far each by itself is from being nothing."""

    hidden: tuple[Hidden, ...]
    noncentralities: dict[str, float]


def hidden_in(case: Case, ideal: Ideal, rng: np.random.Generator) -> Drawn:
    """Effects of a case at the strengths it asks for."""
    number = {"pair": 2, "triple": 3}.get(case.kind, 1)
    if case.kind in ("null", "interval"):
        return Drawn((), {})
    if number == 1:
        found = strength_for(ideal, _guess(case.first, rng), case.strength)
        return Drawn((found.hidden,), {case.first: found.noncentrality})
    names = [name for name in applicable(case.rig) if name not in NOT_HIDDEN_IN[case.rig]]
    for _ in range(TRIES):
        several = _several(ideal, _apart(names, number, rng), rng)
        if several is not None:
            return several
    raise RuntimeError(f"{case.name}: no {number} effects that can be told apart in {TRIES} draws")


def _guess(name: str, rng: np.random.Generator) -> Hidden:
    sign = -1.0 if EFFECTS[name].signed and rng.random() < 0.5 else 1.0
    return Hidden(name, 0.1 * sign, draw_shape(name, rng))


def _apart(names: list[str], number: int, rng: np.random.Generator) -> list[str]:
    """Effects of different classes that the simulator can have together."""
    alone = {"fibre.mass", "drive.compliance"}
    while True:
        drawn = [str(name) for name in rng.choice(names, number, replace=False)]
        law = [name for name in drawn if name.startswith(("fibre.", "pulley.", "drive."))]
        locked = {"pulley.capstan_friction", "pulley.inertia"} <= set(drawn)
        crowded = len(law) > 1 and alone & set(law)
        # Point masses are simulated on a symmetric rig without bristles.
        crowded = crowded or ("fibre.mass" in drawn and "guide.presliding" in drawn)
        if len({class_of(name) for name in drawn}) == number and not locked and not crowded:
            return drawn


def _several(ideal: Ideal, names: list[str], rng: np.random.Generator) -> Drawn | None:
    """Effects each of which has its noncentrality although the others are in the model; None where one cannot."""
    wanted = [_between(SEVERAL, rng) for _ in names]
    found = [_guess(name, rng) for name in names]
    reached = [0.0] * len(names)
    # What the others do to an effect depends on their shapes alone, unless they are sensors: one round mostly does.
    for _ in range(2):
        for i, goal in enumerate(wanted):
            others = [*found[:i], *found[i + 1 :]]
            found[i], reached[i] = strength_for(ideal, found[i], goal, known=others)
    if any(got < ENOUGH * goal for got, goal in zip(reached, wanted, strict=True)):
        return None
    # Where effects imitate each other, strengths that part them may leave nothing of a usual rig.
    if any(abs(one.strength) > 0.5 * CATALOGUE[one.name].most for one in found):
        return None
    return Drawn(tuple(found), dict(zip(names, reached, strict=True)))
