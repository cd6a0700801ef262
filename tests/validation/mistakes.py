"""Series in which the rig is complete and what the study says of it is not true."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.independent.laws import DROP
from tests.independent.make import write_study
from tests.independent.series import Plan, Recording, Series, scattered, take
from tests.independent.simulate import Base
from tests.validation.cases import RIGS, seed_of
from tests.validation.designs import NOISES, SCATTERS, USUAL_DESIGN, noise_of

MASS, CLOCK, ANGLE = 0.02, 0.01, np.radians(2.0)
"""What the study is wrong by, relative or in rad."""
OTHER = {"stiffness": (1.15, 2.0), "damping": (1.2, 2.0)}
"""Factors by which the other fibre's parameters differ, or their inverses; log-uniform."""


def heavier(plan: Plan, sign: float) -> Plan:
    """The record of a weight that is heavier, or lighter, than the study says."""
    weight = plan.conditions.weight_mass * (1.0 + sign * MASS)
    return plan._replace(conditions=replace(plan.conditions, weight_mass=weight))


def steeper(plan: Plan, sign: float) -> Plan:
    """The record of a guide with another slope than the study says."""
    slope = plan.conditions.inclination + sign * ANGLE
    return plan._replace(conditions=replace(plan.conditions, inclination=slope))


def slower(plan: Plan, sign: float) -> Plan:
    """The record of a logger that samples more slowly, or faster, than it writes."""
    return plan._replace(times=plan.times * (1.0 + sign * CLOCK))


def as_said(plan: Plan, sign: float) -> Plan:
    """The record as the study says."""
    return plan


class Mistake(NamedTuple):
    """One kind of mistake.

    Parameters
    ----------
    taken : how a plan of the study was truly carried out, given the sign of what is wrong
    named : start of the effect's name by which the search has to call it; "" where it is told before any search
    """

    taken: Callable[[Plan, float], Plan]
    named: str


MISTAKES = {
    "mass": Mistake(heavier, "study.weight_mass"),
    "clock": Mistake(slower, "study.clock"),
    "inclination": Mistake(steeper, "study.inclination"),
    "swapped": Mistake(as_said, ""),
    "sign": Mistake(as_said, ""),
    "other fibre": Mistake(as_said, "study.other_fibre"),
}


@dataclass(frozen=True)
class Mistaken:
    """One series with a mistake.

    Parameters
    ----------
    release : label
    mistake : one of `MISTAKES`
    rig : one of `RIGS`
    index : number among those of its release, mistake and rig
    noise : one of `NOISES`
    scatter : relative standard deviation of the base parameters between records
    """

    release: str
    mistake: str
    rig: str
    index: int
    noise: str
    scatter: float

    @property
    def name(self) -> str:
        """Tells a series from every other one."""
        return f"{self.release}/{self.mistake}/{self.rig}/{self.index}/{self.noise}/{100 * self.scatter:g} %"

    @property
    def seed(self) -> int:
        """Of all that is drawn."""
        return seed_of("mistake", self.release, self.mistake, self.rig, str(self.index))

    @property
    def turned(self) -> tuple[str, int | None]:
        """The channel whose sign is wrong, and the place of the record in which it is; None for all of them."""
        rng = np.random.default_rng(seed_of("sign", self.name))
        channel = str(rng.choice(("force", "position") if self.rig == DROP else ("force", "position", "drive")))
        return channel, int(rng.integers(3)) if rng.random() < 0.5 else None

    @property
    def told(self) -> str:
        """Words in which it is told before any search; "" where the search has to name it."""
        return {"swapped": "look exchanged", "sign": f"Check the sign of the {self.turned[0]}:"}.get(self.mistake, "")

    def make(self) -> tuple[Series, str]:
        """The series, and the file that is another fibre's; "" where none is."""
        rng = np.random.default_rng(self.seed)
        base, noise = USUAL_DESIGN.base(rng), noise_of(self.noise, rng)
        plans, sign = USUAL_DESIGN.plans(self.rig, rng), float(rng.choice((-1.0, 1.0)))
        zero = rng.uniform(-3e-4, 3e-4) if self.rig == DROP else 0.0
        odd = int(rng.integers(len(plans))) if self.mistake == "other fibre" else -1
        records = []
        for number, plan in enumerate(plans):
            own = scattered(other_fibre(base, rng) if number == odd else base, rng, self.scatter)
            true = MISTAKES[self.mistake].taken(plan, sign)
            taken = take(true, own, {}, zero, noise, rng, USUAL_DESIGN.step)
            records.append(replace(taken, conditions=plan.conditions, logged=taken.logged._replace(times=plan.times)))
        if self.mistake == "swapped":
            records = [exchanged(record) for record in records]
        if self.mistake == "sign":
            channel, place = self.turned
            records = [turned(one, channel) if place in (None, i) else one for i, one in enumerate(records)]
        series = Series(self.rig, base, {}, tuple(records), records[0], None, self.seed)
        return series, plans[odd].name if odd >= 0 else ""

    def write(self, folder: Path) -> str:
        """Write records and study, without the truth; the file that is another fibre's."""
        series, odd = self.make()
        write_study(series, folder)
        return odd


def other_fibre(base: Base, rng: np.random.Generator) -> Base:
    """A fibre of another kind."""
    factors = {
        name: float(np.exp(rng.choice((-1.0, 1.0)) * rng.uniform(*np.log(range_)))) for name, range_ in OTHER.items()
    }
    return base._replace(**{name: getattr(base, name) * factor for name, factor in factors.items()})


def exchanged(record: Recording) -> Recording:
    """A record whose headings of force and position stand over each other's columns."""
    said = record.logged
    return replace(record, logged=said._replace(force=1e3 * said.position, position=1e-3 * said.force))


def turned(record: Recording, channel: str) -> Recording:
    """A record of which one channel was logged with the wrong sign."""
    return replace(record, logged=record.logged._replace(**{channel: -getattr(record.logged, channel)}))


def mistakes(release: str, mistake: str, rigs: Sequence[str] = RIGS) -> Iterator[Mistaken]:
    """Series of a mistake, without end, the rigs in turn."""
    index = 0
    while True:
        for rig in rigs:
            rng = np.random.default_rng(seed_of("plan of a mistake", release, mistake, rig, str(index)))
            noise, scatter = str(rng.choice(NOISES)), float(rng.choice(SCATTERS))
            yield Mistaken(release, mistake, rig, index, noise, scatter)
        index += 1
