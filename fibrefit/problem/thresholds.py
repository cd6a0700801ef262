"""Every number that decides a verdict on residuals and estimates, with its meaning and where it comes from."""

from __future__ import annotations

GAP = 1.1
"""Normalised residual RMS up to which residuals are noise, which itself is known to a few percent: of a fit, of a
posterior, of a series and of a prediction."""
BALANCE = 0.1
"""Share of a measured force that inverse dynamics may leave: accelerations come from positions differentiated twice."""
STANDING = 1e-3
"""Speed in m/s below which the direction of motion is not believed, and friction may be anything: positions read to
some micrometres at 100 Hz tell no less."""
UNLIKELY = 1e-3
"""Probability below which the difference of plain and whitened estimates is not taken for chance: one right fit of a
thousand is suspected (Hausman, Econometrica 46 (1978))."""
SLIGHT = 0.02
"""Share of the plain estimate's variance below which both methods are one, and their difference says nothing."""
