"""Laplace's marginal likelihoods of hypotheses: one noise, one prior, one Gauss-Newton for all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from fibrefit.discovery.engine.candidates import SearchContext, absent_values, strengthened, transferred
from fibrefit.discovery.engine.common_noise import CommonNoise, common_noise_of, steps_at
from fibrefit.discovery.engine.effort import (
    continuation_steps,
    curve_descent,
    descent,
    in_wrong_minimum,
    warm_start,
)
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.priors import Heights, unknowns_of, with_held
from fibrefit.discovery.engine.remaining import innovations_of, remaining_noise, residuals_of
from fibrefit.discovery.engine.screening import (
    Approach,
    PredictedGain,
    accompanied,
    accompaniment_of,
    directions,
    slightly,
    stands_for_differences,
    starting_strength,
)
from fibrefit.discovery.engine.secant import SecantGram, Seed
from fibrefit.discovery.engine.slopes import Slopes
from fibrefit.discovery.engine.supermodel import Supermodel, stretch_products
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.families import instants_of
from fibrefit.laws.law import Effect
from fibrefit.problem.estimate.evidence import laplace, laplace_evidence, most_probable_sigma
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.estimate.gram import Gram
from fibrefit.problem.estimate.normal_equations import PosteriorMode, Unknowns, arrowhead, local_grams, place_of
from fibrefit.problem.estimate.sandwich import overdispersion_of_scores
from fibrefit.problem.estimate.score_test import score_test
from fibrefit.problem.noise.spectrum import Noise


class LaplaceInference:
    """Modes and marginal likelihoods of hypotheses, all in one noise.

    Parameters
    ----------
    context : SearchContext
    reference : mapping of name to float
        Base parameters of the first fit, in SI units.
    common_noise : CommonNoise
    """

    def __init__(self, context: SearchContext, reference: dict[str, float], common_noise: CommonNoise) -> None:
        self.context, self.reference, self.common_noise = context, reference, common_noise

    def fitted(
        self,
        supermodel: Supermodel,
        effects: tuple[type[Effect], ...],
        local: np.ndarray,
        sigma: np.ndarray | None = None,
        eta: np.ndarray | None = None,
        contains: float = np.inf,
    ) -> LaplaceFit:
        """A hypothesis at its mode, from given values.

        Parameters
        ----------
        supermodel : Supermodel
        effects : tuple of Effect classes
        local : (n_record, n_local) in SI units
        sigma : (n_scattering,), optional
            Standard deviations between records to begin with.
        eta : (n_record, n_scattering), optional
            Deviations to begin with.
        contains : float
            Objective of a hypothesis that it contains, see `descent`.
        """
        unknowns = unknowns_of(supermodel, self.context, effects, self.reference)
        start, gram = place_of(unknowns, local, eta), self.secant(supermodel)
        return LaplaceFit(effects, supermodel, laplace_evidence(unknowns, start, gram, sigma, **descent(contains)))

    def secant(self, supermodel: Supermodel, seed: Seed | None = None) -> SecantGram:
        """Products of slopes and residuals in this noise; what is known of the slopes is not simulated."""
        return SecantGram(self.common_noise.whitened(supermodel), self.context.whole, seed)

    def predicted_evidence(
        self, curve: Heights, parent: LaplaceFit, supermodel: Supermodel, local: np.ndarray, gram: Gram
    ) -> float:
        """Logarithm of the evidence that slopes predict of a parent with a curve on top of it, at given values."""
        unknowns = unknowns_of(supermodel, self.context, parent.effects, self.reference, curve)
        found = parent.evidence.mode
        place = place_of(unknowns, local, found.place.eta)
        return laplace(PosteriorMode(unknowns, place, arrowhead(unknowns, place, gram), found.sigma, np.inf, 1)).log

    def with_curve(
        self,
        parent: LaplaceFit,
        supermodel: Supermodel,
        local: np.ndarray,
        probe: type[Effect],
        curve: Heights,
        gram: Gram,
    ) -> LaplaceFit:
        """A parent with a curve on top of it, from given values."""
        unknowns = unknowns_of(supermodel, self.context, parent.effects, self.reference, curve)
        found = parent.evidence.mode
        start = place_of(unknowns, local, found.place.eta)
        return LaplaceFit(
            (*parent.effects, probe),
            supermodel,
            laplace_evidence(unknowns, start, gram, found.sigma, **curve_descent(found.objective)),
        )

    def without_descent(
        self, supermodel: Supermodel, effects: tuple[type[Effect], ...], local: np.ndarray, parent: LaplaceFit
    ) -> LaplaceFit:
        """A hypothesis where it is, without a descent; no less probable than its parent with the effect at its null."""
        found = parent.evidence.mode
        unknowns = unknowns_of(supermodel, self.context, effects, self.reference)
        place = place_of(unknowns, local, np.zeros_like(found.place.eta))
        normal = arrowhead(unknowns, place, self.secant(supermodel))
        evidence = laplace(PosteriorMode(unknowns, place, normal, found.sigma, np.inf, 1))
        seen = LaplaceFit(effects, supermodel, evidence)
        least = parent.log - PRICE * sum(len(effect.parameters) for effect in effects if effect not in parent.effects)
        return seen if seen.log > least else seen.with_log(least)

    def absent(
        self, parent: LaplaceFit, supermodel: Supermodel, added: Sequence[type[Effect]], gain: float
    ) -> LaplaceFit:
        """A parent with further effects at their nulls, and the gain that slopes predict of them."""
        effects, found = (*parent.effects, *added), parent.evidence.mode
        local = transferred(supermodel, parent.supermodel, parent.local)
        unknowns = unknowns_of(supermodel, self.context, effects, self.reference)
        place, old = place_of(unknowns, local, found.place.eta), parent.evidence
        size = len(unknowns.shared)
        blank = np.full((len(old.grid), size), np.nan)
        covariance = np.full((len(old.grid), size, size), np.nan)
        at = PosteriorMode(unknowns, place, found.normal, found.sigma, 0.0, 0)
        return LaplaceFit(
            effects, supermodel, replace(old, mode=at, log=old.log + gain, z=blank, covariance=covariance)
        )

    def pooled(self, parent: LaplaceFit) -> LaplaceFit:
        """A parent at its mode if records do not differ (complete pooling): differences may be what an effect would do.

        Differences between records and a missing effect stand in for each other. From where differences account for
        what is missing, slopes predict nothing of the effect.
        """
        found = parent.evidence.mode
        start = found.place._replace(eta=np.zeros_like(found.place.eta))
        gram, sigma = self.secant(parent.supermodel), np.zeros_like(found.sigma)
        evidence = laplace(mode(found.unknowns, start, gram, sigma, **descent()))
        # Slopes there say that records do differ: what counts of the place is how probable it is if they do not.
        return replace(parent, evidence=replace(evidence, log=evidence.log_if(sigma)))

    def extended(
        self,
        parent: LaplaceFit,
        supermodel: Supermodel,
        effect: type[Effect],
        prediction: PredictedGain,
        slopes: Seed | None = None,
    ) -> LaplaceFit:
        """A parent with a further effect, from where slopes predict most of it.

        Parameters
        ----------
        parent : LaplaceFit
        supermodel : Supermodel
            One that holds the effect too.
        effect : Effect class
        prediction : PredictedGain
            Of the effect on that parent.
        slopes : Seed, optional
            Of the parent, see `slopes`.
        """
        found = parent.evidence.mode
        if stands_for_differences(effect) and found.sigma.any():
            at, gram = self._absent_beside(parent, supermodel, effect, slopes)
            evidence = laplace_evidence(at.unknowns, at, gram, most_probable_sigma(at), **descent(found.objective))
            return LaplaceFit((*parent.effects, effect), supermodel, evidence)
        local = transferred(supermodel, parent.supermodel, parent.local)
        ends: list[LaplaceFit] = []
        # Where slopes lead to another minimum, the effect is followed from where it is hardly there.
        for values in prediction.starts:
            for name, value in values.items():
                local[:, supermodel.names.index(name)] = value
            effects = (*parent.effects, effect)
            unknowns = unknowns_of(supermodel, self.context, effects, self.reference)
            start = accompanied(unknowns, place_of(unknowns, local, found.place.eta), prediction)
            gram, how = self.secant(supermodel, slopes), descent(found.objective)
            if effect.sudden:
                # Slopes along an instant are those of a few samples about it: a step meant for all else leads astray.
                held = with_held(unknowns, start, [f"{effect.name}.{instant}" for instant in instants_of(effect)])
                start = mode(held, start, gram, found.sigma, **how).place
            ends.append(LaplaceFit(effects, supermodel, laplace_evidence(unknowns, start, gram, found.sigma, **how)))
            if not in_wrong_minimum(ends[-1].log, parent.log):
                break
        return max(ends, key=lambda end: end.log)

    def _absent_beside(
        self, parent: LaplaceFit, supermodel: Supermodel, effect: type[Effect], slopes: Seed | None
    ) -> tuple[PosteriorMode, SecantGram]:
        """A parent with an effect at its null, and products there."""
        unknowns = unknowns_of(supermodel, self.context, (*parent.effects, effect), self.reference)
        found, gram = parent.evidence.mode, self.secant(supermodel, slopes)
        place = place_of(unknowns, transferred(supermodel, parent.supermodel, parent.local), found.place.eta)
        return PosteriorMode(unknowns, place, arrowhead(unknowns, place, gram), found.sigma, np.inf, 1), gram

    def slopes(self, parent: LaplaceFit) -> Seed:
        """Residuals of a parent at its mode and their changes along its unknowns.

        A candidate at its null is its parent: all candidates share these, and only what is new is simulated.
        """
        unknowns, found = parent.evidence.mode.unknowns, parent.evidence.mode
        seen, kept = self.common_noise.whitened(parent.supermodel), []

        def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
            kept.append(seen.slopes(local, columns, targets, self.context.whole))
            return kept[0].grams(seen.sensitivities)

        local_grams(unknowns, found.place, gram)
        return Seed(unknowns.names, kept[0])

    def screened(
        self,
        parent: LaplaceFit,
        supermodel: Supermodel,
        effects: Sequence[type[Effect]],
        slopes: Seed | None = None,
        ways: Mapping[type[Effect], Approach] | None = None,
    ) -> dict[type[Effect], PredictedGain]:
        """Score test of each effect on top of a parent: the gain it predicts, at the best of its shapes.

        All effects of a supermodel are looked at together, one simulation each.

        Parameters
        ----------
        parent : LaplaceFit
        supermodel : Supermodel
            One that holds all of them.
        effects : sequence of Effect classes
        slopes : Seed, optional
            Of the parent, where they are known, see `slopes`.
        ways : mapping of Effect class to Approach, optional
            The only one to look at of an effect; all its shapes by default.
        """
        unknowns, found = unknowns_of(supermodel, self.context, parent.effects, self.reference), parent.evidence.mode
        slopes = self.slopes(parent) if slopes is None else slopes
        gram = self.beside(supermodel, slopes.slopes)
        base = transferred(supermodel, parent.supermodel, parent.local)
        best = dict.fromkeys(effects, PredictedGain(-np.inf, {}, {}, {}))
        shapes = {effect: [ways[effect]] if ways else directions(effect) for effect in effects}
        for number in range(max((len(of) for of in shapes.values()), default=0)):
            there = {effect: of[number] for effect, of in shapes.items() if number < len(of)}
            local = base.copy()
            for effect, direction in there.items():
                for name, value in direction.shapes.items():
                    local[:, supermodel.names.index(f"{effect.name}.{name}")] = value
            for effect, prediction in self._predicted_gains(supermodel, gram, unknowns, local, found, there):
                best[effect] = max(best[effect], prediction, key=lambda one: one.gain)
        for effect in filter(stands_for_differences, effects if found.sigma.any() else ()):
            # Of the standard deviations of the others, smaller without that record, a score test says nothing.
            predicted = laplace(self._absent_beside(parent, supermodel, effect, slopes)[0])
            best[effect] = best[effect]._replace(gain=predicted.log - parent.log)
        return best

    def _predicted_gains(
        self,
        supermodel: Supermodel,
        gram: Gram,
        unknowns: Unknowns,
        local: np.ndarray,
        found: PosteriorMode,
        there: dict[type[Effect], Approach],
    ) -> list[tuple[type[Effect], PredictedGain]]:
        """Score test of each direction: its gain less what it costs, and where that is."""
        ways = [
            (effect, f"{effect.name}.{name}", weak) for effect, way in there.items() for name, weak in way.strengths
        ]
        columns = np.array([supermodel.names.index(name) for _, name, _ in ways])
        place = place_of(unknowns, local, found.place.eta)
        values = np.array([slightly(supermodel, *way) for way in ways])
        grams = local_grams(unknowns, place, gram, (columns, values))
        test = score_test(unknowns, place, grams, len(columns), found.sigma)
        seen = np.where(test.information > 0.0, test.information, np.inf)
        gains = np.where(test.information > 0.0, 0.5 * test.score**2 / seen - PRICE, -np.inf)
        found_all = []
        shares = -test.score / seen
        for i, ((effect, name, weak), value, gain, share) in enumerate(zip(ways, values, gains, shares, strict=True)):
            shapes = {f"{effect.name}.{shape}": size for shape, size in there[effect].shapes.items()}
            start = {name: starting_strength(supermodel, name, float(value), share)}
            little = there[effect].strengths[0][1] if effect.singular else weak
            hardly = {name: starting_strength(supermodel, name, little, float(np.sign(share) or 1.0))}
            slight = {name: float(value)}
            places = shapes | start, shapes | hardly, shapes | slight
            beside = accompaniment_of(supermodel, unknowns, name, test, i)
            found_all.append((effect, PredictedGain(float(gain), *places, beside)))
        return found_all

    def warm_started_without(self, fitted: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
        """The first steps of a hypothesis without some of its effects, warm started from where it is."""
        unknowns = unknowns_of(fitted.supermodel, self.context, kept, self.reference)
        found = fitted.evidence.mode
        start = place_of(unknowns, _with_absent(fitted, kept), found.place.eta)
        gram = self.secant(fitted.supermodel)
        return LaplaceFit(kept, fitted.supermodel, laplace_evidence(unknowns, start, gram, found.sigma, **warm_start()))

    def without(self, fitted: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
        """A hypothesis without some of its effects, from where it is."""
        found = fitted.evidence.mode
        return self.fitted(fitted.supermodel, kept, _with_absent(fitted, kept), found.sigma, found.place.eta)

    def without_by_continuation(self, fitted: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
        """A hypothesis without some of its effects, by continuation (homotopy) in their strengths, the others refitted.

        Where a motion bounces, a strong effect cannot be left out at once: bounces come at other times, and what is
        left lies in a minimum of its own. Records may differ by ever more on the way.
        """
        unknowns = unknowns_of(fitted.supermodel, self.context, kept, self.reference)
        gram = self.secant(fitted.supermodel)
        gone, at = [effect for effect in fitted.effects if effect not in kept], fitted
        for share in continuation_steps():
            start = place_of(unknowns, strengthened(at.supermodel, at.local, gone, share), at.evidence.mode.place.eta)
            evidence = laplace_evidence(unknowns, start, gram, at.evidence.mode.sigma, **warm_start())
            at = replace(at, evidence=evidence)
            gram.renew()
        return self.without(at, kept)

    def again(self, fitted: LaplaceFit) -> LaplaceFit:
        """A hypothesis compared in another noise, from where it is."""
        found = fitted.evidence.mode
        return self.fitted(fitted.supermodel, fitted.effects, fitted.local, found.sigma, found.place.eta)

    def in_noise_of(self, fitted: LaplaceFit) -> LaplaceInference:
        """The same in the noise that a hypothesis leaves."""
        steps = steps_at(fitted.supermodel, fitted.local, self.context.whole)
        noise = common_noise_of(fitted.supermodel, self.noise(fitted), steps)
        return LaplaceInference(self.context, self.reference, noise)

    def noise(self, fitted: LaplaceFit) -> tuple[Noise, ...]:
        """Noise a hypothesis leaves, in SI units."""
        return remaining_noise(self.common_noise, fitted, self.context.whole)

    def overdispersion(self, fitted: LaplaceFit, names: Iterable[str]) -> float:
        """Overdispersion of the scores, at least 1, see `overdispersion_of_scores`; a gain counts for as much less.

        Parameters
        ----------
        fitted : LaplaceFit
        names : iterable of str
            Shared values; the largest of their ratios is reported.
        """
        found, kept = fitted.evidence.mode, []
        unknowns, supermodel = found.unknowns, self.common_noise.whitened(fitted.supermodel)

        def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
            kept.append(stretch_products(supermodel, local, columns, targets, self.context.whole)[0])
            return kept[0].sum(axis=1)

        grams = local_grams(unknowns, found.place, gram)
        covariance = fitted.evidence.covariance[int(np.argmax(fitted.evidence.weight))]
        ratio = overdispersion_of_scores(found, kept[0], grams, covariance)
        index = [unknowns.names.index(name) for name in names]
        return max(1.0, *(float(ratio[i]) for i in index))

    def innovations(self, fitted: LaplaceFit) -> np.ndarray:
        """Whitened residuals at the mode, ``(n_record, n_channel, n_time)``."""
        left = jnp.asarray(residuals_of(self.common_noise, fitted, self.context.whole)[0])
        return np.asarray(innovations_of(self.common_noise.whitening, left[None])[0])

    def beside(self, supermodel: Supermodel, known: Slopes) -> Gram:
        """Products of known slopes of a parent's unknowns and of further columns of a supermodel."""
        seen, number = self.common_noise.whitened(supermodel), known.rows.shape[1] - 1

        def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
            further = seen.slopes(local, columns[number:], targets[:, number:], self.context.whole)
            return known.beside(further.columns(np.arange(1, len(columns) - number + 1))).grams(seen.sensitivities)

        return gram


def _with_absent(fitted: LaplaceFit, kept: Sequence[type[Effect]]) -> np.ndarray:
    """Values of a hypothesis ``(n_record, n_local)`` with the effects that are not kept at their nulls."""
    local, blank = fitted.local.copy(), absent_values(fitted.supermodel, len(fitted.local))
    for effect in fitted.effects:
        if effect not in kept:
            columns = [fitted.supermodel.names.index(f"{effect.name}.{p.name}") for p in effect.parameters]
            local[:, columns] = blank[:, columns]
    return local
