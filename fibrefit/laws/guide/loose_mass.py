from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import GuideLaw, quantity


class LooseMass(GuideLaw):
    """A part of the weight that hangs loosely on it and swings along the guide.

    Law
    ---
    A share μ of the mass on a spring and a damper: ``w'' = -ω^2 (w - u) - 2 ζ ω (w' - u')``, ω = 2π f, w from
    where it hangs at rest; ``μ m (ω^2 (w - u) + 2 ζ ω (w' - u'))`` on the rest of the weight.

    Valid range
    -----------
    Motion along the guide, without stops. A part that is held fast (large f) changes nothing.

    Source
    ------
    Den Hartog, Mechanical Vibrations (1956), ch. 3: the auxiliary mass.
    """

    name: ClassVar[str] = "guide.loose_mass"
    # In windows that begin anew it would have to be known how far it has swung.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    carries: ClassVar[bool] = True
    loose_share: jax.Array = quantity(
        "-", "share of the mass that hangs loosely", 0.05, lower=0.0, upper=0.9, symbol="μ"
    )
    frequency: jax.Array = quantity(
        "Hz",
        "its own frequency on a weight that is held",
        20.0,
        lower=0.5,
        upper=300.0,
        log=True,
        starts=(4.0, 8.0, 16.0, 32.0, 64.0),
        symbol="f",
    )
    damping_ratio: jax.Array = quantity("-", "its damping ratio", 0.05, lower=1e-3, upper=2.0, symbol="ζ")

    def loose(self) -> tuple[jax.Array, jax.Array, jax.Array]:
        """Share, angular frequency and damping ratio."""
        return self.loose_share, 2.0 * jnp.pi * self.frequency, self.damping_ratio
