"""At which speeds each record tells of each parameter."""

from __future__ import annotations

import numpy as np

from fibrefit.core.declarations import LOADING, UNLOADING
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.thresholds import STANDING

SLOWEST, FASTEST = 0.05, 0.95
"""Shares of the moving samples between whose speeds a record is said to tell of a parameter."""


def speeds_of(motion: Motion, counts: np.ndarray) -> dict[str, np.ndarray]:
    """Slow end, root mean square and fast end of the speeds that tell of each parameter, ``(n_record, 3)`` in m/s.

    Stiffness and damping by the rate of stretch of the taut fibre, friction by the speed of the weight in its guide;
    NaN where a record shows none.

    Parameters
    ----------
    motion : Motion
    counts : (n_record,) int
        Samples of each record.
    """
    there = np.arange(motion.phase.shape[1]) < counts[:, None]
    guide = np.abs(motion.states["speed"])
    found = {"friction": _spans(guide, there & (guide > STANDING))}
    if "stretch rate" in motion.states:
        rate = np.abs(motion.states["stretch rate"])
        taut = there & np.isin(motion.phase, (LOADING, UNLOADING)) & (rate > STANDING)
        found["stiffness"] = found["damping"] = _spans(rate, taut)
    return found


def _spans(speeds: np.ndarray, moving: np.ndarray) -> np.ndarray:
    rows = []
    for speed, here in zip(speeds, moving, strict=True):
        seen = speed[here]
        if not seen.size:
            rows.append([np.nan] * 3)
            continue
        slow, fast = np.quantile(seen, [SLOWEST, FASTEST])
        rows.append([float(slow), float(np.sqrt(np.mean(seen**2))), float(fast)])
    return np.array(rows)


def span(rows: np.ndarray) -> tuple[float, float]:
    """Slowest and fastest of all records."""
    return float(np.nanmin(rows[:, 0])), float(np.nanmax(rows[:, 2]))
