"""Every number that decides a verdict on residuals and estimates, with its meaning and where it comes from."""

from __future__ import annotations

GAP_OF_NOISE = 1.1
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
LINE_BY_CHANCE = 1e-6
"""Probability below which the highest ordinate of all is taken for a line: of a million spectra of noise alone one
shows a line."""
CLEAR = 3
"""Ordinates on either side of a line that are left out of the rest of the spectrum."""
SLOWEST_LINE = 20.0
"""Lowest frequency in Hz of a line: what a rig itself does is slower, and no noise."""
BESIDE_MAINS = 4.0
"""Distance in Hz from the mains within which power may be theirs: a window of a quarter of a second tells no less."""
FEW_MASKED = 0.05
"""Share of the readings of a rest that may be masked for all of it to tell the noise: each repeats the one before it,
which leaves the level of white noise as it is and its spectrum flat to a tenth."""
LINE_WIDTH = 1.0
"""Half width in Hz of the band in which the line of the mains may lie: a grid keeps within a fifth of that."""
COARSE_STEPS = 0.5
"""Noise over a step below which readings are coarse: above it, rounding is one more white noise (its first harmonic, by
which it depends on the signal, is then below ``exp(-2 pi^2 0.25)``, less than a hundredth)."""
CROSSED = 2.5
"""Steps of a logger that readings cross within 32 samples where their noise shows, that of rounding in it: fewer are
crossed by noise alone, while rounding is an offset. Noise of `COARSE_STEPS`, the most there is, ranges over 4.1 of its
standard deviations in 32 samples, two steps. Of 24 channels with noise of a fifth of a step it is found to be 0.31 to
0.38 steps so, 0.44 in one, where it is 0.35."""
NEGLIGIBLE_PART = 1e-4
"""Share of the variance below which a first-order part is left out."""
GROWS = 3.0
"""Standard errors from which noise is taken to grow with the load. In 68 series of both rigs with noise that does not,
20 of them with a hidden effect, it was between -2.3 and 1.9 (some twelve in coarse steps tell nothing); in 12 with
noise that does, 2.0 once and else 3.3 to 11."""
LEVEL_READINGS = 50
"""Readings that tell the noise at a level of the load: their median is known to 2.07 / sqrt(50), three tenths of it."""
CARRIES_LOAD = 0.05
"""Share of the largest force, or of its range, that a wrong zero of it is less than: a fibre that shows more carries
load, and the pull of gravity along the guide tells a sign if it is more. It is 0.07 to 0.57 in the practice series; an
offset by half as much again turns it round, on a guide of 2 degrees 1.5 N for 3 kg."""
SHORTEST_CONTACT = 24
"""Samples of the shortest contact that tells a shape from its noise."""
SHORTEST_FLIGHT = 8
"""Samples of the shortest flight that has a curvature."""
CREEPS = 0.02
"""Share of its largest rate below which a drive is at rest: the noise of a smoothed drive is a tenth of that."""
MISREAD = 1.25
"""Factor from which a measured force, a position or gravity is another one than what moves the weight: in 480 clean
records of both rigs with six kinds of noise the largest was 1.04, in 350 with an effect that a search finds 1.08."""
PROVEN_FACTOR = 5.0
"""Standard errors from which it is beyond doubt that a number is not another one: a factor by which a record is misread
not 1, by how stretches of the record differ; a value that is given by its logarithm not zero."""
TELLS_A_SIGN = 0.1
"""Share of the squares of the positions that Newton's law with other sizes has to explain for signs to be believed, as
noise explains nothing and turns nothing round: of 1274 whole and cut records of both rigs, 0.05 mm and 1 N of noise
added to half of them, none moves against gravity or force by `PROVEN_FACTOR` errors from 0.04 on, and 966 tell the sign
of the force."""
FOLLOWS = 0.4
"""Size, see `diagnose.channels`, from which a weight follows its drive or moves against it: -0.25 to 1 in 26 000 parts
of 105 records of drives, half of them with 0.05 mm and 1 N of further noise or 15 N less; 0.57 at the least in whole
ones."""
FEWEST_READINGS = 16
"""Readings of a record, valid ones of a channel of it, readings of a window, and spans over which they are averaged:
fewer tell no motion."""
FEWEST_AROUND = 3
"""Samples on each side in the narrowest window of an input, and valid ones around an instant beside its own: as many as
a parabola has coefficients."""
CORNER = 5.0
"""Standard deviations of the matched filter, as it spreads over a record, from which a corner of a motion is one: of
2400 independent samples of noise one exceeds it in seven hundred records."""
LAST_LEVEL_RATIO = 2.0
"""How many times as probable as beforehand records make the largest standard deviation between them that is looked for,
from which it may well be larger. Of five records each known to 0.1 % that differ by 2, 5 and 10 % it was 0.1, 4 and 7
(medians of 100); of records each known to 5 or 10 % only that do not differ it is more in one of twenty-five."""
