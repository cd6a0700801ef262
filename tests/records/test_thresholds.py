"""Every threshold of the readers decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import copies, join, stamps, thresholds
from fibrefit.records.clock import claimed, coarse, rates, repeats, timebase
from fibrefit.records.clock.base import ALONE, OFF_GRID, Readings
from fibrefit.records.clock.rates import round_rate
from fibrefit.records.clock.timebase import from_readings
from fibrefit.records.columns import account, damage, declared, grouping, judged, known, states, unmoved
from fibrefit.records.columns.damage import absurd, flat_stretches, lone_outliers
from fibrefit.records.columns.raw import Annotation, binary_column
from fibrefit.records.copies import Fingerprint
from fibrefit.records.files import decode, doubts, keyed, text
from fibrefit.records.files.decode import Text
from fibrefit.records.grammar import dialect, digits, facts, header, headings, numbers, rows, worth
from fibrefit.records.grammar.claims import Amount
from fibrefit.records.grammar.dialect import Dialect
from fibrefit.records.grammar.header import find_header
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.numbers import Numbers, parse_column
from fibrefit.records.grammar.worth import stated_unit
from fibrefit.records.join import side_by_side
from fibrefit.records.layouts import long_form
from fibrefit.records.options import ReadOptions
from fibrefit.records.record import Record
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

#: Amplitude of a reading that goes to and fro, as its distance from the mean of its neighbours: what outliers are
#: measured by.
SCATTER = 1.4826


def believed(usual: float, last: float) -> bool:
    """Whether the last of a column of like numbers counts as measured."""
    return not absurd(np.array([usual] * 9 + [last])).any()


def by_chance(length: float, *, kept: float, before: tuple[int, ...] = (), after: int = 0) -> bool:
    """Whether a run of equal readings may come by chance, with runs before it, and runs of one after it."""
    lengths = np.array([*before, int(length), *[1] * after])
    return length <= damage._longest_by_chance(lengths, len(before), kept)


def repeated_block(length: float) -> bool:
    """Whether a block of so many numbers that stands twice is told."""
    numbers = np.sqrt(np.arange(60.0))
    again = np.insert(numbers, 30, numbers[30 - int(length) : 30])
    return any(True for _ in repeats.repeated_rows([again]))


def sign_apart(least: float) -> bool:
    """Whether numbers are refused that come so near to zero where a word beside them changes."""
    beat = np.maximum(np.abs(np.sin(0.3 * np.arange(200))), least)
    words = ["push" if np.sin(0.3 * i) < 0 else "pull" for i in range(200)]
    try:
        doubts.refuse_signs_apart([("column", words)], [binary_column("F [N]", "F", "N", beat)])
    except DataError:
        return True
    return False


def standing_twice(share: float) -> bool:
    """Whether rows of which such a share stands twice are told."""
    often = np.where(np.arange(200) % 20 < 20 * share, 2, 1)
    return any(True for _ in repeats.repeated_rows([np.repeat(np.sqrt(np.arange(200.0)), often)]))


def in_steps(period: float) -> bool:
    """Whether readings that leave their step once a period are noise: 0.54 steps for three samples, 0.43 at five."""
    run = np.tile([0.0] * (int(period) - 1) + [1.0], 200)
    return damage._is_noisy(run, np.ones(run.size, int))


def turning(share: float) -> bool:
    """Whether an oscillation is noise of whose second differences such a share has another sign than the one before."""
    run = np.sin(np.pi * share * np.arange(2000.0))
    return damage._is_noisy(run, np.ones(run.size, int))


def repeated(share: float) -> bool:
    """Whether readings are noise of which such a share equals the one before."""
    runs = np.full(200, round(1.0 / (1.0 - share)))
    return damage._is_noisy(np.random.default_rng(5).normal(size=1000), runs)


def calm(share: float) -> bool:
    """Whether the noise is told by what is no impact, with such a share of the third differences in impacts."""
    run = np.tile([0.0, 1.0], 5000)
    run[2 :: round(4.0 / share)] += 1e3
    return damage._noise(run) < 10.0


def rest(length: float) -> bool:
    """Whether a stop of so many samples inside a record of ten thousand is a peak that was cut off."""
    return damage._is_short((500, int(length)), 10_000)


def stops(level: float, slope: float, resolution: float) -> bool:
    """Whether a reading that falls evenly is told to stop dead at a level."""
    falling = level + slope * np.arange(40)[::-1]
    return flat_stretches(np.append(falling, [level] * 12), resolution).stops_dead.any()


def lone(distance: float) -> bool:
    """Whether a sample this many times further from its neighbours than they scatter is reported."""
    run = np.tile([0.5, -0.5], 50)
    run[50] = -0.5 + distance * SCATTER
    return lone_outliers(run).size > 0


def returns(times: float) -> bool:
    """Whether readings are masked that leave a noisy one so often for one and the same number."""
    run = 20.0 + np.random.default_rng(3).normal(size=2000)
    run[100 * (1 + np.arange(int(times)))] = 327.67
    return damage.returning(run).any()


def on_phase(share: float) -> bool:
    """Whether readings are held of which such a share changes at every tenth row, and the others five rows later."""
    changes = 10 * np.arange(1, 1000) + np.where(np.arange(1, 1000) % 100 < 100 * (1.0 - share), 5, 0)
    news = np.isin(np.arange(10_000), changes)
    return damage.held_over(np.random.default_rng(4).normal(size=1000)[np.cumsum(news)]).any()


def of_news(steps: float) -> bool:
    """Whether readings are held whose steps are so many of their smallest as a rule."""
    sizes = np.where(np.arange(1000) % 4 == 0, 1.0, steps) * np.where(np.arange(1000) % 2, 1.0, -1.0)
    return damage.held_over(np.repeat(np.cumsum(sizes), 10)).any()


def numbered(length: float, leap: float) -> bool:
    """Whether a column numbers recordings of so many rows, between which a reading leaps so many steps."""
    n = int(length)
    reading = np.concatenate([np.arange(float(n)), np.arange(float(n)) + n - 1 + leap])
    shot = binary_column("shot", "shot", None, np.repeat([1.0, 2.0], n))
    found = states.numbered_recordings([shot, binary_column("F", "F", "N", reading)], [1], np.arange(2.0 * n))
    return found == ("shot", [0, n])


DAMAGE = (
    Bracket("SHORTEST_RECORDING", states, lambda x: numbered(x, 9.0), 20, 19),
    Bracket("LEAP", states, lambda x: numbered(50, x), 3.5, 2.5),
    Bracket("ABSURD", damage, lambda x: believed(1.0, x), 0.7e9, 1.3e9),
    Bracket("ABSURD_RATIO", damage, lambda x: believed(2e5, 2e5 * x), 0.7e4, 1.3e4),
    Bracket("NINES_RATIO", damage, lambda x: believed(9999.0 / x, 9999.0), 7.0, 13.0),
    Bracket("RUN_BY_CHANCE", damage, lambda x: by_chance(x, kept=0.9, after=1000 - int(x)), 151, 157),
    Bracket("ALWAYS", damage, lambda x: by_chance(x, kept=0.97, after=1000 - int(x)), 120, 190),
    Bracket(
        "AROUND",
        damage,
        lambda x: by_chance(14, kept=0.0, before=(3,) * 300 + (1,) * int(x), after=5000),
        70,
        130,
    ),
    Bracket("SHORTEST_RUN", damage, lambda x: by_chance(x, kept=0.0, after=1000), 4, 5),
    Bracket("BEYOND_ROUNDING", damage, in_steps, 3, 5),
    Bracket("NOISY_TURNS", damage, turning, 0.62, 0.49),
    Bracket("REPEATED", damage, repeated, 0.5, 0.75),
    Bracket("CALM", damage, calm, 0.03, 0.08),
    Bracket("PIECES", damage, lambda x: damage._parts(np.zeros(int(x))).size == x, 7e4, 1.3e5),
    Bracket("PIECE", damage, lambda x: damage._parts(np.zeros(int(x))).size == x, 7e4, 1.3e5),
    Bracket("OVERSHOOT", damage, lambda x: stops(1.0, 1.0 / 32.0, 1.0 / 32.0 / x), 5.0, 3.0),
    Bracket("AT_ZERO", damage, lambda x: stops(round(1024 * x) / 1024, 1.0 / 32.0, 0.0), 0.03, 0.015),
    Bracket("SHORT_STOP", damage, rest, 150, 250),
    Bracket("LONE", damage, lone, 14.0, 10.0),
    Bracket("RETURNS", damage, returns, 4, 2),
    Bracket("ON_PHASE", damage, on_phase, 0.98, 0.9),
    Bracket("STEPS_OF_NEWS", damage, of_news, 2.0, 1.2),
)


def readings(times: np.ndarray, resolution: float = 0.0, rows: list[str] | None = None) -> Readings:
    """A column of times; rows that all differ where none are given."""
    lines = np.arange(1, times.size + 1)
    return Readings(times, resolution, rows or [str(line) for line in lines], lines, "file", "times")


def refused(read: Callable[[], object], saying: str = "") -> bool:
    """Whether something is refused, with such words."""
    try:
        read()
    except DataError as error:
        return saying in str(error)
    return False


def off_grid(share: float) -> bool:
    """Whether times count as even of which such a share lies 0.4 steps to one or the other side."""
    times = np.arange(1000) / 100.0
    off = np.arange(5, 995, round(1.0 / share))
    times[off] += 4e-3 * np.where(np.arange(off.size) % 2, 1.0, -1.0)
    return from_readings(readings(times)).uniform


def standing(share: float) -> bool:
    """Whether a column holds times of which such a share, with its rows, is there twice."""
    at = np.arange(100)
    at[:: round(1.0 / share)] = np.maximum(at[:: round(1.0 / share)] - 1, 0)
    return not refused(lambda: from_readings(readings(at / 100.0, rows=[str(i) for i in at])))


def late(share: float) -> bool:
    """Whether stamps that wander to and fro by such a share of a step count as those of an even grid."""
    place = np.arange(400)
    return from_readings(readings((place + share * np.sin(2.0 * np.pi * place / 20.0)) / 100.0)).uniform


def one_short(share: float) -> bool:
    """Whether every row of an uneven column keeps its time, one step being such a share of the usual one."""
    steps = np.where(np.arange(300) % 11 == 3, 1.5, 1.0)
    steps[150] = share
    return OFF_GRID not in from_readings(readings(np.append(0.0, np.cumsum(steps)) / 100.0)).lost


def going_back(step: float) -> bool:
    """Whether times that go back once, and on in such steps, are those of one recording."""
    times = np.append(np.arange(20.0), 13.0 + step * np.arange(3))
    return not refused(lambda: from_readings(readings(times)), "starts again")


def last_away(share: float) -> bool:
    """Whether a last row keeps its time, such a share of the record away from all others."""
    times = np.append(np.arange(999.0), 998.0 + 1000.0 * share) / 100.0
    return ALONE not in from_readings(readings(times)).lost


def printed(steps: np.ndarray) -> bool:
    """Whether times tell single samples apart whose steps are so many last digits."""
    times = np.append(0.0, np.cumsum(steps))
    return not coarse.too_coarse(times, 1.0, [str(time) for time in times], np.arange(times.size))


def mixed(number: int, share: float) -> np.ndarray:
    """Steps of two digits, and of three in no order."""
    steps = np.full(number, 2.0)
    other = number - round(share * number)
    steps[np.random.default_rng(3).permutation(number)[:other]] = 3.0
    return steps


def ties(turns: float) -> bool:
    """Whether two hundred ties that go to the other side so many times leave no room for a row more or less."""
    rows = np.arange(400)
    late = np.where(rows % 2, 0.5 * (rows // 2 * int(turns) // 200 % 2), 0.0)
    return coarse._counts_on(rows, late, 2.0)


def rate_open(share: float) -> bool:
    """Whether coarse times count at the round rate next to them, which they tell to such a share."""
    rows = np.arange(round(5.0 / share) + 1)
    found = readings(rows // 5 * 0.05, 0.05)
    return not refused(lambda: coarse.counted_from_coarse(found, rows, None, None))


def stamps_alike(share: float) -> bool:
    """Whether each sample has a stamp of its own, such a share of the stamps being that of the sample before."""
    times = np.cumsum(np.arange(1000) % round(1.0 / share) > 0).astype(float)
    return coarse.shared_stamps(readings(times, 0.1), np.arange(1000), times).resolution == 0.1


def rows_alike(number: float) -> bool:
    """Whether samples share stamps, the first of the shared ones being those of rows that are there twice."""
    times = np.repeat(np.arange(4000.0), 2)
    rows = [str(i // 2 if i < 2 * number else i) + "r" * (i < 2 * number) for i in range(times.size)]
    return coarse.shared_stamps(readings(times, 0.1, rows), np.arange(times.size), times).resolution == 1.0


def in_turns(share: float) -> bool:
    """Whether readings are told that go to and fro in a share of the rows."""
    return bool(damage.folded(np.where(np.arange(1000) < 1000 * share, np.arange(1000) % 2, 0.5)))


def running_over(share: float) -> bool:
    """Whether a counter of 16 bits is told that passes a share of its numbers from row to row."""
    return bool(damage.folded(np.mod(np.arange(40.0) * round(share * 65536), 65536)))


def switching(left: float) -> bool:
    """Whether readings are told of which so much of a jump is left, once they are divided by the range."""
    high = np.arange(40) >= 20
    return damage.switched(np.where(high, 20 * (1 + left / (1 - 2 * left)), 10.0), np.where(high, 4.0, 2.0))


def of_century(seconds: float) -> bool:
    """Whether stamps of such a size are seconds since 1970."""
    found = stamps.stamps_of(np.full(5, seconds))
    return found is not None and found.unit == "s"


CLOCK = (
    Bracket("MOST_OFF", timebase, off_grid, 0.03, 0.08),
    Bracket("MOST_LOST", timebase, standing, 0.15, 0.3),
    Bracket("JITTER", timebase, late, 0.2, 0.35),
    Bracket("NO_STEP", timebase, one_short, 0.08, 0.03),
    Bracket(
        "CONTRADICTS",
        timebase,
        lambda x: not from_readings(readings(np.arange(1000) / 100.0), header_rate=100.0 * (1.0 + x)).notes,
        0.007,
        0.013,
    ),
    Bracket("RUNS_ON", timebase, going_back, 3.5, 1.8),
    Bracket("ALONE_BY", timebase, last_away, 0.015, 0.03),
    Bracket("COARSELY_PRINTED", coarse, lambda x: printed(np.tile([x, x, x + 1.0], 20)), 7, 4),
    Bracket("EVEN", coarse, lambda x: printed(mixed(200, x)), 0.85, 0.7),
    Bracket("EVEN_OF_FEW", coarse, lambda x: printed(mixed(15, x)), 0.7, 0.53),
    Bracket("TIES_TURNED", coarse, ties, 14, 7),
    Bracket("OPEN_RATE", coarse, rate_open, 1.4e-3, 2.8e-3),
    Bracket("SHARED", coarse, stamps_alike, 0.14, 0.33),
    Bracket("SHARING", coarse, rows_alike, 400, 700),
    Bracket("ROUND_DIGITS", rates, lambda x: round_rate(1.0 / int("137924"[: int(x)]), 1e-9 / 10**x) is not None, 4, 6),
    Bracket("CENTURY_BEGINS", stamps, of_century, 1.2e9, 0.7e9),
    Bracket("CENTURY_ENDS", stamps, of_century, 3e9, 6e9),
)


def column(*texts: str) -> Numbers:
    """Cells as numbers."""
    return parse_column(texts, ".", np.arange(1, len(texts) + 1), "column")


def short(share: float) -> bool:
    """Whether numbers of one decimal are told as damaged where such a share has two."""
    alike = round(100 * share)
    return digits.oddly_written(column(*["1.50"] * alike, *["1.5"] * (100 - alike))).any()


def in_thousands(whole: int) -> Numbers:
    """Numbers of three decimals, one or more each, beside so many different whole ones below a thousand."""
    return column(*[f"{i}.{100 + i}" for i in range(1, 40)], *[str(7 * i) for i in range(1, whole + 1)])


def decade(number: float) -> bool:
    """Whether so many numbers beyond ten may have a decimal less than sixty below it."""
    return not digits.oddly_written(column(*["1.50"] * 60, *["15.5"] * int(number))).any()


def whole(ratio: float) -> bool:
    """Whether a whole number this many times the largest decimal of a column is believed."""
    return not digits._mark_lost(column(*["1.5"] * 20, "2.0", f"{2.0 * ratio:.0f}")).any()


def outlier(text: str, swing: str) -> bool:
    """Whether a reading among some that swing to and fro is told by a character lost or doubled."""
    cells = [swing, f"-{swing}"] * 20
    cells[20] = text
    return digits._outliers_explained(column(*cells)).any()


def voted(number: float) -> bool:
    """Whether the last so many lines, of cells with tabs, tell the dialect."""
    found = dialect.vote(["1;2;3"] * 1000 + ["1\t2\t3"] * int(number))
    return found is not None and found[0].delimiter == "\t"


def one_table(stray: float, length: int) -> bool:
    """Whether so many lines of numbers above a table of a length are let pass."""
    first = int(stray)
    lines, block = ["1 2 3"] * (first + length), (first, first + length - 1)
    classes = [rows.FULL] * len(lines)
    return not refused(lambda: rows._refuse_second_table(lines, classes, block, Dialect(" ", ".", 3), ""))


def counted(number: float) -> bool:
    """Whether the first of so many rows is taken for the number of the others."""
    lines = [str(int(number) - 1), *["7"] * (int(number) - 1)]
    found = rows._collect(lines, ["full"] * len(lines), range(len(lines)), lambda line: [line], "")
    return len(found[1]) < len(lines)


def above(lines: float) -> bool:
    """Whether a heading so many lines above the table is found."""
    said = ["time [s],force [N]", *["remark"] * int(lines)]
    return find_header(said, Dialect(",", ".", 2), [False, False], ()) is not None


def units_of_rows(number: float) -> bool:
    """Whether so many units of force in a column are a unit that changes."""
    cells = ["N", "mN", "uN", "kN", "MN", "lbf", "kgf", "gf"][: int(number)]
    return refused(lambda: stated_unit(cells, range(1, len(cells) + 1), ""), "changes")


def meant(number: float, unit: str, rate: float) -> bool:
    """Whether a number in a header may mean such a rate."""
    said = [one for found in facts._meant([number], unit, "", not unit) for one in found.rates]
    return any(abs(one / rate - 1.0) < 1e-6 for one in said)


def near(lines: float) -> bool:
    """Whether a heading is completed by a line so many above it."""
    above = ["Time,a,b", *["1,2,3"] * (int(lines) - 1), ",Force [N],Position [mm]"]
    found = find_header(above, Dialect(",", ".", 3), [False] * 3, ())
    return found is not None and found.names[0] == "Time"


GRAMMAR = (
    Bracket("ROUND_BY_CHANCE", digits, lambda odd: digits._too_few_to_be_round(int(odd), 1000), 60, 85),
    Bracket("ALIKE_WRITTEN", digits, short, 0.9, 0.7),
    Bracket("FEWEST_WRITTEN", digits, decade, 7, 4),
    Bracket("FEWEST_WHOLE", digits, lambda x: bool(digits.grouped_digits(in_thousands(int(x)))), 4, 2),
    Bracket("LOST_MARK", digits, whole, 7, 13),
    Bracket("FAR_OUT", digits, lambda x: outlier(f"{0.02 * (2 * SCATTER * x - 1):.3f}", "0.020"), 11, 6),
    Bracket("PUT_BACK", digits, lambda x: outlier({2.5: "122.8", 4: "211.7"}[x], "2.0"), 2.5, 4),
    Bracket(
        "OTHER_MARKS",
        numbers,
        lambda x: not refused(lambda: column(*["1.5"] * 1000, *["1,5"] * int(x))),
        8,
        14,
    ),
    Bracket("VOTERS", dialect, voted, 130, 70),
    Bracket(
        "FEWEST_TEXTS",
        dialect,
        lambda x: dialect._column_kind(Counter(text=round(100 * x), empty=round(100 * (1 - x)))) == "empty",
        0.2,
        0.4,
    ),
    Bracket("STRAY_ROWS", rows, lambda x: one_table(x, 100), 2, 3),
    Bracket("STRAY_SHARE", rows, lambda x: one_table(x, 1000), 8, 14),
    Bracket("DIGITS_OF_A_ROW", rows, lambda x: rows._looks_like_a_row("1" * x + "." * (100 - x)), 50, 30),
    Bracket("COUNTED_ROWS", rows, counted, 5, 3),
    Bracket("HEADER_DEPTH", header, above, 300, 600),
    Bracket("NEAR_HEADINGS", header, near, 2, 3),
    Bracket("UNITS_OF_ROWS", worth, units_of_rows, 5, 8),
    Bracket("LONGEST_HEADING", headings, lambda x: split_heading("f" * (x - 4) + " [N]")[1] == "N", 150, 300),
    Bracket("SLOWEST_RATE", facts, lambda x: meant(x, "Hz", x), 1.4e-3, 0.7e-3),
    Bracket("FASTEST_RATE", facts, lambda x: meant(x, "Hz", x), 0.7e10, 1.4e10),
    Bracket("MOST_SAMPLES", facts, lambda x: facts._whole(f"{x:.0f}", ".") == [int(x)], 0.7e12, 1.4e12),
    Bracket("SLOWEST_LIKELY", facts, lambda x: meant(1.0 / x, "", x), 7.0, 3.5),
    Bracket("FASTEST_LIKELY", facts, lambda x: meant(1e6 / x, "", x), 3.5e5, 7e5),
)


def in_turn(number: float) -> bool:
    """Whether so many channels are found below each other."""
    rows = [f"{i},channel {chr(97 + k)},{i + k}" for i in range(9) for k in range(int(number))]
    return long_form.channels_in_turn(["time,name,value", *rows]) is not None


def table(rows: float) -> bool:
    """Whether so many rows of numbers are read."""
    lines = ["time [s],force [N]", *(f"0.{row},1.{row}" for row in range(int(rows)))]
    return not refused(lambda: text.read_text(Text(lines, "UTF-8", True), "", ReadOptions()))


def paged(pages: float) -> bool:
    """Whether rows without times are read below so many headings."""
    page = "force [N];position [mm]\n" + "".join(f"1,{i};2,{i}\n" for i in range(9))
    lines = ("fs = 2000 Hz\n" + page * (int(pages) + 1)).splitlines()
    return bool(text.read_text(Text(lines, "UTF-8", True), "", ReadOptions()).placed)


def named(share: float) -> bool:
    """Whether lines of which such a share names its values make a table."""
    pairs = round(100 * share)
    lines = ["t=0.1 F=2.5"] * pairs + ["nothing here"] * (100 - pairs)
    return "t\tF" in keyed._from_pairs(Text(lines, "UTF-8", True), "").lines


def beside(letters: float) -> bool:
    """Whether pairs make a table beside so many letters a line, of which there are twelve without."""
    lines = ["t=0.1 F=2.5 " + "x" * int(letters)] * 50
    return "t\tF" in keyed._from_pairs(Text(lines, "UTF-8", True), "").lines


def is_text(sign: bytes, share: float) -> bool:
    """Whether ten thousand bytes are text of which such a share, at the end, is one sign."""
    odd = round(10_000 * share)
    return not refused(lambda: decode.decode(b"1,2\n" * ((10_000 - odd) // 4) + sign * odd, ""))


def wide(even: float, odd: float) -> bool:
    """Whether a sign has two bytes where such shares of them are zero in every other place and in those between."""
    data = np.full(4000, ord("1"), np.uint8)
    data[::2][: round(2000 * even)] = 0
    data[1::2][: round(2000 * odd)] = 0
    return decode._wide_encoding(data.tobytes()) is not None


def cyrillic(share: float) -> bool:
    """Whether a text is Cyrillic of whose words with high bytes such a share is made of them throughout."""
    high = round(100 * share)
    return decode._is_cyrillic(b" ".join([b"\xc0\xc1\xc2\xc3"] * high + [b"ab\xe9c"] * (100 - high)))


FILES = (
    Bracket("FEWEST_ROWS", text, table, 3, 2),
    Bracket("MOST_IN_TURN", long_form, in_turn, 10, 14),
    Bracket("FEWEST_PAGES", text, paged, 4, 2),
    Bracket("LAYOUT_LINES", keyed, lambda x: '"1"' in keyed.requoted(["1,2"] * 999 + ["'1','2'"] * x)[-1], 130, 70),
    Bracket("NAMED_ALIKE", keyed, named, 0.95, 0.8),
    Bracket("WORDS_BESIDE", keyed, beside, 2, 5),
    Bracket("CONTROLS", decode, lambda x: is_text(b"\x01", x), 0.007, 0.013),
    Bracket("ZEROS", decode, lambda x: is_text(b"\x00", x), 0.2, 0.4),
    Bracket("WIDE_ZEROS", decode, lambda x: wide(0.0, x), 0.8, 0.4),
    Bracket("NARROW_ZEROS", decode, lambda x: wide(x, 1.0), 0.07, 0.15),
    Bracket("WHOLE_WORDS", decode, cyrillic, 0.75, 0.45),
)


def measured(role: str, rate: float, shift: float = 0.0, samples: int = 50, moved: float = 0.0) -> Record:
    """A noisy channel, sampled from an instant on that is given in steps."""
    values = np.random.default_rng(2).normal(size=samples)
    time = (np.arange(samples) + shift) / rate
    values += moved * float(np.std(np.diff(values)))
    return Record(role, Path(f"{role}.csv"), "", time, {role: values}, {role: np.ones(samples, bool)}, rate)


def beginning(shift: float) -> Record:
    """A force with the position of another file beside it, whose samples are so many steps late."""
    return side_by_side(measured("force", 1000.0), measured("position", 1000.0, shift))


def same_looks(samples: float) -> bool:
    """Whether two records of which so many samples are known, and equal, are copies."""
    looks = Fingerprint(100, {"force": [1.0 if number < samples else None for number in range(20)]}, {"force": 0.1})
    return bool(copies.copies_by_fingerprint([looks, looks]))


def two_valued(number: float) -> bool:
    """Whether so many readings of two values are a command."""
    return declared._heading(binary_column("c", "c", None, np.arange(int(number)) % 2)).two_valued


def claimed_peak(size: float) -> bool:
    """Whether a largest force ten times that of a column, but for so much, is a question."""
    column = replace(binary_column("force", "force", "N", np.array([1.0, 2.0, 3.0])), number=1)
    annotations = [Annotation("line 1", f"Peak force: {30.0 * (1 + size):.9g} N")]
    return "force" in account.unaccounted(annotations, [column], {"force": 0}, frozenset(), "", known.AsRead())[0]


def claimed_length(size: float) -> bool:
    """Whether a duration ten times that of a record, but for so much, is a question."""
    return claimed.contradicted_length([Annotation("line 1", f"Duration: {10.0 * (1 + size):.9g} s")], 1.0) is not None


def known_to_be_harmless(line: str) -> bool:
    """Whether nothing in a line beside a table of force and position is asked about."""
    known._unknown_in.cache_clear()  # what is kept was found with another threshold
    return not any(moves for _, moves in known.unknown_in(line, ".", frozenset(("force", "position"))))


def passed_over(line: str) -> bool:
    """Whether nothing in a line is even repeated beside the record."""
    known._unknown_in.cache_clear()
    return not known.unknown_in(line, ".", frozenset(("force", "position")))


def words_of(first: str, more: str, number: float) -> str:
    return first + more * (round(number) - len(first.split()))


WHOLE = (
    Bracket("LONGEST_LABEL", known, lambda x: known_to_be_harmless(words_of("gain", " quux", x)), 3, 4),
    Bracket(
        "SHORTEST_SENTENCE",
        known,
        lambda x: known.states_unit(words_of("quux", " quux", x - 1) + " ms", "time", "s"),
        3,
        2,
    ),
    Bracket(
        "MOST_NAME_WORDS", known, lambda x: known_to_be_harmless(words_of("amplifier gain", " module", x) + " 20"), 5, 6
    ),
    Bracket("STATED_ALIKE", unmoved, lambda x: known_to_be_harmless(f"cell entered {x} V, shown 1 V"), 1.03, 1.08),
    Bracket("LEAST_SERIAL", unmoved, lambda x: unmoved.is_label(Amount(x, counted=True)), 15001, 7001),
    Bracket("SHORTEST_NAME", unmoved, lambda x: passed_over(f"{'quux'[: round(x)]}: 5"), 3, 2),
    Bracket("LONGEST_STEP", unmoved, lambda x: passed_over(f"quux {x} s"), 1.5, 0.7),
    Bracket("LEAST_CERTIFICATE", known, lambda x: known_to_be_harmless(f"calibration {x:.0f}"), 120, 80),
    Bracket("LONGEST_SAID", known, lambda x: not known_to_be_harmless(" " * round(x - 8) + "force x2"), 700, 1000),
    Bracket("SAME_PEAK", judged, claimed_peak, 3e-3, 7e-3),
    Bracket("SAME_LENGTH", claimed, claimed_length, 0.7e-2, 1.3e-2),
    Bracket("FOLDED", doubts, sign_apart, 0.1, 0.2),
    Bracket("NO_ACCIDENT", repeats, repeated_block, 14, 7),
    Bracket("SAME_ALWAYS", repeats, standing_twice, 0.95, 0.8),
    Bracket("TAKES_TURNS", damage, in_turns, 0.98, 0.9),
    Bracket("RUNS_OVER", damage, running_over, 0.2, 0.3),
    Bracket("LEFT_OVER", damage, switching, 0.07, 0.13),
    Bracket("TWO_VALUED", declared, two_valued, 25, 15),
    Bracket(
        "COUNTS_ON",
        grouping,
        lambda x: grouping.counts_by(np.cumsum(1.0 + (np.arange(1001) >= 1000 * x))) > 0,
        0.9,
        0.7,
    ),
    Bracket("ON_GRID", join, lambda x: join._on_grid(3.0 + x, 1.0), 0.2, 0.35),
    Bracket(
        "SAME_RATE",
        join,
        lambda x: not refused(lambda: join.joined([measured("force", 1e3), measured("force", 1e3 * (1 + x), 60)])),
        0.7e-3,
        1.3e-3,
    ),
    Bracket("ON_TIME", join, lambda x: "sample by sample" in beginning(x).history[-1], 0.7e-3, 1.3e-3),
    Bracket("IN_COMMON", join, lambda x: not refused(lambda: beginning(50 - x)), 3, 2),
    Bracket(
        "COPIED",
        copies,
        lambda x: copies.first_copy([measured("force", 1e3), measured("force", 1e3, moved=x)]) is not None,
        0.7e-3,
        1.3e-3,
    ),
    Bracket("SAME_SAMPLES", copies, same_looks, 9, 6),
)


CASES = (*DAMAGE, *CLOCK, *GRAMMAR, *FILES, *WHOLE)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
