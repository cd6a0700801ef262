from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import FibreLaw, quantity


class FreeLengthOffset(FibreLaw):
    """A fibre that is longer or shorter than its nominal length.

    Law
    ---
    Stretch ``e - e_0`` instead of e.

    Valid range
    -----------
    Any; small against the length of the fibre.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.free_length_offset"
    # On the drive rig the tension at the start is known, and the zero of position is not: nothing would change.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.TAUT_POINT})
    length_offset: jax.Array = quantity(
        "m",
        "excess of the free length over the nominal one; negative: a preload",
        2e-4,
        lower=-0.02,
        upper=0.02,
        symbol="e_0",
    )

    def initial_slack(self) -> jax.Array:
        """e_0."""
        return self.length_offset
