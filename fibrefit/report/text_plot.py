"""Two curves in plain letters, for a terminal."""

from __future__ import annotations

import numpy as np

WIDTH, HEIGHT, MARGIN = 60, 13, 11
PLAIN, CHANGED = ".", "#"


def text_plot(across: str, up: str, x: np.ndarray, without: np.ndarray, with_it: np.ndarray) -> list[str]:
    """Curves as lines of text, at most 80 columns wide.

    Parameters
    ----------
    across, up : str
        What the axes show.
    x, without, with_it : (n_point,)
        The second curve is drawn over the first.
    """
    both = np.concatenate([without, with_it])
    low, high = _range(both)
    left, right = _range(x)
    cells = [[" "] * WIDTH for _ in range(HEIGHT)]
    for curve, sign in ((without, PLAIN), (with_it, CHANGED)):
        columns = np.round((x - left) / (right - left) * (WIDTH - 1)).astype(int)
        rows = np.round((high - curve) / (high - low) * (HEIGHT - 1)).astype(int)
        for row, column in zip(rows, columns, strict=True):
            cells[row][column] = sign
    marks = {0: f"{high:.3g}", HEIGHT - 1: f"{low:.3g}"}
    lines = [up]
    lines += [f"{marks.get(i, ''):>{MARGIN - 2}} |{''.join(row)}".rstrip() for i, row in enumerate(cells)]
    lines.append(" " * (MARGIN - 1) + "+" + "-" * WIDTH)
    first, last = f"{left:.3g}", f"{right:.3g}"
    lines.append(" " * MARGIN + first + across.center(WIDTH - len(first) - len(last)) + last)
    return lines


def _range(values: np.ndarray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)
