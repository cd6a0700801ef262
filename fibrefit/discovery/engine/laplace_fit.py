"""A hypothesis at its posterior mode, and the marginal likelihood by Laplace's approximation there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.families import instants, number_of_sets
from fibrefit.laws.law import Effect
from fibrefit.problem import MarginalLikelihood


@dataclass(frozen=True)
class LaplaceFit:
    """A hypothesis at its posterior mode, and how probable it makes the records (Laplace's approximation).

    Parameters
    ----------
    effects : tuple of Effect classes
        Added to the model the search began with, in the order they were found.
    supermodel : Supermodel
        One that holds them, not whitened.
    evidence : MarginalLikelihood
    divided_off : float
        Nats that an overdispersion of the scores took off the evidence, which are not the price of a parameter.
    """

    effects: tuple[type[Effect], ...]
    supermodel: Supermodel
    evidence: MarginalLikelihood
    divided_off: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)

    @property
    def local(self) -> np.ndarray:
        """Values of each record at the mode, ``(n_record, n_local)`` in SI units."""
        return self.evidence.mode.local

    @property
    def log(self) -> float:
        """Logarithm of the marginal likelihood, the choice among sets of records and among instants taken off."""
        return self.evidence.log - self._choice - self._choice_of_instants

    @property
    def has_a_place(self) -> bool:
        """Whether its coordinates are numbers: those of an effect that vanishes at infinity are not at its null."""
        return bool(np.isfinite(self.evidence.mode.place.z).all())

    @property
    def _choice(self) -> float:
        """Nats that an effect of some records costs: any set of them was as probable beforehand as another."""
        sets = sum(len(effect.records) > 1 for effect in self.effects)
        return sets * float(np.log(number_of_sets(len(self.local)))) if sets else 0.0

    @cached_property
    def _choice_of_instants(self) -> float:
        """Nats that instants cost beyond what the matrices say.

        Between two events of a motion, as two reversals, an instant changes nothing: its curvature there says that it
        may be anywhere in the record, though a little beyond nothing is gained. It is one of many that were looked at,
        and costs no less than a parameter usually does, but for what the ends of the record cut off its prior.
        """
        if not (names := instants(self.effects)):
            return 0.0
        unknowns = self.evidence.mode.unknowns
        places = [i for i, name in enumerate(unknowns.names[: len(unknowns.shared)]) if name in names]
        told = -0.5 * np.log(np.diag(self.evidence.spread)[places] * np.diag(unknowns.precision)[places])
        return float(np.sum(np.maximum(PRICE - told, 0.0)[np.isfinite(told)]))

    def with_log(self, log: float, divided_off: float = 0.0) -> LaplaceFit:
        """The same with another marginal likelihood: that in a noise in which it was not fitted, or a divided one."""
        return replace(
            self,
            evidence=replace(self.evidence, log=log + self._choice + self._choice_of_instants),
            divided_off=divided_off,
        )

    @property
    def undivided(self) -> LaplaceFit:
        """The same with what an overdispersion took off: that decides a name, and a next model is compared without."""
        return self.with_log(self.log + self.divided_off) if self.divided_off else self

    def largest_loss_to(self, other: LaplaceFit) -> float:
        """Nats of the record that loses most to another hypothesis, both in the same noise.

        Deviations of both count by the larger of their standard deviations: that records differ less with what was
        added is no loss.
        """
        mine, theirs = self.evidence.mode, other.evidence.mode
        sigma = np.maximum(mine.sigma, theirs.sigma)
        return 0.5 * float(np.max(mine.record_costs(sigma) - theirs.record_costs(sigma), initial=0.0))

    @property
    def shared(self) -> dict[str, float]:
        """Shared values in SI units, by name."""
        unknowns = self.evidence.mode.unknowns
        return dict(zip(unknowns.names, self.evidence.mode.values.tolist(), strict=False))

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors of the shared values in SI units, by name."""
        unknowns, place = self.evidence.mode.unknowns, self.evidence.mode.place
        error = np.sqrt(np.diag(self.evidence.spread)) * np.abs(unknowns.slope(place.z))
        return dict(zip(unknowns.names, error.tolist(), strict=False))
