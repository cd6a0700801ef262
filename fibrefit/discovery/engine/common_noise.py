"""The noise in which all hypotheses of a round are compared, and the whitening that goes with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fibrefit.discovery.engine.supermodel import InputSensitivities, Supermodel, residual_rows
from fibrefit.problem.inputs.sensitivities import whitened_sensitivities
from fibrefit.problem.noise.blocks import BlockFilter, in_blocks
from fibrefit.problem.noise.rounding import before_rounding, noise_of_steps, with_steps
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import whitening_of
from fibrefit.problem.statement.steps import Steps


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
    steps : mapping of channel to Steps
        Of channels in coarse steps, whose likelihood is that of the step a reading lies in.
    """

    noise: tuple[Noise, ...]
    whitening: BlockFilter
    sensitivities: InputSensitivities | None
    steps: Mapping[str, Steps] = field(default_factory=dict)

    def whitened(self, supermodel: Supermodel) -> Supermodel:
        """A supermodel whose residuals are whitened."""
        return replace(supermodel, whitening=self.whitening, sensitivities=self.sensitivities, steps=self.steps)


def common_noise_of(
    supermodel: Supermodel, noise: Sequence[Noise], steps: Mapping[str, Steps] | None = None
) -> CommonNoise:
    """Noise of known spectra, and the whitening that goes with it.

    Parameters
    ----------
    supermodel : Supermodel
        Any of the search, not whitened.
    noise : sequence of Noise
    steps : mapping of channel to Steps, optional
        What a channel in coarse steps leaves is white, whatever `noise` says of it.
    """
    steps = steps or {}
    problem = with_steps(supermodel.problem, dict(steps))
    data, channels = problem.observations, problem.model.rig.channels
    rate = 1.0 / float(np.diff(np.asarray(data.experiment.times)[0, :2])[0])
    noise = tuple(
        noise_of_steps(steps[channel], rate, of.samples) if channel in steps else of
        for channel, of in zip(channels, noise, strict=True)
    )
    whitening = in_blocks(whitening_of(problem, noise))
    sensitivities = supermodel.sensitivities
    if sensitivities is not None:
        sensitivities = whitened_sensitivities(sensitivities, whitening)
    return CommonNoise(noise, whitening, sensitivities, steps)


def steps_at(supermodel: Supermodel, local: np.ndarray, counts: np.ndarray) -> Mapping[str, Steps]:
    """Steps of channels that are read in coarse ones, with the noise before rounding that is most probable at values.

    Where inputs have errors too, sensitivities to these are known for fine readings only, and rounding counts as noise.

    Parameters
    ----------
    supermodel : Supermodel
        Not whitened.
    local : (n_record, n_local) in SI units
    counts : (n_record,) int
    """
    known, found = supermodel.task.steps if supermodel.sensitivities is None else {}, {}
    if known:
        weights, channels = supermodel.problem.observations.weight, supermodel.problem.model.rig.channels
        rows = np.asarray(residual_rows(supermodel, local, counts)).reshape(len(local), len(channels), -1)
        for c, channel in enumerate(channels):
            if channel in known:
                weight = np.asarray(weights[channel])
                found[channel] = before_rounding(known[channel], rows[:, c][weight > 0.0] / weight[weight > 0.0])
    return found
