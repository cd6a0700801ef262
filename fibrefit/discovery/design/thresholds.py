"""Numbers that decide what is said of a further record, with their meaning and where they come from."""

from __future__ import annotations

UNKNOWN = 1e-12
"""Share of the largest information below which a direction is not determined: products of differences, which are good
to seven digits, are rounded there, and the error along it would be a million times that of the best direction."""
CONCERNED = 1e-10
"""Share of a parameter in such a direction from which it is not determined itself: its error would be at least ten
times that of the best direction, and rounding turns directions by less."""
