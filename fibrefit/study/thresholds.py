"""Every number that decides what a study may ask for, and what of a result is reported, with its meaning."""

from __future__ import annotations

LEAST_LISTED = 0.5
"""Nats of evidence, which are reported without decimals, that are more than nothing."""
STEPS_A_PERIOD = 20
"""Steps of a simulation in a period of what drives it: of 20, the largest angle of a sine
is missed by 1.2 % at the most."""
