"""Instants that records have in common: where the fibre goes taut or slack, where the weight sets off or stops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.core.declarations import HELD, REST, SLACK, STICKING, TAUT
from fibrefit.rigs.signals.rest import runs

MOST = 6
"""Instants of a kind, at most: the later ones are too small to be compared."""
SHORTEST_PHASE = 4
"""Samples that a phase must last for its beginning to be one of them."""
STILL = (HELD, REST, STICKING)


class Instant(NamedTuple):
    """An instant with the name of what happens then.

    Parameters
    ----------
    kind : str
        ``let go``, ``take-up 1``, ``release 1``, ``sets off 1``, ``stops 1``.
    at : float, in s
    """

    kind: str
    at: float


def moments(times: np.ndarray, phase: np.ndarray) -> list[Instant]:
    """Instants of a record in their order.

    Parameters
    ----------
    times : (n_time,) in s
    phase : (n_time,) int
        Index into `fibrefit.core.declarations.PHASES`.
    """
    held = phase == HELD
    found = [Instant("let go", one.at) for one in _begins("", times, ~held)[:1]] if held[:1].all() else []
    loaded = np.isin(phase, TAUT)
    if loaded.any() and (phase == SLACK).any():
        # What was held and is slack when it is let go was not released by the fibre.
        found += [*_begins("take-up", times, loaded), *_begins("release", times, (phase == SLACK) | held)]
    else:
        still = np.isin(phase, STILL)
        found += [*_begins("sets off", times, ~still), *_begins("stops", times, still)]
    return sorted(found, key=lambda one: one.at)


def _begins(kind: str, times: np.ndarray, inside: np.ndarray) -> list[Instant]:
    """Where `inside` becomes true, and stays so for a while; not at the first sample, where nothing begins."""
    starts = [first for first, last in runs(inside).tolist() if first > 0 and last - first >= SHORTEST_PHASE]
    return [Instant(f"{kind} {number}", float(times[first])) for number, first in enumerate(starts[:MOST], 1)]
