"""What the validation of the search hides: every effect in every rig at several strengths, pairs, strangers, nil."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fibrefit.effects.catalogue import CATALOGUE, suits
from fibrefit.rigs.catalogue import RIGS
from tests.independent.laws import DRIVE, DROP, EFFECTS, applicable
from tests.independent.make import hide, write

KINDS = ("null", "single", "pair", "outside")
GAPS = (0.6, 1.5, 3.5)
"""Clean gap a single effect leaves to the best base model, in units of the noise."""
PAIR_GAP, OUTSIDE_GAPS = 1.5, (1.5, 3.5)
NULLS, PAIRS, OUTSIDERS = 50, 15, 2
"""Of each rig; of each rig; of each stranger, rig and gap."""
SCATTER = 0.005
"""Relative scatter of the base parameters from record to record in the nulls."""
PINK = 0.5

CLASSES: tuple[frozenset[str], ...] = (
    frozenset({"sensor.force_delay", "sensor.force_lag", "sensor.gauge_resonance"}),
    frozenset({"sensor.force_offset", "sensor.force_drift"}),
    frozenset({"pulley.capstan_friction", "guide.load_dependent_friction"}),
)
"""Effects that records of the usual kind separate badly, whatever is done with them."""


@dataclass(frozen=True)
class Case:
    """One series and what is hidden in it.

    Parameters
    ----------
    kind : one of `KINDS`
    rig : kind of rig
    hidden : names of effects
    gap : that each leaves by itself, in units of the noise
    pink : share of the noise amplitude that is pink
    scatter : relative, of the base parameters
    seed : of all that is drawn
    """

    kind: str
    rig: str
    hidden: tuple[str, ...]
    gap: float
    pink: float
    scatter: float
    seed: int

    @property
    def name(self) -> str:
        """Tells a case from every other one."""
        hidden = "+".join(self.hidden) or "nothing"
        return f"{self.kind}/{self.rig}/{hidden}/gap{self.gap:g}/pink{self.pink:g}/{self.seed}"

    def make(self, folder: Path) -> tuple[float, tuple[str, ...]]:
        """Write the series; the gap that all effects together leave, and what is hidden, with all an effect needs."""
        series = hide(self.rig, self.hidden, self.seed, self.gap, scatter=self.scatter, pink=self.pink)
        write(series, folder)
        return float(series.base_gap or 0.0), tuple(sorted(series.effects))


def class_of(effect: str) -> frozenset[str]:
    """Effects that an effect is not told apart from in records of the usual kind; itself among them."""
    return next((members for members in CLASSES if effect in members), frozenset({effect}))


def all_cases() -> list[Case]:
    """Every case, in an order of which each beginning is a fair sample."""
    cases = [case for rig in (DROP, DRIVE) if rig in RIGS for case in _of_rig(rig)]
    order = np.random.default_rng(2026).permutation(len(cases))
    # Alternating kinds: a short run sees something of each.
    shuffled = [cases[i] for i in order]
    rank = dict.fromkeys(KINDS, 0)
    places = []
    for case in shuffled:
        number = sum(other.kind == case.kind for other in cases)
        places.append((rank[case.kind] + 0.5) / number)
        rank[case.kind] += 1
    return [case for _, case in sorted(zip(places, shuffled, strict=True), key=lambda pair: pair[0])]


def _of_rig(rig: str) -> list[Case]:
    singles, strangers = _names(rig), applicable(rig, outside=True)
    cases = [Case("null", rig, (), 0.0, PINK * (i % 2), SCATTER, 9000 + i) for i in range(NULLS)]
    cases += [_single("single", rig, name, gap) for name in singles for gap in GAPS]
    for names in _pairs(singles):
        cases.append(Case("pair", rig, names, PAIR_GAP, PINK, 0.0, _seed(rig, *names)))
    for turn in range(OUTSIDERS):
        cases += [_single("outside", rig, name, gap, turn) for name in strangers for gap in OUTSIDE_GAPS]
    return cases


def _single(kind: str, rig: str, name: str, gap: float, turn: int = 0) -> Case:
    seed = _seed(kind, rig, name, str(gap), str(turn))
    return Case(kind, rig, (name,), gap, PINK * (seed % 2), 0.0, seed)


def _seed(*words: str) -> int:
    """The same for the same case, whatever else the catalogue holds."""
    return zlib.crc32(" ".join(words).encode()) % 1_000_000


def _names(rig: str) -> tuple[str, ...]:
    """Effects that both simulators know and that make sense for the rig."""
    return tuple(name for name in applicable(rig) if name in CATALOGUE and suits(CATALOGUE[name], RIGS[rig]))


def _pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of effects that are separable by themselves and need no third."""
    rng = np.random.default_rng(7)
    free = [name for name in names if EFFECTS[name].needs is None]
    pairs: list[tuple[str, str]] = []
    while len(pairs) < PAIRS:
        first, second = (str(name) for name in rng.choice(free, 2, replace=False))
        if class_of(first) != class_of(second) and {first, second} not in map(set, pairs):
            pairs.append((first, second))
    return pairs
