"""Every number that decides the verdict on a fit, with its meaning and where it comes from.

How large residuals may be stands in `problem.thresholds`.
"""

from __future__ import annotations

FIT_TOLERANCE = 0.01
"""Reduction of the cost that may still be predicted of one more Gauss-Newton step; 1 is one standard error, so that
values are a tenth of theirs from the minimum at most."""
ROUGHLY = 0.05
"""The same where errors of measured inputs, or noise and differences between records, are fitted too: the cost of a
motion that sticks and bounces is rough at this scale, and values are a fifth of their standard errors from the minimum
at most."""
DIVERGED = 25.0
"""Promised fall beyond which the end of the search is not even near a minimum: five standard errors."""
GAP_OF_PART = 1.15
"""Residual RMS of a phase of the motion over the noise, and error of a measured input over its noise, that still pass:
`problem.thresholds.GAP_OF_NOISE`, and a little more, as a phase has fewer samples, chance allowed for, and the error
is estimated with the values."""
UNNOTICED = 0.1
"""Part of a standard error that nobody would notice in a result: by less two solvers agree, and within it of a bound
an estimate is stopped by it."""
UNEXPLAINED = 0.005
"""Share of the variance of a signal that may be left beyond its noise: seven per cent of its rms."""
USELESS = 0.05
"""Share beyond which the values are off by a factor, not by an error: what is left is a fifth of the signal itself."""
FACTOR = 1.5
"""Factor between two values, both of which leave nothing but noise, beyond which neither is of use: what is stated of
the rig decides between them. A clock 5 % wrong puts damping or friction of one drop off by 2 to 3, one 1 % wrong by
1.1 to 1.2: docs/checks.md."""
ZERO_SHARE = 0.003
"""The same over the largest force that a record reads: what gauges drift between two zeroings."""
ALIKE_EVIDENCE = 6.0
"""Difference in the sum of squares, the price of parameters allowed for, up to which mistakes of a study explain the
records alike: odds of twenty to one."""
STANDS_OUT = 8.0
"""Residual of a sample over the noise, and over the median of the five around it, beyond which it stands alone: the
largest of a million of noise is at five, and what a model lacks changes over more samples."""
REMAINING = 0.02
"""Share of what is left beyond the noise, in squares, that may remain where a fault in what is stated explains it: the
right fault leaves a hundredth at the most, another one a tenth of it or more in drops."""
GRAVITY_OFF = 0.005
"""Relative error of gravity in free flight that passes, chance allowed for: between places on the Earth it is up to
0.4 % less and 0.3 % more than the standard one."""
LATE_FORCE = 3e-4
"""Seconds between force and position that pass, chance allowed for: a friction that the model has wrong looks like a
quarter of a millisecond in practice series, and half a millisecond puts damping off by 13 % in a single drop."""
NO_FACTOR = 0.1
"""Share of a parameter's typical size below which a value has no factor to be wrong by."""
STARTS_AGREED = 0.8
"""Share of the starts that have to end in the best minimum; where fewer do, a better one may have been missed."""
MINIMA_KNOWN = 0.95
"""Probability that a further start would end in a minimum that is known, from which all that matter are taken to be."""
FEW_STARTS = 2
"""Starts that have to end in a minimum that leaves only noise, where others are not followed on, and that have to come
to an end at all: one may be an accident, and agrees with itself."""
SAME_BASIN = 1e-3
"""Relative difference in cost below which two starts are counted for the same minimum, whatever their values: of a
thousand samples that is one standard error. Of more than 20 000 readings with exact inputs `LESS_PROBABLE` is less, and
decides. Before one of them goes on for both, they are in the `SAME_PLACE`, too."""
WORSE = 1.05
"""Factor by which the residuals of every other minimum then have to be larger: more than noise is uncertain."""
LESS_PROBABLE = 10.0
"""Nats by which the next one has to be less probable instead, where errors of measured inputs hide how much it leaves:
odds of twenty thousand to one."""

SPECTRUM_RATIO = 1.25
"""Power of an octave over that of the noise at rest that still passes: short rests tell the spectrum no better."""
STATE_SHARE = 0.10
"""Share of what is left that a curve in a state of the rig may explain: a twentieth in rms."""
CHANCE = 3.3
"""Standard deviations that are put down to chance: one in two thousand goes beyond."""
RARE_POWER = 5e-4
"""Probability of a ratio of powers beyond which it is not put down to chance: the same one in two thousand."""
LOUDEST = 1.5
"""Most by which noise may be louder in motion than at rest; what is louder still is not noise."""
STATE_CELLS = 12
"""Cells, visited equally often, that a state is cut into. Of less than two samples in motion in each of them a curve
explains half of the noise: none is tried."""
FEWEST_SAMPLES = 200
"""Samples below which a phase is too short to be judged, unless it is the longest: their mean square scatters by a
tenth."""
SLOWEST_OCTAVE = 0.9
"""Lower edge in Hz down to which octaves are looked at, whatever the rate: contacts and swings of a fibre last up to a
second. At 2 kHz that is the tenth octave below half the rate; slower records are looked at down to the tenth, too."""
ORDINATES = 8
"""Ordinates of a spectrum below which an octave says nothing: their mean is uncertain by a third. A piece of less than
twice as many samples has no spectrum."""


TIED = 0.995
"""Correlation beyond which two parameters are distinguished only in name: the error of either is ten times that of
their combination."""
VAGUE = 0.5
"""Relative standard error beyond which a value says little: zero lies within two of them."""
SEEN = 1e-2
"""Change of all readings together, in noise rms, below which a parameter's typical size does nothing to them."""
SMALL_ERROR = 0.01
"""Standard error over a parameter's typical size below which it is small, whatever share of the value it is."""
BLIND_PART = 1e-3
"""Component along a direction that the data do not see from which a value has no error bar, and share of a direction
that one stretch of a record has to leave to the others: less is rounding."""
WORTHWHILE = 0.8
"""Largest relative error with a further record over that without, below which the record is advised: another one like
those at hand brings it to 0.7 where there is one, and to 0.9 where there are five."""
LOOSE = 0.1
"""Relative standard error below which a value is known well enough, whatever it is tied to."""

MISSED_LINEARISED = 0.03
"""Mean square of what readings linearised in the errors of inputs miss, in units of the noise, from which they are
linearised again."""
REACTS_ALIKE = 0.005
"""The same of a record up to which what errors of its inputs do is taken to be what they did before: a chord step.
Residuals are simulated all the same; only how they are weighted is that of before. Of six gains of effects, four were
within 0.5 nats of those with everything found anew, and two of delays, which move reactions, too, within 2 and 8."""
MORE_COUNT = 0.01
"""Share of the samples that have to count more for another look; where all but that share count, no more can be won."""
MOST_LINEARISATIONS = 8
"""How often readings are linearised in the errors of inputs at the most: five did where a ninth of the samples counted
at first."""
FALLS = 0.9
"""Factor by which such a look has to lower the mean square of what is left of all samples for another one."""
LOUDER_THAN_AT_REST = 1.25
"""Gap of a record over that of a perfect model up to which residuals that have the structure of noise are noise that is
louder than at rest: of slow noise beside noisy inputs it was 1.22 at the most, of records that lost a bounce 1.37 and
more."""
LOSES = 2.0
"""Ratio of the gap that values shared by all records leave to that which values of their own leave, beyond which the
former have lost a bounce: nothing that is missing from a model does that. Where even the best errors of the inputs
leave as many times the noise, they are not what the model lacks: they stay zero, and values those for inputs as they
were measured."""
MODE_REACHED = 0.5
"""Predicted reduction of the objective beyond which the mode of the likelihood was not reached."""
