"""What all hypotheses of a round are measured with: the noise, and the whitening that goes with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fibrefit.discovery.engine.supermodel import Frame, Reactions
from fibrefit.problem.inputs.reactions import reactions_through
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import whitening_of


@dataclass(frozen=True)
class Yardstick:
    """What all hypotheses of a round are measured with.

    Parameters
    ----------
    noise : tuple of Noise
        Of each channel, in SI units.
    whitening : Coloured
    reactions : Reactions or None
        To errors of measured inputs, whitened.
    """

    noise: tuple[Noise, ...]
    whitening: Coloured
    reactions: Reactions | None

    def on(self, frame: Frame) -> Frame:
        """A frame whose residuals are whitened."""
        return replace(frame, whitening=self.whitening, reactions=self.reactions)


def yardstick_of(frame: Frame, noise: Sequence[Noise]) -> Yardstick:
    """Yardstick for noise of known spectra.

    Parameters
    ----------
    frame : Frame
        Any of the search, not whitened.
    noise : sequence of Noise
    """
    whitening = whitening_of(frame.problem, noise)
    reactions = frame.reactions
    if reactions is not None:
        reactions = reactions_through(reactions, whitening)
    return Yardstick(tuple(noise), whitening, reactions)
