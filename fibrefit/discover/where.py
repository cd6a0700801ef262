"""Where model and measurement part: which record, channel, time and phase."""

from __future__ import annotations

import numpy as np

from fibrefit.discover.finding import Place
from fibrefit.fit.result import Identification
from fibrefit.problem.phases import PHASES

WINDOW = 0.010
"""Length in s of the windows whose gap is compared: a fraction of a contact."""
LOUD = 4.0
"""Mean squared residual, in units of the noise, from which a window counts: chance gives coloured noise about 2.5."""
OUT = 2.0
"""The same, in units of the record's median."""
MOST = 6


def places(found: Identification) -> tuple[Place, ...]:
    """Stretches that hold most of the gap, the largest share first.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    tuple of Place
        At most `MOST`; none where the residuals are noise.
    """
    times = np.asarray(found.problem.observations.experiment.times)
    counts = np.asarray(found.problem.observations.experiment.count)
    listed, whole = [], 0.0
    for r, record in enumerate(found.problem.layout.records):
        step = float(times[r, 1] - times[r, 0])
        width = max(round(WINDOW / step), 4)
        for c, channel in enumerate(found.problem.model.rig.channels):
            squares = found.residuals[r, c, : counts[r]] ** 2
            blocks = squares[: len(squares) // width * width].reshape(-1, width)
            powers = blocks.mean(axis=1)
            whole += float((blocks.sum(axis=1) - width)[powers > LOUD].sum())
            # Where most of a record is loud, what stands out of the rest is the place.
            for first, last in _runs(powers > max(LOUD, OUT * float(np.median(powers)))):
                inside = slice(first * width, last * width)
                phase = PHASES[int(np.bincount(found.motion.phase[r, inside]).argmax())]
                excess = float(squares[inside].sum() - (last - first) * width)
                listed.append((excess, record, channel, phase, times[r, inside.start], times[r, inside.stop - 1]))
    listed.sort(reverse=True)
    return tuple(
        Place(record, channel, phase, float(start), float(stop), excess / whole)
        for excess, record, channel, phase, start, stop in listed[:MOST]
    )


def phase_shares(found: Identification) -> dict[tuple[str, str], float]:
    """Share of the gap beyond noise in each channel and phase."""
    data = found.problem.observations
    shares: dict[tuple[str, str], float] = {}
    for c, channel in enumerate(found.problem.model.rig.channels):
        counted = np.asarray(data.weight[channel]) > 0.0
        for index, phase in enumerate(PHASES):
            inside = counted & (found.motion.phase == index)
            shares[channel, phase] = max(0.0, float((found.residuals[:, c][inside] ** 2 - 1.0).sum()))
    whole = sum(shares.values()) or 1.0
    return {key: share / whole for key, share in shares.items()}


def in_words(found: Identification) -> str:
    """One sentence on where most of the gap lies."""
    shares = phase_shares(found)
    (channel, phase), share = max(shares.items(), key=lambda item: item[1])
    return f"{100 * share:.0f} % of the gap lies in the {channel} while {phase}"


def onset(found: Identification) -> tuple[str, float] | None:
    """Record and instant [s] from which one record alone parts from the model; None if others do too."""
    gaps = {}
    for r, record in enumerate(found.problem.layout.records):
        count = int(np.asarray(found.problem.observations.experiment.count)[r])
        gaps[record] = float(np.mean(found.residuals[r, :, :count] ** 2))
    worst = max(gaps, key=lambda record: gaps[record])
    others = [gap for record, gap in gaps.items() if record != worst]
    if not others or gaps[worst] < 2.0 * max(others):
        return None
    r = found.problem.layout.records.index(worst)
    times = np.asarray(found.problem.observations.experiment.times)[r]
    step = float(times[1] - times[0])
    width = max(round(WINDOW / step), 4)
    squares = found.residuals[r].max(axis=0) ** 2
    blocks = squares[: len(squares) // width * width].reshape(-1, width).mean(axis=1)
    loud = np.flatnonzero(blocks > 2.0 * LOUD)
    return (worst, float(times[loud[0] * width])) if len(loud) else None


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Runs of true flags as (first, past last), those a window apart joined."""
    edges = np.flatnonzero(np.diff(np.r_[0, flags.astype(int), 0]))
    runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    joined: list[tuple[int, int]] = []
    for first, last in runs:
        if joined and first - joined[-1][1] <= 1:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined
