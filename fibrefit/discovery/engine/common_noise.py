"""The noise in which all hypotheses of a round are compared, and the whitening that goes with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.discovery.engine.journal import digest
from fibrefit.discovery.engine.supermodel import InputSensitivities, Supermodel
from fibrefit.problem import (
    BlockFilter,
    Noise,
    StepLikelihood,
    Steps,
    in_blocks,
    noise_of_steps,
    step_likelihood,
    whitening_of,
    with_steps,
)


@dataclass(frozen=True)
class CommonNoise:
    """The noise in which all hypotheses of a round are compared.

    Parameters
    ----------
    noise : tuple of Noise
        Of each channel, in SI units.
    whitening : BlockFilter
    sensitivities : InputSensitivities or None
        To errors of measured inputs, whitened.
    in_steps : StepLikelihood, optional
        Of channels in coarse steps, whose likelihood is that of the step a reading lies in.
    """

    noise: tuple[Noise, ...]
    whitening: BlockFilter
    sensitivities: InputSensitivities | None
    in_steps: StepLikelihood | None = None

    @property
    def steps(self) -> dict[str, Steps]:
        """Of the channels in coarse steps."""
        return {} if self.in_steps is None else dict(self.in_steps.steps)

    @property
    def words(self) -> list[str]:
        """What identifies it, as words."""
        found = [repr(of) for of in self.noise]
        found += [repr((channel, float(np.mean(of.noise)))) for channel, of in self.steps.items()]
        if self.in_steps is not None and self.in_steps.slope is not None:
            found.append(digest(self.in_steps.slope))
        return found

    def whitened(self, supermodel: Supermodel) -> Supermodel:
        """A supermodel whose residuals are whitened."""
        return replace(supermodel, whitening=self.whitening, sensitivities=self.sensitivities, in_steps=self.in_steps)

    def unwhitened(self, supermodel: Supermodel) -> Supermodel:
        """A supermodel whose residuals are those that are whitened, and its sensitivities theirs."""
        raw = supermodel.sensitivities
        if raw is not None and self.in_steps is not None:
            raw = self.in_steps.sensitivities
        return replace(supermodel, sensitivities=raw, in_steps=self.in_steps)


def common_noise_of(
    supermodel: Supermodel, noise: Sequence[Noise], in_steps: StepLikelihood | None = None
) -> CommonNoise:
    """Noise of known spectra, and the whitening that goes with it.

    Parameters
    ----------
    supermodel : Supermodel
        Any of the search, not whitened.
    noise : sequence of Noise
    in_steps : StepLikelihood, optional
        What a channel in coarse steps leaves is white, whatever `noise` says of it.
    """
    steps = {} if in_steps is None else dict(in_steps.steps)
    problem = with_steps(supermodel.problem, steps)
    channels = problem.model.rig.channels
    noise = tuple(
        noise_of_steps(steps[channel], supermodel.task.rate, of.samples) if channel in steps else of
        for channel, of in zip(channels, noise, strict=True)
    )
    whitening = in_blocks(whitening_of(problem, noise))
    sensitivities = supermodel.sensitivities if in_steps is None else in_steps.sensitivities
    if sensitivities is not None:
        sensitivities = sensitivities.through(whitening)
    return CommonNoise(noise, whitening, sensitivities, in_steps)


def steps_at(supermodel: Supermodel, local: np.ndarray, counts: np.ndarray) -> StepLikelihood | None:
    """Likelihood of channels in coarse steps, the noise before rounding most probable at some values; None without any.

    Parameters
    ----------
    supermodel : Supermodel
        Not whitened.
    local : (n_record, n_local) in SI units
    counts : (n_record,) int
    """
    if not (known := supermodel.task.steps):
        return None
    rows, problem = np.asarray(supermodel.residuals(local, counts)), supermodel.problem
    weights = problem.observations.weight
    return step_likelihood(problem.model.rig.channels, known, rows, weights, supermodel.sensitivities)
