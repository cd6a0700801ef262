"""What the lines around a table say about it: sampling rate and number of samples.

A statement is a key, perhaps with a unit in it, and a number, perhaps with a unit behind it. How the table writes its
decimals tells which of ``2,000`` and ``2.000`` is two thousand; what stays open is said, and never guessed.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from fibrefit.core import units
from fibrefit.core.formatting import format_number
from fibrefit.records.thresholds import (
    FASTEST_LIKELY,
    FASTEST_RATE,
    LONGEST_HEADING,
    MOST_SAMPLES,
    SAME_RATE,
    SLOWEST_LIKELY,
    SLOWEST_RATE,
)

_SAMPLING = (
    r"(?:sampl\w*|abtast\w*|mess|measur\w*|scan|data|acquisition|acq\w*|daq|log\w*|record\w*|erfassungs?"
    r"|echantillonnage)"
)
#: The time of these is that between samples; that of an acquisition, a log or a record is its length.
_ONE_SAMPLE = r"(?:sampl\w*|abtast\w*|scan)"
_RATE_KEYS = (
    rf"fs|f s|f sample|cadence|{_SAMPLING}[ ]?(?:rate|frequen\w*|clock|freq)|abtast(?:rate|frequenz)|messrate"
    r"|samples per second|s/s|vzorkovaci frekvence|frekvence vzorkovani|frequence d.echantillonnage"
    r"|frequenza di campionamento|frecuencia de muestreo|frequencia de amostragem|sr"
    r"|(?:采样|取樣|采樣)(?:频率|頻率|率|速率)|サンフリンク(?:周波数|レート|速度)|샘플링(?: ?주파수| ?속도)"
)
_STEP_KEYS = (
    rf"dt|ts|t ?inc|t ?interval|(?:delta|[\u0394\u2206\u03b4])[ -]?[xt]|{_SAMPLING}[ ]?(?:interval\w*|step)"
    rf"|{_ONE_SAMPLE}[ ]?(?:period|time|cycle)"
    r"|(?:x|t|time|wf)?[ ]?incr?(?:ement)?|interval(?:l|o|le)?(?: ?\(time\))?|h ?resolution"
    r"|horizontal (?:interval|resolution)|time ?axis|clock|time[ ]?(?:step|increment|interval|resolution)"
    r"|abtast(?:intervall|zeit|periode)|zeit(?:schritt|inkrement)|samplet(?:ime)?"
    r"|(?:vzorkovaci )?perioda(?: vzorkovani)?|(?:采样|取樣|采樣)(?:间隔|間隔|周期|週期)|サンフリンク(?:間隔|周期)"
)
_COUNT_KEYS = (
    r"samples|(?:number|no\.?|num) of (?:samples|points|rows|scans)|points|record length|block ?size"
    r"|anzahl (?:der )?(?:messwerte|werte|samples|punkte)|messwerte|pocet (?:vzorku|hodnot|bodu)"
)
#: Of so many samples one is kept: whether the rate that is named is that before or after is not said.
_THINNED_KEYS = (
    r"decimation|(?:down|sub|under)[ -]?sampl\w*|(?:rate|clock|sample|sampling)?[ ]?(?:divider|divisor|prescaler)"
    r"|skip(?:ped|ping)?|dezimation|untersetzung|decimation factor|keep every|averag(?:ing|es?)|mittelung|moyenne"
)
#: The same in a sentence; and a rate that several channels share.
_KEPT = re.compile(
    r"(?:every|jede[rsn]?)\s+(?:(\d+)(?:st|nd|rd|th|\.|\s+(?:samples?|values?|points?|rows?|scans?|werte?))|other|second|third"
    r"|fourth|fifth|tenth|zweite[rn]?)",
    re.IGNORECASE,
)
_SHARED = re.compile(
    r"(?:aggregate|combined|overall|multiplex\w*|gesamt\w*|summen\w*|total)\s+(?:sampl\w*|scan|rate|abtast\w*)", re.I
)
_IN_TURN = re.compile(
    r"\b(?:in turn|alternat\w*|interleav\w*|abwechselnd|nacheinander|sequential\w*)\b"
    r"|\b(?:shared|split|divided) (?:by|among|between|over|across)\b|\b(?:across|over|for) (?:all|both|the) channels\b"
    r"|\b(?:before|prior to|after|vor|nach)\b|\(\s?\d+ ?(?:ch|inputs|kan)\w*",
    re.IGNORECASE,
)
#: A frequency, with the words before it; and words for one that is not of the samples.
_FREQUENCY = re.compile(r"([^,;()\d]*)(?<![\d.,])(\d[\d.,]*)\s*([kM]?Hz|[kM]?S/s|[kM]?sps)\b", re.IGNORECASE)
OF_OTHER_RATES = re.compile(
    r"filter|cut|pass|band|bessel|butter|excit|carrier|mains|anti|alias|nyquist|displ|refresh|updat|test|signal|resonan|max",
    re.IGNORECASE,
)
#: Words for the samples that were kept, in a line with a frequency.
_OF_ROWS = re.compile(
    r"\b(?:stor|sav|writ|log|kept|keep|output|export|stream|record|data|reduc|averag|effectiv|final|down|resampl|rows?\b"
    r"|points?\b|gespeichert|ausgabe|daten|reduziert)",
    re.IGNORECASE,
)
#: Keys that say what horizontal numbers without a unit are in.
_AXIS_KEYS = r"horizontal units?|h ?unit|x ?units?|x.einheit|time units?|zeiteinheit"

_SPACE = " \u00a0\u2009\u202f"
_GROUPED = rf"\d{{1,3}}(?:[.,'\u2019{_SPACE}]\d{{3}})+(?!\d)(?:[.,]\d+)?"
_NUMBER = rf"([+-]?(?:{_GROUPED}|\d+(?:[.,]\d*)?)(?:[eE][+-]?\d+)?)"
_UNIT = r"(?:([ ]*[;,\t][ \"]*|\s*)((?:1/)?[^\W\d_][^\s;,\t\"\])]*|/s))?"
_BREAK = r"\"?(?:[:=;,\t ]|analog)+[\"(]*"


def _pattern(keys: str) -> re.Pattern[str]:
    # A unit may end the key: "Rate (Hz)", "sample_rate_hz".
    unit_in_key = r"(?:\s*[\[(]([^\])]*)[\])]|[ ]([km]?hz|[num]?s|[mu]sec|sec))?"
    return re.compile(rf"(?<![\w/])(?:{keys}){unit_in_key}\"?\s*{_BREAK}{_NUMBER}{_UNIT}", re.IGNORECASE)


#: A line that begins with the bare word, or consists of it: "Rate: 2 kHz".
_BARE_RATE = re.compile(
    rf"[\W_]*(?:rate|sampling|abtastung)(?:\s*[\[(]([^\])]*)[\])]|[ ](k?hz))?\"?\s*(?:{_BREAK})?{_NUMBER}{_UNIT}",
    re.IGNORECASE,
)
#: A frequency or a short time below any other key: of the samples, of the motion, of a filter.
_ANY_RATE = re.compile(
    rf"[\W_]*([^\W\d_][^\d:=;,\t]{{0,40}}?)\"?\s*{_BREAK}{_NUMBER}[ \"]*[;,\t]?[ \"]*(k?hz|[mu]?s|[mu]?sec)\b\.?",
    re.IGNORECASE,
)
_PER_SAMPLE = re.compile(rf"(?<![\w/]){_NUMBER}\s*([^\W\d_]+)/sample\b", re.IGNORECASE)
#: A rate that needs no key: by its unit, of samples; or because nothing stands before it: "# 2 kHz; rope 17".
_IN_SAMPLES = re.compile(
    rf"(?<![\w/.,]){_NUMBER}\s*([kM]?)(?:Sa?/s|sps|(?:samples?|scans?|readings?)\s?(?:per|/)\s?s(?:ec(?:onds?)?)?)(?![^\W_])",
    re.I,
)
_FIRST_OF_ALL = re.compile(rf"[\W_]*{_NUMBER}\s*([kM]?)Hz\s*(?:$|[;,|\t])", re.I)


#: What an instrument could do is not what it did.
_AT_MOST = re.compile(r"\b(?:max(?:imum|imal)?|maximale?r?|highest|up to|bis)\b[^:=;,\t]{0,12}$", re.IGNORECASE)

#: A part of a second, or a number of them: "1/2000 s". A date has two of these signs.
_FRACTION = re.compile(r"(?<![\d/.,])(\d+)\s*/\s*(\d+)(?=\s*(?:[mun]?s|[mu]?sec|seconds?|hz|khz)\b)", re.IGNORECASE)

_RATE, _STEP, _COUNT = _pattern(_RATE_KEYS), _pattern(_STEP_KEYS), _pattern(_COUNT_KEYS)
_STATE_IT = (_RATE.search, _BARE_RATE.match, _IN_SAMPLES.search, _FIRST_OF_ALL.match)
_THINNED = re.compile(
    rf"(?<![\w/])(?:{_THINNED_KEYS})(?:[ ]?(?:factor|ratio|rate|by|of))?\"?\s*{_BREAK}{_NUMBER}", re.IGNORECASE
)
_AXIS = re.compile(rf"(?<![\w])(?:{_AXIS_KEYS})\"?\s*[:=;,\t ]+\"?\s*([^\s;,\t\"]+)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Facts:
    """What a header says about the sampling.

    Parameters
    ----------
    rates : tuple of float
        Sampling rates named, in Hz, each once.
    quoted : str
        The words that name the first of them.
    samples : int or None
        Number of samples announced.
    notes : tuple of str
        What had to be decided.
    doubt : str
        A statement of the rate that can be read in two ways, and both of them; empty where there is none.
    changes : str
        What names a rate where the rows have begun, and another one than stands above them; empty for nothing.
    """

    rates: tuple[float, ...] = ()
    quoted: str = ""
    samples: int | None = None
    notes: tuple[str, ...] = ()
    doubt: str = ""
    changes: str = ""

    @property
    def rate(self) -> float | None:
        """The sampling rate in Hz, where the header names exactly one, beyond doubt."""
        return self.rates[0] if len(self.rates) == 1 and not self.doubt else None


@dataclass(frozen=True, slots=True)
class _Said:
    """A statement of a rate: the rates in Hz it may mean, the words, and what had to be decided."""

    rates: tuple[float, ...]
    quoted: str
    note: str = ""


def find_facts(above: Iterable[str], mark: str = ".") -> Facts:
    """Sampling rate and number of samples from the lines above a table.

    Parameters
    ----------
    above : iterable of str
        Lines such as ``# fs = 2000 Hz``, ``dt=500 us``, ``Interval (Time) : 0.5000 ms``, ``Samples<tab>6``.
    mark : str
        Decimal mark of the table.

    Returns
    -------
    Facts
        What was found; steps in time are turned into rates.
    """
    lines = [_plain(line) for line in above]
    axis = next((m[1] for line in lines if (m := _AXIS.search(line)) and units.kind_of(m[1]) == "time"), "")
    said = [one for line in lines for one in _said(line, mark, axis)]
    samples = {n for line in lines for match in _COUNT.finditer(line) for n in _whole(match.group(3), mark)}
    count = samples.pop() if len(samples) == 1 else None
    clear = [one for one in said if len(one.rates) == 1]
    rates = tuple(dict.fromkeys(one.rates[0] for one in clear))
    # A statement in two readings is settled by one that has a single reading, if that is one of the two.
    open_ones = [one for one in said if len(one.rates) > 1 and not set(one.rates) & set(rates)]
    quoted = clear[0].quoted if clear else ""
    facts = Facts(rates, quoted, count, tuple(dict.fromkeys(one.note for one in clear if one.note)))
    if not open_ones:
        bare = next(filter(None, (_may_be_a_rate(line, mark) for line in lines if not rates)), "")
        doubt = f'"{bare}", which may be the rate of the samples or of something else' if bare else ""
        return replace(facts, doubt=doubt or _thinned(lines, facts, mark))
    readings = " or ".join(f"{format_number(rate, 7)} Hz" for rate in open_ones[0].rates)
    return replace(facts, doubt=f'"{open_ones[0].quoted}", which can be read as {readings}')


def _may_be_a_rate(line: str, mark: str) -> str:
    """What a line says of a frequency that rows may have, or of a time that may lie between two; empty for nothing."""
    found = _ANY_RATE.match(line) if len(line) <= LONGEST_HEADING else None
    unit = found and next((u for u in (found[3], _capitals(found[3])) if units.expression(u)), None)
    if found is None or not unit or OF_OTHER_RATES.search(found[1]):
        return ""
    said = _meant(_numbers(found[2], mark, in_groups=True), unit, found[0].strip(), units.kind_of(unit) == "time")
    likely = any(SLOWEST_LIKELY <= rate <= FASTEST_LIKELY for one in said for rate in one.rates)
    return found[0].strip() if likely else ""


def frequencies_in(line: str, mark: str) -> list[float]:
    """Frequencies a line names, in Hz, that may be the rate of rows: each in all its readings.

    Parameters
    ----------
    line : str
        Beside a table.
    mark : str
        Decimal mark of the table.
    """
    found = () if OF_OTHER_RATES.search(line) else _FREQUENCY.finditer(line)
    return [
        {"k": 1e3, "m": 1e6}.get(m[3][:1].casefold(), 1.0) * n
        for m in found
        for n in _numbers(m[2], mark, in_groups=True)
    ]


def _thinned(lines: list[str], facts: Facts, mark: str) -> str:
    """What is in doubt of a rate beside a statement that of so many samples one is kept; empty where nothing is."""
    for match in (
        match for line in lines if facts.rate for match in (_KEPT.search(line), _SHARED.search(line)) if match
    ):
        if match[0][-2:].strip() and match[0].split()[1].rstrip("ndrsth.") != "1":
            return f'"{facts.quoted}" beside "{match[0]}", which may be a rate of more samples than are here'
    stated = [line for line in lines if len(facts.rates) == 1 and any(is_at(line) for is_at in _STATE_IT)]
    for line in (line for line in stated if len(line) <= LONGEST_HEADING):
        turn = _IN_TURN.search(line)
        others = [m[2] + m[3] for m in _FREQUENCY.finditer(line) if not OF_OTHER_RATES.search(m[1])]
        if turn or len(set(others)) > 1:
            beside = turn[0] if turn else " and ".join(dict.fromkeys(others))
            return f'"{" ".join(line.split())[:60]}", of which "{beside}" leaves open which rate the rows have'
    for line in (line for line in lines if line not in stated and len(line) <= LONGEST_HEADING):
        frequencies = frequencies_in(line, mark) if len(facts.rates) == 1 else []
        of_rows = _OF_ROWS.search(line) or _IN_SAMPLES.search(line)
        if frequencies and of_rows and all(abs(rate / facts.rates[0] - 1.0) > SAME_RATE for rate in frequencies):
            return f'"{facts.quoted}" and "{" ".join(line.split())[:60]}", which may be the rate of the rows'
    for match in (match for line in lines for match in _THINNED.finditer(line)):
        numbers = [n for n in _numbers(match.group(1), mark, in_groups=False) if n > 1.0 and n == int(n)]
        if numbers and len(facts.rates) == 1:
            readings = " or ".join(
                f"{format_number(rate, 7)} Hz" for rate in (facts.rates[0], facts.rates[0] / numbers[0])
            )
            words = " ".join(match.group(0).split()).strip('"')
            return f'"{facts.quoted}" and "{words}", which can be read as {readings}'
    return ""


def _plain(line: str) -> str:
    """Line without accents, with words set apart by blanks."""
    bare = "".join(c for c in unicodedata.normalize("NFD", line) if not unicodedata.combining(c))
    bare = _FRACTION.sub(lambda found: repr(int(found[1]) / (int(found[2]) or 1)), bare)
    return re.sub(r"(?<=[a-z]{2})(?=[A-Z][a-z]{2})|_", " ", bare).replace("\u03bc", "u").replace("\u00b5", "u")


def _said(line: str, mark: str, axis: str) -> Iterator[_Said]:
    """Statements of a rate in a line."""
    matches = [(match, False) for match in _RATE.finditer(line)] + [(match, True) for match in _STEP.finditer(line)]
    bare = _BARE_RATE.match(line)
    matches += [(bare, False)] if bare and _unit(bare) else []
    for match, is_step in matches:
        unit = _unit(match)
        quoted = " ".join(match.group(0).split()).strip('"')
        if unit is None or (not is_step and _AT_MOST.search(line[: match.start()])):
            continue
        numbers = _numbers(match.group(3), mark, in_groups=unit in ("", "us", "ns") if is_step else True)
        if not is_step and unit[:1] in ("k", "M") and len(numbers) == 1:
            # "1.024 kHz" above decimal commas: so many thousands are as unlikely as decimals by the other mark.
            other = _numbers(match.group(3), "," if mark == "." else ".", in_groups=True)
            numbers = list(dict.fromkeys([*numbers, *other]))
        yield from _meant(numbers, unit or (axis if is_step else ""), quoted, is_step)
    first = _FIRST_OF_ALL.match(line)
    for match in (*_IN_SAMPLES.finditer(line), *([first] if first else ())):
        matched = any(a.start() <= match.start() < a.end() for a, _ in matches)
        if not matched and not _AT_MOST.search(line[: match.start()]):
            yield from _meant(_numbers(match[1], mark, in_groups=True), f"{match[2]}Hz", match[0].strip(), False)
    for match in _PER_SAMPLE.finditer(line):
        if units.kind_of(match.group(2)) == "time":
            yield from _meant(_numbers(match.group(1), mark, in_groups=False), match.group(2), match.group(0), True)


def _meant(numbers: list[float], unit: str, quoted: str, is_step: bool) -> Iterator[_Said]:
    """What a statement means, for each way to read its number."""
    if unit == "" and is_step:
        found = [(1.0 / (n * units.to_si(u, "s")), u) for n in numbers if n > 0 for u in ("s", "ms", "us")]
        likely = [(rate, u) for rate, u in found if SLOWEST_LIKELY <= rate <= FASTEST_LIKELY]
        rates = tuple(float(f"{rate:.12g}") for rate, _ in likely)
        note = f'"{quoted}" has no unit: taken as {likely[0][1]}.' if likely else ""
    elif unit == "":
        rates, note = tuple(numbers), f'"{quoted}" has no unit: taken as Hz.'
    elif units.kind_of(unit) == ("time" if is_step else "frequency"):
        factor = units.to_si(unit, "s" if is_step else "Hz")
        rates = tuple(float(f"{1.0 / (n * factor) if is_step else n * factor:.12g}") for n in numbers if n > 0)
        note = ""
    else:
        return
    rates = tuple(dict.fromkeys(rate for rate in rates if SLOWEST_RATE <= rate <= FASTEST_RATE))
    usual = tuple(rate for rate in rates if rate >= SLOWEST_LIKELY)
    if is_step and len(rates) > len(usual) == 1:  # "500.000 us", which nobody calls half a second
        rates, note = usual, f'"{quoted}" is taken as {format_number(usual[0], 7)} Hz.'
    if rates:
        yield _Said(rates, quoted, note)


def _numbers(text: str, mark: str, *, in_groups: bool) -> list[float]:
    """Numbers a text may stand for: one, or two where a mark may separate thousands or decimals.

    Parameters
    ----------
    text : str
        Digits with marks.
    mark : str
        Decimal mark of the table.
    in_groups : bool
        Whether digits after the table's own decimal mark may be a group of three.
    """
    mantissa, e, exponent = text.rstrip(".,").partition("e" if "e" in text else "E")
    bare = re.sub(rf"['\u2019{_SPACE}]", "", mantissa)
    power = f"e{exponent}" if e else ""
    used = {sign for sign in bare if sign in ".,"}
    if not used:
        return [float(bare + power)]
    if len(used) == 2:  # 2,000.00: the last one is the decimal mark
        last = max(used, key=bare.rfind)
        plain = bare.replace("," if last == "." else ".", "").replace(last, ".")
        return [float(plain + power)] if plain.count(".") == 1 else []
    (sign,) = used
    before, _, after = bare.partition(sign)
    if sign == "," and mark == "." and (after == before or (len(after) > 3 and len(before) > 1)):
        return [float(before + power)]  # the cell of the next column
    groups = re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}(?:\{sign}\d{{3}})+", bare) is not None and not power
    if bare.count(sign) > 1:
        return [float(bare.replace(sign, ""))] if groups else []
    decimal = float(bare.replace(sign, ".") + power)
    if not groups:
        return [decimal]
    whole = float(bare.replace(sign, ""))
    if sign != mark:
        return [whole]
    return [decimal, whole] if in_groups else [decimal]


def _whole(text: str, mark: str) -> list[int]:
    """Number of samples, where it is one beyond doubt."""
    found = [n for n in _numbers(text, mark, in_groups=True) if n == int(n) and 0 < n < MOST_SAMPLES]
    return [int(found[-1])] if found else []


def _unit(match: re.Match[str]) -> str | None:
    """Unit after the number, or in brackets before it; empty where there is none, None where it is not known."""
    in_key, gap, after = match.group(1) or match.group(2), match.group(4) or "", match.group(5)
    if after == "/s":
        return "Hz"
    if after and units.expression(after) is not None:
        return after
    if after and not gap.strip(" "):
        return after.casefold() if units.expression(after.casefold()) is not None else None
    if after and re.search(r"hz$|sps$|/s|^samples$|sec$|^[kmun]?s$", after, re.IGNORECASE):
        return None  # a unit, but none that is known
    # A word in the next cell is another matter; a word in brackets may be a remark: "Interval (Time)".
    known = in_key and next((u for u in (in_key.strip(), _capitals(in_key.strip())) if units.expression(u)), None)
    return known or ""


def _capitals(unit: str) -> str:
    """``khz`` as ``kHz``."""
    return re.sub("hz$", "Hz", unit.casefold())
