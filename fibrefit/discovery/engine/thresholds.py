"""When a gain is more than chance, and when two explanations are the same.

Noise of a logger wanders, so chance can imitate a slow effect more easily than white noise could: gains are measured
in units of `colour`. Parameters that differ a little from record to record imitate effects too: a gain only counts if
it remains when the base parameters may scatter.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fibrefit.problem.noise.spectrum import Noise

SLOW = 5.0
"""Frequency in Hz of what effects do to a record: bounces and strokes."""
CHANCE, USUAL = 20.0, 30
"""Gain of 2 log likelihood that the best of so many candidates reaches by chance once in a thousand searches."""
EACH = 4.0
"""The same for each further parameter of a candidate."""
KNOT = 2.0
"""Gain of 2 log likelihood that a knot of a free curve reaches by chance, the spread of many of them included."""
WORTH = 0.004
"""Share of the cost a gain must amount to, to be worth a name: models of a rig are no better than that."""
WORTH_WITH_INPUTS = 0.002
"""The same where errors of measured inputs are found too: they take up most of what a missing effect leaves."""
ALIKE = 0.01
"""Share of the noise floor by which two explanations may differ and still be alike."""
NOISE_LIKE = 1.045
"""Gap up to which a model leaves only noise; the noise itself is known to about two percent."""

LOUDER = 1.06
"""Gap while the rig moves over that at rest, in the same records, up to which nothing but noise is left of the motion:
no error in what the noise is taken to be enters it."""
RESTING = 1000.0
"""Samples at rest needed to say so."""


def colour(noise: Mapping[str, Noise], rates: Mapping[str, float], duration: float) -> float:
    """Power of the noise at the frequency of the motion over its mean power; 1 for white noise.

    Parameters
    ----------
    noise : mapping of channel to Noise
    rates : mapping of channel to sampling rate in Hz
    duration : float
        Of a record, in s.
    """
    return max(1.0, float(np.mean(_powers(noise, rates, duration, SLOW))))


def slowest(noise: Mapping[str, Noise], rates: Mapping[str, float], duration: float) -> float:
    """Power of the noise over its mean at half a period in a record, in the channel where it is largest.

    Parameters as `colour`. No effect meets noise of more power: none acts more slowly.
    """
    return max(1.0, *_powers(noise, rates, duration, 0.5 / duration))


def _powers(noise: Mapping[str, Noise], rates: Mapping[str, float], duration: float, frequency: float) -> list[float]:
    at = np.array([frequency])
    return [float(seen.over_mean(at, duration, rates[channel])[0]) for channel, seen in noise.items()]


def chance(parameters: int, candidates: int = USUAL) -> float:
    """Gain of 2 log likelihood that the best of so many candidates with so many parameters hardly reaches by chance."""
    return CHANCE + 2.0 * float(np.log(max(candidates, USUAL) / USUAL)) + EACH * parameters


def needed(parameters: int, candidates: int, kappa: float, cost: float, with_inputs: bool) -> float:
    """Gain of 2 log likelihood from which a candidate is given its name.

    Parameters
    ----------
    parameters : int
        It adds.
    candidates : int
        It was the best of.
    kappa : float
        Colour of the noise.
    cost : float
        Of the model without it.
    with_inputs : bool
        Whether errors of measured inputs are found too.
    """
    worth = WORTH_WITH_INPUTS if with_inputs else WORTH
    return max(kappa * chance(parameters, candidates), worth * cost)


def alike(cost: float, other: float, samples: float, kappa: float) -> bool:
    """Whether two explanations with these costs cannot be told apart."""
    return abs(other - cost) < max(ALIKE * samples, 10.0 * kappa)


def outdone(cost: float, parameters: int, curve: float, knots: int, kappa: float) -> bool:
    """Whether a free curve with so many knots explains more than names with so many parameters, beyond chance."""
    return cost - curve > kappa * KNOT * (knots - parameters)
