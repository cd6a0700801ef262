"""What all hypotheses of a round are measured with: the noise, and the whitening that goes with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fibrefit.discovery.engine.supermodel import InputSensitivities, Supermodel
from fibrefit.problem.inputs.sensitivities import whitened_sensitivities
from fibrefit.problem.noise.blocks import BlockFilter, in_blocks
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import whitening_of


@dataclass(frozen=True)
class Yardstick:
    """What all hypotheses of a round are measured with.

    Parameters
    ----------
    noise : tuple of Noise
        Of each channel, in SI units.
    whitening : BlockFilter
    sensitivities : InputSensitivities or None
        To errors of measured inputs, whitened.
    """

    noise: tuple[Noise, ...]
    whitening: BlockFilter
    sensitivities: InputSensitivities | None

    def on(self, frame: Supermodel) -> Supermodel:
        """A frame whose residuals are whitened."""
        return replace(frame, whitening=self.whitening, sensitivities=self.sensitivities)


def yardstick_of(frame: Supermodel, noise: Sequence[Noise]) -> Yardstick:
    """Yardstick for noise of known spectra.

    Parameters
    ----------
    frame : Supermodel
        Any of the search, not whitened.
    noise : sequence of Noise
    """
    whitening = in_blocks(whitening_of(frame.problem, noise))
    sensitivities = frame.sensitivities
    if sensitivities is not None:
        sensitivities = whitened_sensitivities(sensitivities, whitening)
    return Yardstick(tuple(noise), whitening, sensitivities)
