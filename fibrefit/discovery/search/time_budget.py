"""What time is kept for the end of a search, and how long simulations of a hypothesis take."""

from __future__ import annotations

import time

import numpy as np

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.search.search import Search

CONCLUDING = 0.1, 0.35
"""Least and largest share of the time given that is kept for tests of what was found and for the fit of the final
model. Of 300 s, a conclusion of drops took 17 s with two effects and 25 s with three, free curves left out."""
NOTHING_NAMED = 0.2
"""Least share of it while nothing is named: what is told then are free curves and a law, which come with the
conclusion. Where something is, they are sooner left out than a further effect."""
FINAL = 1.5
"""Factor on the time that the first fit ran, compiling aside, that is kept for these: in four driven searches they took
0.7 to 2.4 times all of that fit, in a fifth 1.1, and in one 6 times, which the least share covers; what they take
beyond it ends within what is kept for last steps. With twice that fit the fifth ended 45 s early, its second effect
not looked for."""
FITTED_AGAIN = 2.0
"""Factor on the time of the first fit, and on how much slower simulations are with what was found, that is kept for the
final fit beside that: one of drops with a fibre of mass took 17 times the first, its simulations 8 times as long."""
LAST_STEPS = 0.07
"""Share of the time given that goes to steps which end after it: a clock is looked at between steps, and the last ones
are taken whatever it says. Of 551 searches of 300 s four were late by 1 to 7 %, and one beside other work by 19 %."""
RUNS = 2
"""Simulations that are timed; the shortest counts."""


def time_to_use(given: float) -> float:
    """Time after which a search begins nothing more, for the time given, in s: its last steps end within that."""
    return (1.0 - LAST_STEPS) * given


def kept_for_conclusion(first: float, given: float, named: bool = True) -> float:
    """Time kept for a conclusion.

    Parameters
    ----------
    first : float
        Time in s that the first fit ran, compiling aside, or what that would have been with the model that was found.
    given : float
        For all, in s.
    named : bool
        Whether an effect was named by then.
    """
    least, most = CONCLUDING[0] if named else NOTHING_NAMED, CONCLUDING[1]
    return min(max(FINAL * first, least * given), most * given)


def slowdown(search: Search, fitted: LaplaceFit) -> float:
    """Time a simulation of a hypothesis takes over that of the base model, at least one.

    An effect that makes the equations stiff makes all that follows so much slower.
    """
    base = search.base
    return max(
        _seconds(search, fitted.supermodel, fitted.local) / _seconds(search, base.supermodel, base.fit.local), 1.0
    )


def _seconds(search: Search, supermodel: Supermodel, local: np.ndarray) -> float:
    times = []
    for _ in range(1 + RUNS):
        began = time.perf_counter()
        np.asarray(supermodel.residuals(local, search.context.whole))
        times.append(time.perf_counter() - began)
    # The first may have compiled.
    return max(min(times[1:]), 1e-6)
