"""What a Gauss-Newton search asks of records: products of slopes and residuals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

Gram = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Products ``(n_record, n_column + 1, n_column + 1)`` of the changes of all residuals, and of the residuals, when the
columns ``(n_column,)`` of local values ``(n_record, n_local)`` go to targets ``(n_record, n_column)``."""


@runtime_checkable
class Corrected(Protocol):
    """A `Gram` whose slopes are not always simulated; `exact` tells whether those of the last products were."""

    exact: bool

    def renew(self) -> None:
        """Have all slopes simulated where products are needed next."""
