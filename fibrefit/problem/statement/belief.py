"""What is believed of a value before the records speak: in a least-squares fit, one more residual."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fibrefit.problem.statement.arrays import functions_for


@dataclass(frozen=True)
class Belief:
    """A normal density of a value, or of its logarithm.

    Parameters
    ----------
    centre : float
        Mean, or median where `log`; in SI units.
    spread : float
        Standard deviation, of the logarithm where `log`.
    """

    centre: float
    spread: float
    log: bool = False

    def residual(self, value: Any) -> Any:
        """Distance of a value ``()`` from the centre in standard deviations; NumPy or JAX."""
        if self.log:
            return functions_for(value).log(value / self.centre) / self.spread
        return (value - self.centre) / self.spread

    def slope(self, value: Any) -> Any:
        """Change of the residual with the value ``()``, per SI unit; NumPy or JAX."""
        return (1.0 / value if self.log else 1.0) / self.spread

    @property
    def relative(self) -> float:
        """Standard deviation as a share of the centre; infinite about zero."""
        if self.log:
            return self.spread
        return abs(self.spread / self.centre) if self.centre else float("inf")
