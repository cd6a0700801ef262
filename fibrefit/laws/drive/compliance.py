from __future__ import annotations

import math
from typing import ClassVar

import jax

from fibrefit.core.declarations import inverse_of
from fibrefit.laws.law import DriveLaw, quantity


class Compliance(DriveLaw):
    """A mount of the drive that yields to the pull of the fibre.

    Law
    ---
    A spring k_d between the measured drive and the end of the fibre: ``T = k_d δ``, ``e = x - δ - u``; while the fibre
    is slack, no force in it.

    Valid range
    -----------
    The mass of the mount is small against that of the weight.

    Source
    ------
    Two springs in series, one of them damped.
    """

    name: ClassVar[str] = "drive.compliance"
    yields: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    mount_stiffness: jax.Array = quantity(
        "N/m", "stiffness of the mount of the drive", 2e5, lower=1e3, null=math.inf, reciprocal=True, symbol="k_d"
    )

    def compliance(self) -> jax.Array:
        """1/k_d."""
        return inverse_of(self.mount_stiffness)
