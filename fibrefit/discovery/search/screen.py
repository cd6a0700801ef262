"""Score tests of further effects on top of a model, all that a program holds at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.screening import (
    Approach,
    PredictedGain,
    accompaniment_of,
    best_of,
    cannot_be_opposite,
    directions,
    rings,
    slightly,
    stands_for_differences,
    starting_strength,
)
from fibrefit.discovery.engine.secant import Seed
from fibrefit.discovery.engine.slopes import Slopes
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.law import Effect
from fibrefit.problem import Gram, MarginalLikelihood, ScoreTest, Unknowns


class Elsewhere(NamedTuple):
    """Values of a model with which slopes are taken in place of a parent's.

    Parameters
    ----------
    supermodel : Supermodel
    local : (n_record, n_local) in SI units
    effects : tuple of Effect classes
        That are there.
    slopes : Seed
        Of the model's own unknowns, see `per_unit`.
    """

    supermodel: Supermodel
    local: np.ndarray
    effects: tuple[type[Effect], ...]
    slopes: Seed


@dataclass(frozen=True)
class Screen:
    """Score tests of further effects on top of a parent: the gain they predict, one simulation each.

    Parameters
    ----------
    inference : LaplaceInference
    parent : LaplaceFit
    slopes : Seed
        Of the parent, see `LaplaceInference.slopes`.
    near : Elsewhere, optional
        A model that leaves little, without all or the last of the parent's effects: slopes of others are nearly the
        same there, and its programs were compiled when these were looked at on it. The parent itself by default.
    """

    inference: LaplaceInference
    parent: LaplaceFit
    slopes: Seed
    near: Elsewhere | None = None

    def unknowns(self, supermodel: Supermodel) -> Unknowns:
        """Those of the parent in a supermodel."""
        return self.inference.unknowns(supermodel, self.parent.effects)

    def predicted(
        self,
        supermodel: Supermodel,
        effects: Sequence[type[Effect]],
        ways: Mapping[type[Effect], Approach] | None = None,
    ) -> dict[type[Effect], PredictedGain]:
        """Score test of each effect, at the best of its shapes; all effects of a supermodel are looked at together.

        Parameters
        ----------
        supermodel : Supermodel
            One that holds all of them.
        effects : sequence of Effect classes
        ways : mapping of Effect class to Approach, optional
            The only one to look at of an effect; all its shapes by default.
        """
        parent, gram = self.parent, self.gram(supermodel)
        base = transferred(supermodel, parent.supermodel, parent.local)
        found: dict[type[Effect], list[PredictedGain]] = {effect: [] for effect in effects}
        shapes = {effect: [ways[effect]] if ways else directions(effect) for effect in effects}
        for number in range(max((len(of) for of in shapes.values()), default=0)):
            there = {effect: of[number] for effect, of in shapes.items() if number < len(of)}
            local = base.copy()
            for effect, direction in there.items():
                for name, value in direction.shapes.items():
                    local[:, supermodel.names.index(f"{effect.name}.{name}")] = value
            for effect, prediction in self._at(supermodel, gram, local, there):
                found[effect].append(prediction)
        nothing = PredictedGain(-np.inf, {}, {}, {})
        best = {effect: best_of(some or [nothing], rings(effect)) for effect, some in found.items()}
        for effect in filter(stands_for_differences, effects if parent.evidence.mode.sigma.any() else ()):
            # Of the standard deviations of the others, smaller without that record, a score test says nothing.
            at_null = MarginalLikelihood.of(self.inference.absent_beside(parent, supermodel, effect, self.slopes)[0])
            predicted = LaplaceFit((*parent.effects, effect), supermodel, at_null)
            best[effect] = best[effect]._replace(gain=predicted.log - parent.log)
        return best

    def _at(
        self, supermodel: Supermodel, gram: Gram, local: np.ndarray, there: dict[type[Effect], Approach]
    ) -> list[tuple[type[Effect], PredictedGain]]:
        """Score test of each direction: its gain less what it costs, and where that is."""
        ways = [
            (effect, f"{effect.name}.{name}", weak) for effect, way in there.items() for name, weak in way.strengths
        ]
        unknowns, found = self.unknowns(supermodel), self.parent.evidence.mode
        columns = np.array([supermodel.names.index(name) for _, name, _ in ways])
        place = unknowns.place_of(local, found.place.eta)
        values = np.array([slightly(supermodel, *way) for way in ways])
        grams = unknowns.local_grams(place, gram, (columns, values))
        test = ScoreTest.of(unknowns, place, grams, len(columns), found.sigma)
        shares = -test.score / np.where(test.information > 0.0, test.information, np.inf)
        # A frequency is what it is or another: no place where records ask for the opposite leads to it.
        opposite = np.array([supermodel.declared[name].unit == "Hz" for _, name, _ in ways]) & (shares <= 0.0)
        gains = np.where(opposite & np.isfinite(test.gain), 0.0, test.gain) - PRICE
        found_all = []
        one_sided = [cannot_be_opposite(supermodel, effect, name) for effect, name, _ in ways]
        for i, ((effect, name, weak), value, gain, share) in enumerate(zip(ways, values, gains, shares, strict=True)):
            shapes = {f"{effect.name}.{shape}": size for shape, size in there[effect].shapes.items()}
            start = {name: starting_strength(supermodel, name, float(value), share)}
            little = there[effect].strengths[0][1] if effect.singular else weak
            hardly = {name: starting_strength(supermodel, name, little, float(np.sign(share) or 1.0))}
            slight = {name: float(value)}
            places = shapes | start, shapes | hardly, shapes | slight
            beside = accompaniment_of(supermodel, unknowns, name, test, i)
            predicted = PredictedGain(float(gain), *places, beside, opposite=one_sided[i] and bool(share <= 0.0))
            found_all.append((effect, predicted))
        return found_all

    @property
    def place(self) -> tuple[object, ...]:
        """Where slopes are taken, for the journal: names and values of another model, none where it is the parent's."""
        if self.near is None:
            return ()
        supermodel, local, effects, _ = self.near
        return tuple(effect.name for effect in effects), supermodel.names, local

    def gram(self, supermodel: Supermodel) -> Gram:
        """Products of the slopes of the parent's unknowns, which are known, and of further columns of a supermodel."""
        known, near, context = self.slopes.slopes, self.near, self.inference.context
        seen = self.inference.common_noise.whitened(supermodel if near is None else near.supermodel)
        places = np.array([supermodel.names.index(name) for name in seen.names])
        within, number = {place: i for i, place in enumerate(places.tolist())}, known.rows.shape[1] - 1
        # All that the two models fit is there as the near one has it: what the parent adds to that is absent.
        held = context.subset(dict.fromkeys((*(near.effects if near is not None else ()), *self.parent.effects)))
        fitted = [seen.names.index(name) for name in (*held.shared, *held.each) if name in seen.names]
        both = [] if near is None else _of_the_same(near.slopes, per_unit(self.parent, self.slopes))

        def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
            here, own = local[:, places], np.array([within[column] for column in columns[number:].tolist()], dtype=int)
            if near is not None:
                here[:, fitted] = near.local[:, fitted]
            found = seen.slopes(here, own, targets[:, number:], context.whole)
            further = found.columns(np.arange(1, len(own) + 1))
            return known.beside(further.carried_over(*both) if both else further).grams(seen.sensitivities)

        return gram


def per_unit(fitted: LaplaceFit, slopes: Seed) -> Seed:
    """Slopes of a model, see `LaplaceInference.slopes`, per unit of its coordinates."""
    found = fitted.evidence.mode
    return Seed(slopes.names, slopes.slopes.scaled(1.0 / found.unknowns.coordinate_steps(found.place)))


def _of_the_same(*seeds: Seed) -> list[Slopes]:
    """Slopes along the unknowns that all of some models have."""
    names = [name for name in seeds[0].names if all(name in seed.names for seed in seeds)]
    return [seed.slopes.columns(np.array([1 + seed.names.index(name) for name in names], dtype=int)) for seed in seeds]
