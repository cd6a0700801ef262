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
NOISY_TURNS = 0.55
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
RETURNS = 3
"""Far readings of one and the same number, digit by digit, from which on it is no reading: that noise leaves a range of
a thousand steps for the same one of them twice is one in a thousand, for another time one in a million."""
ON_PHASE = 0.95
"""Share of the changes of a reading that come at every so many-th row from which on it is held in between."""
STEPS_OF_NEWS = 1.5
"""Smallest steps of a reading up to which a change is one step of its digits: so a coarse one moves in even motion."""
SHORT_STOP = 0.02
"""A stop longer than this share of a record is a rest, not a peak that was cut off."""
AT_ZERO = 0.02
"""A flat stretch this close to zero, against the range, is a slack fibre or a sensor at rest."""

MOST_OFF = 0.05
"""Share of the rows off the grid beyond which the sampling counts as uneven."""
MOST_LOST = 0.2
"""Share of the rows out of order beyond which a column holds no times."""
JITTER = 0.25
"""Deviation of a stamp from an even grid, as a share of the step, below which it is late and not uneven."""
NO_STEP = 0.05
"""A step this much shorter than the usual one is no step: two stamps of one sample, or a first one made up."""
CONTRADICTS = 0.01
"""Relative difference beyond which two statements of a rate contradict each other."""
RUNS_ON = 2.5
"""Steps after the time went back, as multiples of the usual one, up to which it starts again there; one may be lost."""
ALONE_BY = 0.02
"""A first or last row this share of a record away from all others has a wrong time."""
COARSELY_PRINTED = 0.2
"""Last printed digit against the step beyond which printed times do not tell single samples apart."""
EVEN = 0.8
"""Share of the steps that are the usual one from which on coarse times are even ..."""
EVEN_OF_FEW = 0.6
"""... and among fewer than twenty."""
TIES_TURNED = 0.05
"""Share of the ties that are rounded otherwise than the one before: a computer does so at every turn, a lost row makes
it once."""
OPEN_RATE = 2e-3
"""Relative uncertainty beyond which a rate is not guessed from its roundness."""
SHARED = 0.2
"""Share of the stamps that equal the one before from which on samples share stamps."""
SHARING = 1000
"""Such stamps that are looked at: whether their rows are the same too."""
ROUND_DIGITS = 4
"""Significant digits up to which a rate counts as one somebody has set."""
CENTURY_BEGINS = 1e9
"""Seconds since 1970 in 2001: whole stamps in s, ms, us and ns differ by three digits each ..."""
CENTURY_ENDS = 4e9
"""... and in 2096."""

ALIKE_WRITTEN = 0.8
"""Share of a column that must be written alike before a number written otherwise counts as damaged."""
FEWEST_WHOLE = 3
"""Different whole numbers below a thousand beside numbers of three decimals from which a mark may part thousands: one
reading in a thousand is whole by chance."""
FEWEST_WRITTEN = 5
"""Fewest numbers that show how a column is written."""
ROUND_BY_CHANCE = 0.1
"""Share of the numbers whose last digit is a zero by chance."""
LOST_MARK = 10.0
"""A whole number this many times larger than every decimal of its column has lost its decimal mark."""
FAR_OUT = 8.0
"""A lone sample this many times further from its neighbours than they scatter is an outlier ..."""
PUT_BACK = 3.0
"""... and one that lies this close once a character is put back is explained by it."""
OTHER_MARKS = 0.01
"""Cells with the other decimal mark beyond which a file is refused: then it is no accident."""
VOTERS = 200
"""Rows at the end of a file that vote: headers of any length do not reach them in a long file."""
FEWEST_TEXTS = 0.3
"""Share of cells with text below which a column is empty but for remarks, or labels in the header."""
STRAY_ROWS = 2
"""Rows of numbers above the table that may be part of a header (sample counts, ranges, channel numbers) ..."""
STRAY_SHARE = 0.01
"""... and as a share of the rows of a long table."""
DIGITS_OF_A_ROW = 0.4
"""Share of the characters of a line that are digits from which on it may be a damaged row."""
COUNTED_ROWS = 3
"""Rows beyond which the first may tell how many follow."""
HEADER_DEPTH = 400
"""Lines above a table that are looked at."""
NEAR_HEADINGS = 2
"""Lines between one with headings and another that may hold those it lacks: units, and a line of numbers of signals."""
UNITS_OF_ROWS = 6
"""Units of one kind that a column of text may hold and still be one of units; ranges with them, and be one of these."""
LONGEST_HEADING = 200
"""Letters of a heading that is searched for a unit: longer ones are prose, and every place in them would be tried."""
SLOWEST_RATE = 1e-3
"""Rate in Hz below which a header is damaged ..."""
FASTEST_RATE = 1e10
"""... and above which it is."""
MOST_SAMPLES = 1e12
"""Samples beyond which a header is damaged."""
SLOWEST_LIKELY = 5.0
"""Lowest rate in Hz of mechanical records: a step without a unit is read only if one unit alone leads here ..."""
FASTEST_LIKELY = 5e5
"""... and the highest."""

MOST_IN_TURN = 12
"""Channels whose readings may stand below each other at one time: more names in a column of words are those of rows."""
FEWEST_PAGES = 3
"""Breaks of a table, as far apart as each other and as long, that are those of pages: a heading that is repeated once
or twice may begin another recording."""
FEWEST_ROWS = 3
"""Rows of numbers that make a table: fewer tell neither a rate nor a layout."""
LAYOUT_LINES = 200
"""Lines at either end of a file that tell of an older layout: single quotes, a header beside the first rows."""
NAMED_ALIKE = 0.9
"""Share of the lines that must name their values alike."""
WORDS_BESIDE = 0.2
"""Share of a line that is no pair of a name and a value beyond which its pairs are those of a sentence."""
CONTROLS = 0.01
"""Share of control bytes beyond which a file is no text; some may come from damage."""
ZEROS = 0.3
"""Share of zero bytes beyond which it is none: blocks of them come from a power failure."""
WIDE_ZEROS = 0.6
"""Share of the zero bytes in every other place from which on a sign has two bytes ..."""
NARROW_ZEROS = 0.1
"""... and in the places between, up to which it has."""
WHOLE_WORDS = 0.6
"""Share of the words with high bytes that are made of them throughout beyond which a text is Cyrillic: elsewhere
letters with accents stand alone or in pairs."""
FOLDED = 0.15
"""Share of the largest number below which numbers touch zero where their sign, in a column of its own, changes."""
NO_ACCIDENT = 10
"""Numbers of a block of rows from which on it does not repeat the one before it by accident."""
SAME_ALWAYS = 0.9
"""Share of the rows that must stand as often as the others for all to have been written so often."""
TAKES_TURNS = 0.95
"""Share of the readings of one parity on one side of their neighbours from which on two channels take turns."""
RUNS_OVER = 0.25
"""Share of the numbers of a counter that it passes from row to row at most, where it does not run over."""
LEFT_OVER = 0.1
"""Part of a jump that may be left once the readings are divided by what another column changes by."""
TWO_VALUED = 20
"""Readings among which two values only are no accident."""
COUNTS_ON = 0.8
"""Share of the steps of a column that numbers the rows which are one; the others are missing rows."""
ON_GRID = 0.25
"""Deviation from an even grid, as a share of the step, that belongs to a uniform one with printed times."""
SAME_RATE = 1e-3
"""Relative difference of two rates that are one rate."""
ON_TIME = 1e-3
"""Distance from a sample's instant, as a share of the step, that is none."""
IN_COMMON = 3
"""Samples two files must have in common."""
COPIED = 1e-3
"""Part of the steps from sample to sample below which two signals are the same, written with other digits."""
SAME_SAMPLES = 8
"""Samples by which a record is looked up among the others: where nothing moves, one may be alike by chance."""
SAME_PEAK = 5e-3
"""Relative difference up to which a largest or smallest value that a file claims is a factor between units times the
one that was read: claims have three digits."""
SAME_LENGTH = 0.01
"""The same of how long a file says that it lasted, where one sample more or less is counted."""
LONGEST_LABEL = 3
"""Words of a cell up to which it only names what stands below or beside it, such as gain or offset."""
SHORTEST_SENTENCE = 3
"""Words of a line without a key from which on it is a sentence: what it is about bears on all its parts."""
MOST_NAME_WORDS = 5
"""Words of a claim up to which it is a name and its number, such as the gain of an amplifier, and no sentence."""
LEAST_CERTIFICATE = 100
"""Whole number beside a calibration from which on it is that of a certificate, and no factor."""
LONGEST_SAID = 800
"""Letters of what is taken apart at once: longer lines are cut, as every place in a word would be tried."""
SHORTEST_NAME = 3
"""Letters of a word from which on it names something: shorter ones are as often the coefficient of a formula."""
LONGEST_STEP = 1.0
"""Time in s from which on, beside words that are not of times, it is not that from one sample to the next."""
STATED_ALIKE = 1.05
"""Larger over smaller of two amounts of a line up to which these are one thing measured twice, and no other scale."""
LEAST_SERIAL = 10_000
"""Whole number from which on it is a serial number, where it is not round."""
SHORTEST_RECORDING = 20
"""Rows of one number from which on a column that counts on after them may number recordings."""
LEAP = 3.0
"""Change of a reading between two recordings over the largest one within them from which on another one begins."""
