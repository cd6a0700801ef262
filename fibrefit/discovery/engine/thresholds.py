"""Every number that decides a verdict, with its meaning and where it comes from.

Logarithms of Bayes factors are in nats: five are a ratio of 150 to one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from fibrefit.problem import MarginalLikelihood

NAMED = 5.0
"""Logarithm of the Bayes factor from which an effect is named. On forty series without an effect the largest was 0.5 in
the study that set it (docs/likelihood.md)."""
APART = 5.0
"""Nats within which two explanations are not distinguished."""
SIMPLER = 3.0
"""Nats within which the explanation with fewer parameters is taken first; the others are reported as its rivals. Up to
there evidence is not called strong (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995); their scale is twice this one)."""
BEYOND_DOUBT = 100.0
"""Nats that no overdispersion of the scores makes doubtful."""
OBJECTS = 8.0
"""Nats that a single record may lose to a model without an effect: one in which the effect acts loses so many with a
probability of one in three thousand at the most (Markov's inequality of a likelihood ratio). Of seven true ones, some
of them beside a second, none made a record less probable by more than 2.4; one that was not there, in drives read in
coarse steps, gained 56 nats of five records and lost 17 and 5 in two."""
LIKENESS = 0.1
"""Share of what an effect gains that it leaves, by the tests of the innovations, from which it may be but the likeness
of a law that is not in the catalogue: of two that change the readings alike to 0.95 one leaves so much of the other."""
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
INSEPARABLE = 0.98
"""Cosine beyond which two effects change the records in the same way: of either, a fifth is its own."""
RANK = 1e-4
"""Share of a record's information below which a direction is not seen in a part of it: an error a hundred times that
of the whole record, beyond which an innovation is rounding."""
FEWEST_ORDINATES = 8
"""Ordinates of a record at rest that tell its noise: their mean is known to a third."""
QUANTISED = 0.3
"""Power of the fast noise at rest over that in motion below which it is not noise that is seen at rest but steps."""
SLOW_BELOW, FAST_ABOVE = 40.0, 100.0
"""Frequencies in Hz below and above which the noise at rest is held against that in motion: between the
two lie the mains."""

WRONGLY = 0.01
"""Chance that noise alone is called loud anywhere in all the looks: one series in a hundred."""
KNOWN = 3.3
"""Standard errors by which the noise at rest may have been taken for less than it is: once in two thousand."""
LOUDER_STILL = 2.0
"""Where most of a record is loud, the excess of a place over noise, in units of the record's median excess, from which
it is reported: what all of it has is no place."""
ONE_WAY = 0.8
"""Share of a gap from which all of it is said to lie where the guide slides in one way, or the drive moves."""
OF_TIME = 0.7
"""Share of the time from which that goes without saying."""
BY_ITSELF = 2.0
"""Mean squared residual of a record over the largest of the others from which it alone is said to depart from the
model: that of noise of a thousand samples scatters by a twentieth."""
HAPPENED = 8.0
"""Mean squared residual of a window, in units of the noise, from which an event has happened."""
SOON = 2.0 / 3.0
"""Share of a gap that makes most of it."""
DENSE = 2.0
"""How much denser than on average a gap must lie after take-up to be said to lie there."""
ORDERED = 0.01
"""Probability by chance of an order of the contacts by their speeds, below which it is reported: once in a hundred."""
FEWEST_CONTACTS = 6
"""Contacts that can show an order at all: five are in one by chance once in sixty times."""
FEWEST_IN_CONTACT = 4
"""Samples by which a contact is judged: their mean square scatters by seven tenths."""
NARROW = 0.5
"""Share of a gap that a third of an octave must hold to be said to have it."""
FEWEST_IN_BAND = 3
"""Frequencies such a band must hold: one alone may be chance."""
ACTS = 0.2
"""Share of its largest height from which a curve is said to act, and of its whole one by which it is said to turn."""
VANISHES = 1e-6
"""Base parameter, as a share of its typical size, below which its logarithm says nothing."""
SHORTEST_SEGMENT = 32
"""Samples of a segment from which the lowest frequencies, which a mean that was taken off has emptied, are left out:
of fewer there would be too little left."""
OUTSIDE = 0.025
"""Probability that power of noise is beyond either of the limits a spectrum is drawn with: within them, 19 of 20."""
AROUND_EVENT = 10
"""Windows of motion there must be before an event and after it: a tenth of a second on either side."""
LOUD_AFTER = 2.0 / 3.0
"""Share of the windows after an event that are loud: what happened stays."""
LOUD_AT_ONCE = 0.25
"""What the windows just after an event hold, as a share of what loud ones usually do: less of it came by and by."""
PHASE_SEEN = 3
"""Windows of a phase that show what it is like without an event."""
STRETCHED = 0.02
"""Share of its range by which a state may leave it and still be said to have been there before."""

AT_A_KINK = 0.05
"""Cost a further step of the base fit may predict for each reading: at a kink the last bit of a bad fit is hard to
get."""
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


class Chance(NamedTuple):
    """What decides how much a candidate gains where nothing is missing.

    Parameters
    ----------
    parameters : int
        That it adds.
    cost : float
        What they cost in nats, see `occam`.
    searched : int
        How many of them are instants or frequencies: without the effect they do nothing, and the best is looked for.
    """

    parameters: int
    cost: float
    searched: int = 0

    def beyond(self, log_factor: float) -> float:
        """Bound on the probability that it reaches a Bayes factor, of which the logarithm is given.

        An instant or a frequency that the records tell to a small share of what it may be is one of many, each of which
        gains by itself: their number is what `PRICE` says that such a parameter costs (Davies, Biometrika 74 (1987)
        33-43, counts them exactly). A mean likelihood ratio of one is a bound as well (Markov's inequality), and the
        only one where the standard deviations between records differ: what each takes off sums of squares is no gain.
        """
        tail = float(chi2.sf(2.0 * max(log_factor + self.cost, 0.0), self.parameters))
        return min(tail * float(np.exp(PRICE * self.searched)), false_alarm_at_most(log_factor))


def false_alarm(log_factor: float, candidates: Sequence[Chance]) -> float:
    """Probability that the best of candidates reaches a Bayes factor although nothing is missing.

    Noise and scatter drawn through the whitened slopes of the base give each candidate a chi-squared gain, of which its
    Occam factor is taken off; candidates count as independent, which is on the safe side.

    Parameters
    ----------
    log_factor : float
        Logarithm of the Bayes factor.
    candidates : sequence of Chance
    """
    loud = np.array([one.beyond(log_factor) for one in candidates])
    return float(-np.expm1(np.sum(np.log1p(-np.minimum(loud, 1.0 - 1e-16)))))


def false_alarm_at_most(log_factor: float) -> float:
    """Bound on the probability that a Bayes factor reaches a value although nothing is missing.

    Where nothing is, its mean is one in the noise that is known, and so it is averaged over all laws that were looked
    at, each by its share of the prior.

    Parameters
    ----------
    log_factor : float
        Logarithm of the Bayes factor, what was looked at paid for.

    Source
    ------
    Markov's inequality; of likelihood ratios Robbins, Ann. Math. Stat. 41 (1970) 1397-1409.
    """
    return float(np.exp(-max(log_factor, 0.0)))
