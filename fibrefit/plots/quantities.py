"""Names and units as a person reads them on an axis."""

from __future__ import annotations

import numpy as np

from fibrefit.core.formatting import shown_unit, typeset_unit


def readable_unit(values: np.ndarray, si: str) -> tuple[str, float]:
    """Unit for an axis on which `values` (in SI) are drawn, and what it is worth in SI."""
    finite = np.abs(values[np.isfinite(values)]) if np.size(values) else np.empty(0)
    unit, worth = shown_unit(float(finite.max()) if finite.size and finite.max() > 0.0 else 1.0, si)
    return typeset_unit(unit), worth


def last_part(name: str) -> str:
    """The last part of a dotted name, without its record; of a level of noise all of it, as its channel is another."""
    return name if name.startswith("noise.") else name.partition("[")[0].rpartition(".")[2]


def axis_label(name: str, unit: str) -> str:
    """``position / mm``, the way of the standard for quantities (ISO 80000-1); the bare name for a pure number."""
    words = name.replace("_", " ")
    return words if unit in ("-", "") else f"{words} / {unit}" if "/" not in unit else f"{words} / ({unit})"
