"""The fibre's own mass, as points between springs."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import jax

from fibrefit.laws.law import FibreLaw, quantity


class PointMasses(FibreLaw):
    """The fibre's own mass, as points between springs.

    Law
    ---
    n points of mass ``m_f/n`` between n + 1 equal segments of the fibre, each of which obeys the law of the whole at
    n + 1 times its own stretch, and pulls only. Without damping the lowest frequency is about ``sqrt(k/m_f)/2``.

    Valid range
    -----------
    Any number of points: what is too fast for the sampling dies out. Motion across the fibre is left out. Weigh the
    fibre and hold its mass: what a record tells of it is over within a sampling interval.

    Source
    ------
    Lumped elastic rod; the point-mass fibres of Polach and Václavík (docs/rigs.md).
    """

    name: ClassVar[str] = "fibre.mass"
    excludes: ClassVar[tuple[str, ...]] = ("pulley.inertia", "pulley.bearing_friction", "drive.compliance")
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    points: ClassVar[int] = 2
    """Number of points, n."""
    fibre_mass: jax.Array = quantity("kg", "mass of the fibre", 5e-3, lower=0.0, upper=10.0, symbol="m_f")


@functools.cache
def point_masses(number: int) -> type[PointMasses]:
    """The same effect with another number of points.

    Parameters
    ----------
    number : int
        At least 1.
    """

    class Points(PointMasses):
        __doc__ = PointMasses.__doc__
        points: ClassVar[int] = number
        _made_of: ClassVar[tuple[Any, ...]] = (PointMasses, number)

    return Points
