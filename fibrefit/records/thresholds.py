"""Every number that decides what is read, masked or refused, with its meaning and where it comes from."""

from __future__ import annotations

ABSURD = 1e9
"""A number this large may be no measured value: none that a sensor of a rig gives in any unit comes near it."""
ABSURD_RATIO = 1e4
"""... and is none where it is this much larger than the rest of its column."""
NINES_RATIO = 10.0
"""Nines as loggers write them for "no value" lie this many times beyond the rest of the column."""
RUN_BY_CHANCE = 1e-4
"""Chance at which a run of equal readings in a noisy record may be an accident."""
BEYOND_ROUNDING = 0.5
"""Noise over a step of the readings that is more than rounding: going to and fro between two steps makes at most
this."""
CALM = 0.95
"""Share of the third differences that is noise; the largest are those of impacts."""
TURNING = 0.55
"""Share of the second differences of another sign than the one before from which on readings are noisy: nearly three
in four are in white noise, hardly any in a smooth motion."""
REPEATED = 0.6
"""Share of readings equal to the one before up to which readings are noisy: more are those of a coarse step."""
SHORTEST_RUN = 4
"""Shortest run of equal readings that is looked at."""
ALWAYS = 0.9
"""Largest chance that a reading is the same as the one before, where readings are noisy at all."""
AROUND = 100
"""Runs of equal readings to each side of one that tell how long they get there by chance: more at rest than in
motion."""
PIECES = 20
"""Stretches of a long record that tell whether it is noisy ..."""
PIECE = 5000
"""... and their length in samples."""
OVERSHOOT = 4.0
"""A reading that ran on at this multiple of its curvature, resolution and scatter, and stopped dead, was cut off."""
LONE = 12.0
"""A sample this many times further from its neighbours than they scatter is reported."""
SHORT_STOP = 0.02
"""A stop longer than this share of a record is a rest, not a peak that was cut off."""
AT_ZERO = 0.02
"""A flat stretch this close to zero, against the range, is a slack fibre or a sensor at rest."""
