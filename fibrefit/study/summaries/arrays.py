"""Arrays with units, as results keep them: what figures and pages ask of a variable of ``result.h5``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np


class Array(Protocol):
    """A variable: its values, and their SI unit."""

    @property
    def values(self) -> np.ndarray: ...  # noqa: D102
    @property
    def unit(self) -> str: ...  # noqa: D102


Groups = Mapping[str, Mapping[str, Array]]
"""Group to name to variable."""
