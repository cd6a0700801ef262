"""Every number that decides what a series is said to show, with its meaning and where it comes from."""

from __future__ import annotations

PREFERRED = 5.0
"""Logarithm of the Bayes factor from which a richer model is preferred: a ratio of 150 to one, Kass and Raftery's "very
strong", J. Am. Stat. Assoc. 90 (1995)."""
SIMPLER_LAW = 1.0
"""Nats within which the law with fewer parameters is taken: "not worth more than a bare mention", as there."""
SIGNIFICANT = 0.05
"""Probability by chance below which a difference is reported, the usual one in twenty: of a trend, corrected for all
looks, and of the predictive performance of two posteriors, by Student's law."""
OUTLIER = 0.01
"""Probability by chance of an outlier in a whole series, all records and lines of it together, below which a record is
named: one series in a hundred."""
FEWEST_RECORDS = 4
"""Records from which a line can be tested: two are the line's, and of three no one stands out from the others."""
MOST_OUTLIERS = 0.1
"""Share of the records that may be left out as outliers: with more of them they are not what is odd."""
LOGARITHMIC = 0.3
"""Median relative error up to which positive values are given by their logarithms: three errors away from zero."""
HIGH = 0.05
"""Change from one frequency to the next, as a share of the largest amplitude, below which nothing is called a jump."""
STEEP_JUMP = 3.0
"""A jump is this many times steeper than the curve on either side of it."""
