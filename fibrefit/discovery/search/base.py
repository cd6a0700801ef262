"""What a search works with: a task, effects, compiled programs, and the noise that hypotheses are compared in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from threading import Lock
from typing import Any, Self

import numpy as np

from fibrefit.core.limits import Progress, beyond_limits
from fibrefit.discovery.engine.candidates import (
    Hypothesis,
    SearchContext,
)
from fibrefit.discovery.engine.journal import Journal, digest, known_by_name, name_of, signature_of
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.linearisation import AS_BEGUN, Linearisation
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.engine.supermodel import Supermodel, is_quick, supermodel_of
from fibrefit.laws.catalogue import is_costly
from fibrefit.laws.law import Effect
from fibrefit.problem import Task


@dataclass(frozen=True)
class SearchState(ABC):
    """What all rounds of a search have in common.

    Parameters
    ----------
    task : Task
        Of the model the search began with.
    effects : tuple of Effect classes
        That may be added.
    context : SearchContext
    base : Hypothesis
        Nothing added, in plain least squares.
    inference : LaplaceInference
        Of hypotheses, in the noise they are compared in now.
    tell : callable
    supermodels : list of Supermodel
        Compiled so far; a store of programs, not of results.
    lock : Lock
        Of that store.
    linearisation : Linearisation
        Where readings are linearised in errors of inputs.
    """

    task: Task
    effects: tuple[type[Effect], ...]
    context: SearchContext
    base: Hypothesis
    inference: LaplaceInference
    tell: Progress
    supermodels: list[Supermodel] = field(default_factory=list)
    lock: Lock = field(default_factory=Lock, repr=False)
    linearisation: Linearisation = AS_BEGUN

    def signature(self, parent: LaplaceFit | Hypothesis) -> str:
        """Digest of a hypothesis, and of the noise and errors of inputs it is seen with."""
        return signature_of(parent, self.inference.common_noise.words)

    def recalled(
        self, what: str, parent: LaplaceFit | Hypothesis, about: object, job: Callable[[], Any],
        own: Supermodel | None = None,
    ) -> Callable[[], Any]:  # fmt: skip
        """A job that asks the journal first, for a search that was cut short.

        Parameters
        ----------
        what : str
            Kind of the job.
        parent : LaplaceFit or Hypothesis
        about : object
            What else its result depends on: names, numbers, arrays and sequences of them, identified by their `digest`.
        job : callable
        own : Supermodel, optional
            That of the result where it is none of the search: with free curves, or composed laws.
        """
        effects = (*self.task.problem.model.effects, *self.effects)
        journal = Journal(self.inference.folder, name_of, known_by_name(effects, self.supermodel_with, own))
        return partial(journal.recall, digest(what, self.signature(parent), about), job)

    @cached_property
    def samples(self) -> float:
        """Number of samples that count."""
        return float(self.base.supermodel.samples.sum())

    def with_inference(self, inference: LaplaceInference) -> Self:
        """The same search with hypotheses compared in another noise."""
        return replace(self, inference=inference)

    def gap(self, hypothesis: Hypothesis) -> float:
        """Rms of what a hypothesis leaves of the samples that count where it was fitted, in units of the noise."""
        return float(np.sqrt(hypothesis.fit.cost / hypothesis.supermodel.samples.sum()))

    def plain(self, fitted: LaplaceFit) -> Hypothesis:
        """A hypothesis at its posterior mode, with what it leaves in plain squares."""
        with beyond_limits():  # What was found is not lost for one simulation.
            cost = float(fitted.supermodel.costs(fitted.local, self.context.whole).sum())
        return Hypothesis(fitted.effects, Refit(fitted.local, cost), fitted.supermodel)

    def gap_left(self, fitted: LaplaceFit) -> float:
        """RMS of what a fit leaves over that of the noise, linearised in nothing: simulated."""
        return self.gap(self.plain(fitted))

    def shares_a_program(self, effect: type[Effect]) -> bool:
        """Whether one program holds it beside any other effects; with noisy inputs each round has its own."""
        return is_quick(effect) and self.base.supermodel.sensitivities is None

    @abstractmethod
    def supermodel_for(self, effect: type[Effect], others: Sequence[type[Effect]] = ()) -> Supermodel:
        """A supermodel that holds an effect and others; made where there is none yet.

        Parameters
        ----------
        effect : Effect class
        others : sequence of Effect classes
            All that may be present beside it.
        """

    def supermodel_with(self, effects: Sequence[type[Effect]]) -> Supermodel:
        """The supermodel that holds these effects and no others; made where there is none yet."""
        held = {*self.task.problem.model.effects, *effects}
        with self.lock:
            for supermodel in self.supermodels:
                if set(supermodel.effects) == held:
                    return supermodel
            # Always in one order: a program that was compiled before serves again.
            added = sorted(held - set(self.task.problem.model.effects), key=lambda effect: effect.name)
            whole = self.base.supermodel
            if set(whole.effects) <= held:
                supermodel = whole.widened([effect for effect in added if effect not in whole.effects])
            else:
                supermodel = supermodel_of(self.task, added, whole.sensitivities)
            self.supermodels.append(supermodel)
            return supermodel

    @abstractmethod
    def extensions(self, parent: LaplaceFit) -> tuple[type[Effect], ...]:
        """Effects that may be added to a hypothesis."""

    def swift_extensions(self, parent: LaplaceFit) -> tuple[type[Effect], ...]:
        """Effects that may be added to a hypothesis and are not tried last, see `is_costly`."""
        return tuple(effect for effect in self.extensions(parent) if not is_costly(effect))
