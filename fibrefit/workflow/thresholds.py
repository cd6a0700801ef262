"""Every number that decides the verdict on a prediction, a sweep or a series, with its meaning and its reason."""

from __future__ import annotations

LACKING = 1.5
"""What a model lacks may be so many times as large in other records as in those of the fit, rms."""
RARE = 0.01
"""Chance that error bars of values alone bring a prediction to its limit."""
LOCATED = 0.1
"""Distance in Hz of two frequencies up to which a jump is located well enough: two percent of 5 Hz."""
DECIDED = 5.0
"""Nats from which one of two models of a series is more probable, as `discovery.engine.thresholds.NAMED`."""
PREDICTED = 1.15
"""Normalised residual RMS up to which a record is predicted within noise by a fit to the others: a little more than
`problem.thresholds.GAP_OF_NOISE`, as the values bring errors of their own."""
CORRELATED = 0.7
"""Correlation beyond which a pair of parameters is reported: half of the variance of either goes with the other."""
RECORDS_DIFFER = 0.01
"""Chance of so large a scatter of a value between records below which it is reported: one series in a hundred."""
SHORTEST_SERIES = 3
"""Records of a series: with two, what is left out leaves one."""
