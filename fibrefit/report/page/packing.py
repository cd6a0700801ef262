"""Long arrays as text a page can hold: rounded to a stated step, differenced, cut into planes of bytes, deflated.

What a logger reads is noise below some step; rounded to a hundredth of its noise a record loses nothing that could be
seen, and its differences need a byte or two each. `unpack.js` is the way back.

Source
------
Deflate: RFC 1951, in the wrapping of RFC 1950, which browsers know as ``deflate``.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from fibrefit.rigs.signals.rest import runs

ORDERS = (1, 2)
"""Differences that are tried: of noise the first, of a smooth line the second are small."""
LARGEST = 2**30


def packed(series: Mapping[str, tuple[np.ndarray, float]]) -> dict[str, Any]:
    """Arrays of one length as one text.

    Parameters
    ----------
    series : mapping of str to (values, step)
        Values ``(n,)``, NaN where there is none, and the step they are rounded to.

    Returns
    -------
    dict
        ``length``; ``series``: for each its ``name``, ``step``, ``order`` of differences, ``planes`` of bytes, lowest
        first, and ``missing`` stretches as (first, number); ``deflated``: the planes of all, in base64.
    """
    packed_series, planes, length = [], [], 0
    for name, (values, step) in series.items():
        length = len(values)
        whole, missing, step = _whole(np.asarray(values, dtype=float), step)
        order, signed = min(
            ((order, np.diff(whole, order, prepend=np.zeros(order, dtype=np.int64))) for order in ORDERS),
            key=lambda one: float(np.log2(1.0 + np.abs(one[1])).sum()),
        )
        # Zigzag: small differences of either sign become small numbers.
        unsigned = np.where(signed < 0, -2 * signed - 1, 2 * signed).astype("<u8")
        number = max(1, (int(unsigned.max(initial=0)).bit_length() + 7) // 8)
        planes += [((unsigned >> (8 * i)) & 0xFF).astype(np.uint8).tobytes() for i in range(number)]
        packed_series.append({"name": name, "step": step, "order": order, "planes": number, "missing": missing})
    deflated = base64.b64encode(zlib.compress(b"".join(planes), 9)).decode()
    return {"length": length, "series": packed_series, "deflated": deflated}


def _whole(values: np.ndarray, step: float) -> tuple[np.ndarray, list[tuple[int, int]], float]:
    """Multiples of a step, stretches without a value, and the step, larger where numbers would become too long."""
    known = np.isfinite(values)
    missing = [(first, last - first) for first, last in runs(~known).tolist()]
    if not known.any():
        return np.zeros(len(values), dtype=np.int64), missing, 1.0
    largest = float(np.abs(values[known]).max())
    step = max(step, largest / LARGEST) or 1.0
    # Each missing value repeats the one before it.
    before = np.maximum.accumulate(np.where(known, np.arange(len(values)), 0))
    filled = np.where(np.isfinite(values[before]), values[before], values[known][0])
    return np.round(filled / step).astype(np.int64), missing, step
