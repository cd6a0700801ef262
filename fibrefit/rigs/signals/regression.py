"""A spring and a damper side by side, from forces and how they are stretched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core.errors import DataError

LEAST = 1e-4
"""Damping in N s/m over stiffness in N/m below which a search would not begin: at zero it has no slope."""


def spring_and_damper(
    stretched: Sequence[np.ndarray], forces: Sequence[np.ndarray], refused: DataError
) -> tuple[float, float]:
    """Stiffness in N/m and damping in N s/m by least squares.

    Parameters
    ----------
    stretched : sequence of (n_sample, 2)
        Stretch in m and its rate in m/s, of each record where it carries load.
    forces : sequence of (n_sample,) in N
    refused : DataError
        Raised where the force does not grow with the stretch.
    """
    (stiffness, damping), *_ = np.linalg.lstsq(np.concatenate(stretched), np.concatenate(forces), rcond=None)
    if not stiffness > 0.0:
        raise refused
    return float(stiffness), float(max(damping, LEAST * stiffness))
