"""What the lines above a table say about it: sampling rate and number of samples."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from fibrefit.core import units

_NUMBER = r"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_UNIT = r"(?:([ ]*[;,\t][ \"]*|\s*)((?:1/)?[^\W\d_][^\s;,\t\")\]]*))?"

_RATE_KEYS = (
    r"fs|f_s|f_sample|sampl\w*[ _]?(?:rate|freq\w*)|(?:scan|data|acquisition|acq)[ _]?rate|abtast(?:rate|frequenz)"
    r"|messrate|samples per second|(?:vzorkovac[ií] )?frekvence(?: vzorkov[aá]n[ií])?"
)
_STEP_KEYS = (
    r"dt|delta[ _]?[xt]|sampl\w*[ _]?(?:interval|period|time|step)|interval(?: ?\(time\))?|x?[ _]?incr?(?:ement)?"
    r"|h ?resolution|time[ _]?(?:step|increment|interval|resolution)|abtast(?:intervall|zeit|periode)"
    r"|(?:vzorkovac[ií] )?perioda(?: vzorkov[aá]n[ií])?"
)
_COUNT_KEYS = (
    r"samples|(?:number|no\.?|num) of (?:samples|points|rows|scans)|points|record length"
    r"|anzahl (?:der )?(?:messwerte|werte|samples)|messwerte|po[cč]et (?:vzork[uů]|hodnot|bod[uů])"
)


def _pattern(keys: str) -> re.Pattern[str]:
    unit_in_key = r"(?:\s*[\[(]([^\])]*)[\])])?"
    return re.compile(rf"(?<![\w/])(?:{keys}){unit_in_key}\"?\s*[:=;,\t ]+\"?\s*{_NUMBER}{_UNIT}", re.IGNORECASE)


#: Rates in Hz and numbers of samples beyond which a header is damaged.
_SLOWEST, _FASTEST = 1e-3, 1e10
_MOST_SAMPLES = 1e12

_RATE, _STEP, _COUNT = _pattern(_RATE_KEYS), _pattern(_STEP_KEYS), _pattern(_COUNT_KEYS)


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
    """

    rates: tuple[float, ...] = ()
    quoted: str = ""
    samples: int | None = None
    notes: tuple[str, ...] = ()

    @property
    def rate(self) -> float | None:
        """The sampling rate in Hz, where the header names exactly one."""
        return self.rates[0] if len(self.rates) == 1 else None


def find_facts(above: Iterable[str]) -> Facts:
    """Sampling rate and number of samples from the lines above a table.

    Parameters
    ----------
    above : iterable of str
        Lines such as ``# fs = 2000 Hz``, ``dt=500 us``, ``Interval (Time) : 0.5000 ms``, ``Samples<tab>6``.

    Returns
    -------
    Facts
        What was found; steps in time are turned into rates.
    """
    rates: dict[float, str] = {}
    samples: set[int] = set()
    notes: list[str] = []
    for line in above:
        for match in _RATE.finditer(line):
            rate, note = _rate(match)
            if _is_possible(rate):
                rates.setdefault(rate, " ".join(match.group(0).split()))
                notes += [note] if note else []
        for match in _STEP.finditer(line):
            rate = _step(match)
            if _is_possible(rate):
                rates.setdefault(rate, " ".join(match.group(0).split()))
        for match in _COUNT.finditer(line):
            number = float(match.group(2).replace(",", "."))
            samples |= {int(number)} if 0 < number < _MOST_SAMPLES else set()
    quoted = next(iter(rates.values()), "").strip('"')
    return Facts(tuple(rates), quoted, samples.pop() if len(samples) == 1 else None, tuple(dict.fromkeys(notes)))


def _is_possible(rate: float) -> bool:
    return _SLOWEST <= rate <= _FASTEST


def _rate(match: re.Match[str]) -> tuple[float, str]:
    """Rate in Hz; a rate without a unit is one a second, which nobody writes otherwise."""
    number = float(match.group(2).replace(",", "."))
    unit = _unit(match)
    if unit == "":
        return number, f'"{" ".join(match.group(0).split())}" has no unit: taken as Hz.'
    return (number * units.to_si(unit, "Hz"), "") if unit and units.kind_of(unit) == "frequency" else (0.0, "")


def _step(match: re.Match[str]) -> float:
    """Rate in Hz from a step in time; 0 where its unit is not known."""
    number = float(match.group(2).replace(",", "."))
    unit = _unit(match)
    if not unit or number <= 0 or units.kind_of(unit) != "time":
        return 0.0
    return float(f"{1.0 / (number * units.to_si(unit, 's')):.12g}")


def _unit(match: re.Match[str]) -> str | None:
    """Unit after the number, or in brackets before it; empty where there is none, None where it is not known."""
    in_key, gap, after = match.group(1), match.group(3) or "", match.group(4)
    if after and units.expression(after) is not None:
        return after
    if after and not gap.strip():
        return None
    # A word in the next cell is another matter; a word in brackets may be a remark: "Interval (Time)".
    return in_key.strip() if in_key and units.expression(in_key.strip()) is not None else ""
