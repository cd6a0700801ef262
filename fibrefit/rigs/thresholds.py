"""Every number that decides what counts as rest and as motion, and whether a record shows what its rig needs."""

from __future__ import annotations

MOVES = 0.05
"""Share of the largest speed from which a weight slides."""
MOSTLY_SLIDES = 0.8
"""Share of a stretch in which a weight slides: where it is held, friction is anything up to its level."""
FEWEST_STRETCHES = 6
"""Stretches of a record that tell how surely they agree: more than there are sizes."""
STANDS = 0.02
"""Share of the largest speed below which a mass is taken to stand: friction is then anything up to its level."""
FEWEST_MOVING = 32
"""Samples in motion that a record must hold whose motion leads a model, or begins with being let go."""

SHORTEST_REST = 64
"""Samples at either end of a record that make a rest: two blocks, as the mean of one has nothing to be held against."""
DRIFT = 0.003
"""Share of its travel by which an input or a reading may move while the rig is at rest."""
FIRST_BLOCKS = 4
"""Blocks at the start of a record that show how far noise moves their means: the spread of four is known to two
fifths, and fewer would have a motion that begins early count as noise."""
SPREADS = 4.0
"""Standard deviations by which the mean of a block at rest may lie away: one in sixteen thousand goes beyond."""
SLOW_NOISE = 6.0
"""Largest move of a block's mean that is taken for slow noise, in standard deviations of the fast noise: noise with
seven tenths of its power below 8 Hz still passes (`tests/rigs/test_rest.py`)."""
FAST_NOISE = 1.2
"""The same that fast noise makes by itself, where nothing shows slow noise: white noise moves a mean of 32 samples by
0.18 of it, noise behind a filter by more."""
BEGUN = 0.02
"""Share of its largest deviation by which a channel has left that place when its motion has surely begun."""

FALLS_AT_ALL = 0.3
"""Share of its lift by which a position at least changes where its weight falls at all."""
FALLEN = 0.8
"""Share of its lift that a weight must be seen to fall for its release to be found; a stated one is less off."""
LIFT_AGREES = 0.1
"""Share of a stated lift by which the fall up to the first force may differ from it: the force has to rise out of its
noise, a tenth of a millimetre after the fibre is taut."""
FEWEST_FALLING = 4
"""Samples of a fall that give its line: two are the line's."""
FORCE_RISES = 8.0
"""Standard deviations of its noise at rest by which a force has risen: the largest of a million is at five."""
CAUGHT = 0.05
"""Share of the largest force from which the fibre is surely taut; a record that begins beyond it lacks the fall."""
FEWEST_SLIDING = 16
"""Samples in motion from which mass, frictions, spring and offset are found: three for each of the five."""
PROVEN = 0.2
"""Share of what the other terms leave of the force that a term must explain before its sign is believed."""
DRIVE_BEGINS = 10.0
"""Standard deviations at rest by which a drive has moved: twice the largest of a million."""
DRIVE_STANDS = 1e-5
"""Way in m within which a drive stands, however quiet it is at rest: a hundredth of a millimetre stretches no fibre
by what a force shows."""

FARTHER = 1.5
"""Factor by which a further record may go beyond what was measured, where a study does not say what its rig can do: a
gauge and a fibre are seldom used to less than two thirds. The peak force of a drop grows with the root of height times
mass, and so by this factor too where both are at their ends."""
