"""Laplace's marginal likelihoods of hypotheses: one noise, one prior, one Gauss-Newton for all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from fibrefit.discovery.engine.candidates import SMALL, SearchContext, strengthened, transferred, with_absent
from fibrefit.discovery.engine.common_noise import CommonNoise, common_noise_of, steps_at
from fibrefit.discovery.engine.effort import (
    continuation_steps,
    curve_descent,
    descent,
    may_be_better_elsewhere,
    warm_start,
)
from fibrefit.discovery.engine.journal import Journal, digest, known_by_name, name_of, signature_of, signature_of_inputs
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.priors import Heights, unknowns_of
from fibrefit.discovery.engine.remaining import remaining_noise
from fibrefit.discovery.engine.secant import SecantGram, Seed
from fibrefit.discovery.engine.supermodel import Supermodel, change_products, stretch_products
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.law import Effect
from fibrefit.problem import (
    Gram,
    MarginalLikelihood,
    Noise,
    PosteriorMode,
    Unknowns,
    better_minima,
    laplace_evidence,
    mode,
    same_noise,
)


class LaplaceInference:
    """Modes and marginal likelihoods of hypotheses, all in one noise.

    Parameters
    ----------
    context : SearchContext
    reference : mapping of name to float
        Base parameters of the first fit, in SI units.
    common_noise : CommonNoise
    folder : pathlib.Path, optional
        Of the journal that is asked first, for a search that was cut short.
    """

    def __init__(
        self, context: SearchContext, reference: dict[str, float], common_noise: CommonNoise, folder: Path | None = None
    ) -> None:
        self.context, self.reference, self.common_noise, self.folder = context, reference, common_noise, folder

    def kept_in(self, folder: Path | None) -> LaplaceInference:
        """The same with a journal in another folder; None for none."""
        return LaplaceInference(self.context, self.reference, self.common_noise, folder)

    def with_noise(self, common_noise: CommonNoise) -> LaplaceInference:
        """The same in another noise."""
        return LaplaceInference(self.context, self.reference, common_noise, self.folder)

    def unknowns(
        self, supermodel: Supermodel, effects: Iterable[type[Effect]], curve: Heights | None = None
    ) -> Unknowns:
        """What is unknown when effects are on, and the priors; see `unknowns_of`."""
        return unknowns_of(supermodel, self.context, effects, self.reference, curve)

    def _recalled(self, what: str, supermodel: Supermodel, about: object, job: Callable[[], LaplaceFit]) -> LaplaceFit:
        """A fit in a supermodel, asked of the journal first.

        Parameters
        ----------
        what : str
            Kind of the fit.
        supermodel : Supermodel
        about : object
            What else it depends on, besides noise, priors and records, see `digest`.
        job : callable
        """
        if self.folder is None:
            return job()
        # A law that was composed has the digest of its source in the name of its module.
        program = [f"{effect.__module__}.{effect.__qualname__}" for effect in supermodel.effects]
        beliefs = list(self.reference.items()), self.context.counts
        key = digest(what, program, signature_of_inputs(supermodel), self.common_noise.words, beliefs, about)
        by_name = known_by_name(supermodel.effects, lambda effects: supermodel, supermodel)
        found: LaplaceFit = Journal(self.folder, name_of, by_name).recall(key, job)
        return found

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

        def fit() -> LaplaceFit:
            unknowns = self.unknowns(supermodel, effects)
            start, gram = unknowns.place_of(local, eta), self.secant(supermodel)
            evidence = laplace_evidence(unknowns, start, gram, sigma, **descent(contains))
            return self.in_better_minima(LaplaceFit(effects, supermodel, evidence), contains)

        begun = [None if values is None else np.asarray(values) for values in (local, sigma, eta)]
        return self._recalled("fitted", supermodel, ([effect.name for effect in effects], begun, contains), fit)

    def in_better_minima(self, fitted: LaplaceFit, contains: float = np.inf) -> LaplaceFit:
        """A hypothesis with each record in the better one of two minima, where its cost says that there are two.

        Parameters
        ----------
        fitted : LaplaceFit
        contains : float
            Objective of a hypothesis that it contains, see `descent`.
        """
        at, supermodel = fitted.evidence.mode, fitted.supermodel
        if not may_be_better_elsewhere(at.objective, contains):
            return fitted
        anew = partial(self.common_noise.whitened(supermodel).grams, counts=self.context.whole)
        if (start := better_minima(at, anew, self.secant(supermodel))) is None:
            return fitted
        evidence = laplace_evidence(at.unknowns, start, self.secant(supermodel), at.sigma, **descent(contains))
        moved = replace(fitted, evidence=evidence)
        return moved if moved.log > fitted.log else fitted

    def secant(self, supermodel: Supermodel, seed: Seed | None = None) -> SecantGram:
        """Products of slopes and residuals in this noise; what is known of the slopes is not simulated."""
        return SecantGram(self.common_noise.whitened(supermodel), self.context.whole, seed)

    def predicted_evidence(
        self, curve: Heights, parent: LaplaceFit, supermodel: Supermodel, local: np.ndarray, gram: Gram
    ) -> float:
        """Logarithm of the evidence that slopes predict of a parent with a curve on top of it, at given values."""
        unknowns = self.unknowns(supermodel, parent.effects, curve)
        found = parent.evidence.mode
        place = unknowns.place_of(local, found.place.eta)
        return MarginalLikelihood.of(PosteriorMode.at(unknowns, place, gram, found.sigma)).log

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
        unknowns = self.unknowns(supermodel, parent.effects, curve)
        found = parent.evidence.mode
        start = unknowns.place_of(local, found.place.eta)
        return LaplaceFit(
            (*parent.effects, probe),
            supermodel,
            laplace_evidence(unknowns, start, gram, found.sigma, **curve_descent(found.objective)),
        )

    def begun_anew(self, fitted: LaplaceFit, base: LaplaceFit) -> LaplaceFit:
        """A hypothesis where a model that it contains is, what that lacks hardly there, as probable as slopes say.

        Parameters
        ----------
        fitted : LaplaceFit
        base : LaplaceFit
        """
        supermodel, found = fitted.supermodel, base.evidence.mode
        added = [effect for effect in fitted.effects if effect not in base.effects]
        local = transferred(supermodel, base.supermodel, base.local)
        mine = [supermodel.names.index(f"{one.name}.{each.name}") for one in added for each in one.parameters]
        local[:, mine] = strengthened(supermodel, fitted.local, added, SMALL)[:, mine]
        unknowns = self.unknowns(supermodel, fitted.effects)
        place = unknowns.place_of(local, found.place.eta)
        at = PosteriorMode.at(unknowns, place, self.secant(supermodel), found.sigma)
        return LaplaceFit(fitted.effects, supermodel, MarginalLikelihood.of(at))

    def without_descent(
        self, supermodel: Supermodel, effects: tuple[type[Effect], ...], local: np.ndarray, parent: LaplaceFit
    ) -> LaplaceFit:
        """A hypothesis where it is, without a descent; no less probable than its parent with the effect at its null."""
        found = parent.evidence.mode
        unknowns = self.unknowns(supermodel, effects)
        place = unknowns.place_of(local, np.zeros_like(found.place.eta))
        at = PosteriorMode.at(unknowns, place, self.secant(supermodel), found.sigma)
        seen = LaplaceFit(effects, supermodel, MarginalLikelihood.of(at))
        least = parent.log - PRICE * sum(len(effect.parameters) for effect in effects if effect not in parent.effects)
        return seen if seen.log > least else seen.with_log(least)

    def absent(
        self, parent: LaplaceFit, supermodel: Supermodel, added: Sequence[type[Effect]], gain: float
    ) -> LaplaceFit:
        """A parent with further effects at their nulls, and the gain that slopes predict of them."""
        effects, found = (*parent.effects, *added), parent.evidence.mode
        local = transferred(supermodel, parent.supermodel, parent.local)
        unknowns = self.unknowns(supermodel, effects)
        place, old = unknowns.place_of(local, found.place.eta), parent.evidence
        size = len(unknowns.shared)
        blank = np.full((len(old.grid), size), np.nan)
        covariance = np.full((len(old.grid), size, size), np.nan)
        at = PosteriorMode(unknowns, place, found.normal, found.sigma, 0.0, 0)
        added_to = LaplaceFit(effects, supermodel, replace(old, mode=at, z=blank, covariance=covariance))
        return added_to.with_log(parent.log + gain)

    def pooled(self, parent: LaplaceFit) -> LaplaceFit:
        """A parent at its mode if records do not differ (complete pooling): differences may be what an effect would do.

        Differences between records and a missing effect stand in for each other. From where differences account for
        what is missing, slopes predict nothing of the effect.
        """
        found = parent.evidence.mode

        def pool() -> LaplaceFit:
            # The first step takes the deviations away, and with them goes what is shared, as slopes say. To begin
            # without them, with what is shared where it was, may meet other bounces: of a driven series it ended 29
            # nats below.
            gram, sigma = self.secant(parent.supermodel), np.zeros_like(found.sigma)
            evidence = MarginalLikelihood.of(mode(found.unknowns, found.place, gram, sigma, **descent()))
            # Slopes there say that records do differ: what counts of the place is how probable it is if they do not.
            return replace(parent, evidence=replace(evidence, log=evidence.log_if(sigma)))

        return self._recalled("pooled", parent.supermodel, signature_of(parent, ()), pool)

    def absent_beside(
        self, parent: LaplaceFit, supermodel: Supermodel, effect: type[Effect], slopes: Seed | None
    ) -> tuple[PosteriorMode, SecantGram]:
        """A parent with an effect at its null, and products there."""
        unknowns = self.unknowns(supermodel, (*parent.effects, effect))
        found, gram = parent.evidence.mode, self.secant(supermodel, slopes)
        place = unknowns.place_of(transferred(supermodel, parent.supermodel, parent.local), found.place.eta)
        return PosteriorMode.at(unknowns, place, gram, found.sigma), gram

    def slopes(self, parent: LaplaceFit) -> Seed:
        """Residuals of a parent at its mode and their changes along its unknowns.

        A candidate at its null is its parent: all candidates share these, and only what is new is simulated.
        """
        found = parent.evidence.mode
        at, seen = found.unknowns.differences(found.place), self.common_noise.whitened(parent.supermodel)
        return Seed(found.unknowns.names, seen.slopes(at.local, at.columns, at.targets, self.context.whole))

    def warm_started_without(self, fitted: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
        """The first steps of a hypothesis without some of its effects, warm started from where it is."""
        found = fitted.evidence.mode

        def begin() -> LaplaceFit:
            unknowns = self.unknowns(fitted.supermodel, kept)
            start = unknowns.place_of(_without(fitted, kept), found.place.eta)
            evidence = laplace_evidence(unknowns, start, self.secant(fitted.supermodel), found.sigma, **warm_start())
            return LaplaceFit(kept, fitted.supermodel, evidence)

        about = [effect.name for effect in kept], signature_of(fitted, ())
        return self._recalled("warm started", fitted.supermodel, about, begin)

    def without(self, fitted: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
        """A hypothesis without some of its effects, from where it is."""
        found = fitted.evidence.mode
        return self.fitted(fitted.supermodel, kept, _without(fitted, kept), found.sigma, found.place.eta)

    def without_by_continuation(self, fitted: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
        """A hypothesis without some of its effects, by continuation (homotopy) in their strengths, the others refitted.

        Where a motion bounces, a strong effect cannot be left out at once: bounces come at other times, and what is
        left lies in a minimum of its own. Records may differ by ever more on the way.
        """
        unknowns = self.unknowns(fitted.supermodel, kept)
        gram = self.secant(fitted.supermodel)
        gone, at = _gone(fitted, kept), fitted
        for share in continuation_steps():
            start = unknowns.place_of(strengthened(at.supermodel, at.local, gone, share), at.evidence.mode.place.eta)
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
        return self.with_noise(noise)

    def settled_about(self, fitted: LaplaceFit) -> bool:
        """Whether the noise before rounding is the most probable one about a hypothesis; true of fine readings.

        It was taken from where a hypothesis was before it was fitted in it. Where it is too large, steps that a signal
        does not cross count for more than they say, and lead it astray.
        """
        steps = steps_at(fitted.supermodel, fitted.local, self.context.whole)
        return steps is None or same_noise(self.common_noise.steps, steps.steps)

    def noise(self, fitted: LaplaceFit) -> tuple[Noise, ...]:
        """Noise a hypothesis leaves, in SI units."""
        return remaining_noise(self.common_noise, fitted, self.context.whole)

    def overdispersion(self, parent: LaplaceFit, fitted: LaplaceFit, names: Iterable[str]) -> float:
        """Overdispersion of the scores, at least 1, see `PosteriorMode.overdispersion`; a gain counts for as much less.

        Parameters
        ----------
        parent, fitted : LaplaceFit
            Without and with what is added.
        names : iterable of str
            Shared values; the larger one of the mean of their ratios and of that of the change from one to the other is
            reported. The largest of many is above one by chance: of 80 heights 1.5 where nothing is amiss.
        """
        found = fitted.evidence.mode
        unknowns, supermodel = found.unknowns, self.common_noise.whitened(fitted.supermodel)
        at = unknowns.differences(found.place)
        parts = stretch_products(supermodel, at.local, at.columns, at.targets, self.context.whole)
        covariance = fitted.evidence.covariance[int(np.argmax(fitted.evidence.weight))]
        ratio = found.overdispersion(parts, at.per_unit(parts.sum(axis=1)), covariance)
        index = [unknowns.names.index(name) for name in names]
        before = transferred(fitted.supermodel, parent.supermodel, parent.local, _without(fitted, parent.effects))
        change = change_products(supermodel, fitted.local, before, self.context.whole)
        of_values = float(np.mean(ratio[index])) if index else 1.0
        return max(1.0, overdispersion_of_change(change), of_values)


def _gone(fitted: LaplaceFit, kept: Sequence[type[Effect]]) -> list[type[Effect]]:
    """Effects of a hypothesis that are not kept."""
    return [effect for effect in fitted.effects if effect not in kept]


def _without(fitted: LaplaceFit, kept: Sequence[type[Effect]]) -> np.ndarray:
    """Values of a hypothesis ``(n_record, n_local)`` with the effects that are not kept at their nulls."""
    return with_absent(fitted.supermodel, fitted.local, _gone(fitted, kept))


def overdispersion_of_change(products: np.ndarray) -> float:
    """Sandwich variance over the information along one finite change of the readings, as an effect makes it.

    Where a change bends, as a bounce makes it, slopes at its end say nothing of it: it may lie in a few readings that
    tails of the noise have made loud.

    Parameters
    ----------
    products : (n_record, n_stretch, 2, 2)
        Of the change and of residuals within each stretch of a record, the residuals last.
    """
    size = float(np.sum(products[..., 0, 0]))
    return float(np.sum(products[..., 0, 1] ** 2)) / size if size > 0.0 else 1.0
