"""Kinds of noise: what each of them offers, and where it is. Nothing else in the program names one."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from fibrefit.problem import Whitening
    from fibrefit.sampling.density.filters import NoiseEvidence

KINDS = {
    "white": "fibrefit.sampling.density.filters:WhiteNoise",
    "autoregressive": "fibrefit.sampling.density.filters:AutoregressiveNoise",
    "coloured": "fibrefit.sampling.density.filters:ColouredNoise",
}
"""By the name under which it is requested, module and class of each `NoiseKind`: what lists them imports none."""
OF_A_FIT = "coloured"
"""The kind that a fit takes."""


class NoiseKind(Protocol):
    """What a kind of noise offers; what its `parameters` are is its own affair."""

    def estimate(self, evidence: NoiseEvidence) -> tuple[Any, int]:
        """Parameters, and how many numbers they are, which a comparison of kinds pays for."""

    def whiten(self, parameters: Any, evidence: NoiseEvidence) -> Whitening:
        """The filter that makes innovations of such noise."""

    def describe(self, parameters: Any, channels: Sequence[str]) -> tuple[str, tuple[float, ...]]:
        """Words in which numbers have places such as ``%.3g``, and the numbers."""


def noise_kind(name: str) -> NoiseKind:
    """The kind of a name in `KINDS`."""
    module, _, kind = KINDS[name].partition(":")
    found: NoiseKind = getattr(import_module(module), kind)()
    return found
