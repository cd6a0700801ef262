from __future__ import annotations

from typing import ClassVar, Self

import jax

from fibrefit.laws.law import INSTANTS, GuideLaw, Moment, quantity


class FrictionStep(GuideLaw):
    """Friction that changes at an instant of one record, as when dirt gets into the guide.

    Law
    ---
    Level ``F_c (1 + a)`` from the instant t_s on.

    Parameters
    ----------
    change : () a pure number
        a.
    instant : () a pure number
        t_s over the length of the record.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083-1138, on friction that does not repeat.
    """

    name: ClassVar[str] = "guide.friction_step"
    timed: ClassVar[bool] = True
    sudden: ClassVar[bool] = True
    family: ClassVar[str] = "in"
    change: jax.Array = quantity("-", "relative change of Coulomb friction", 0.5, lower=-0.95, upper=20.0)
    instant: jax.Array = quantity(
        "-", "share of the record after which it happens", 0.5, lower=0.0, upper=1.0, starts=INSTANTS
    )

    def as_of(self, moment: Moment) -> Self:
        """Nothing before the instant."""
        return self.scaled(moment.past)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """A F_c."""
        return self.change * coulomb
