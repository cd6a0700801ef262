from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.forms_of_change import OfFriction
from fibrefit.laws.law import Moment, quantity


class FrictionWear(OfFriction):
    """Friction that grows or falls with the path travelled, as surfaces run in or wear.

    Law
    ---
    Level ``F_c (1 + a (1 - exp(-s/σ)))``, s the path of the weight to and fro within the record.

    Valid range
    -----------
    σ from some millimetres on; of a much longer one, only a/σ is known.

    Source
    ------
    Wear over sliding distance: Archard, J. Appl. Phys. 24 (1953) 981-988.
    """

    name: ClassVar[str] = "guide.friction_wear"
    # A path is counted from where a record begins; in windows that begin anew there is none.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    timed: ClassVar[bool] = True
    history: ClassVar[tuple[str, ...]] = ("path",)
    wear: jax.Array = quantity(
        "-", "relative change of Coulomb friction in the end", 0.3, lower=-0.98, upper=20.0, symbol="a"
    )
    path: jax.Array = quantity("m", "path on which it settles", 0.1, lower=2e-3, upper=100.0, log=True, symbol="σ")

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(-jnp.expm1(-moment.path / self.path))

    def relative(self) -> jax.Array:
        """The wear."""
        return self.wear
