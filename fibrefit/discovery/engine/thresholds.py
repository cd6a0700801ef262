"""Every number that decides a verdict, with its meaning and where it comes from.

Logarithms of Bayes factors are in nats: five are odds of 150 to one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from fibrefit.problem.estimate.evidence import MarginalLikelihood

NAMED = 5.0
"""Logarithm of the Bayes factor from which an effect is named. On forty series without an effect the largest was 0.5 in
the study that set it (docs/likelihood.md)."""
APART = 5.0
"""Nats within which two explanations are not told apart."""
SIMPLER = 3.0
"""Nats within which the explanation with fewer parameters is taken first; the others are told as its rivals. Up to
there evidence is not called strong (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995); their scale is twice this one)."""
BEYOND_DOUBT = 100.0
"""Nats that no inflation of the scores' variance makes doubtful."""
NOISE_LIKE = 1.045
"""Normalised residual RMS up to which a model leaves only noise; the noise itself is known to about two percent."""
ALARM = 1e-4
"""Probability of innovations as strange as these, if the model were complete, below which it is not."""
CONTRADICTED = 1e-5
"""The same for slow noise that records at rest do not show: rests are short, and their noise may change."""
ENOUGH = 1.02
"""Gap above which something is left to be found, whatever slopes say: the noise itself is not known better."""
TELLS = 0.6
"""Share of the gap a curve must account for to be what the missing effect looks like: more than half, so that no other
could account for as much."""
CARRIED = 0.05
"""Relative change of a base parameter from which it is said to have carried part of a missing effect: a change that a
person who compares two tables would see."""
UNIQUE = 0.02
"""Share of an effect's change that must not be imitable by the base parameters, for the effect to be visible at all:
below it, what is left after projection is the error of the integrator's slopes."""
RANK = 1e-4
"""Share of a record's information below which a direction is not seen in a part of it: an error a hundred times that
of the whole record, beyond which an innovation is rounding."""
FEWEST = 8
"""Ordinates of a record at rest that tell its noise: their mean is known to a third."""
QUANTISED = 0.3
"""Power of the fast noise at rest over that in motion below which it is not noise that is seen at rest but steps."""


PRICE = 4.0
"""Nats a parameter usually costs before it explains anything: the logarithm of what the records narrow its prior by."""


def gate(parameters: int, louder: float = 1.0) -> float:
    """Gain in twice the log likelihood from which an effect with so many parameters is expected to get its name.

    Parameters
    ----------
    parameters : int
    louder : float
        Power of what is left unexplained where the effect acts, in units of the noise.
    """
    return 2.0 * (NAMED + PRICE * parameters) * louder


def occam(before: MarginalLikelihood, after: MarginalLikelihood) -> float:
    """Nats that further parameters cost before they explain anything, ``after`` being ``before`` with them."""
    return 0.5 * (before.mode.objective - after.mode.objective) - (after.log - before.log)


def false_alarm(log_factor: float, candidates: Sequence[tuple[int, float]]) -> float:
    """Probability that the best of candidates reaches a Bayes factor although nothing is missing.

    Noise and scatter drawn through the whitened slopes of the base give each candidate a chi-squared gain, of which its
    Occam factor is taken off; candidates count as independent, which is on the safe side.

    Parameters
    ----------
    log_factor : float
        Logarithm of the Bayes factor.
    candidates : sequence of (int, float)
        Parameters each adds, and what they cost, see `occam`.
    """
    silent = [chi2.cdf(2.0 * max(log_factor + cost, 0.0), parameters) for parameters, cost in candidates]
    return float(-np.expm1(np.sum(np.log(np.maximum(silent, 1e-300)))))
