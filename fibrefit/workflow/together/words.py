"""The answer to the question of a series, in a sentence with numbers."""

from __future__ import annotations

from fibrefit.core.formatting import format_number, format_quantity, in_words
from fibrefit.series.speed_laws import BY_EFFECT, parameter_of, span
from fibrefit.series.speed_models import LawCurve, Verdict
from fibrefit.series.thresholds import PREFERRED
from fibrefit.workflow.thresholds import RECORDS_DIFFER


def answer_in_words(found: Verdict) -> str:
    """What a series says, with its numbers."""
    number = len(found.own.values)
    if found.answer == "speed_law":
        return _lawful(found, number)
    if found.answer == "per_record":
        return _of_each(found, number)
    return _constant(found, number)


def _lawful(found: Verdict, number: int) -> str:
    said = ", ".join(_change(found, one) for one in found.curves)
    forms = in_words(_form(found, one) for one in found.curves)
    gap = f"gap {found.gaps['speed_law']:.2f}, and {found.left_out['speed_law'].gap:.2f} where each is left out in turn"
    rest = _rest(found)
    alike = f" As good, and not distinguished: {_names(found.alike)}." if found.alike else ""
    return (
        f"One set of parameters does not serve all speeds: {said}; with {forms} one model serves all {number} records "
        f"({gap}; constant parameters: {found.gaps['constant']:.2f} and {found.left_out['constant'].gap:.2f}){rest}. "
        f"Logarithm of the Bayes factor: {found.logs['speed_law']:.3g}.{alike}"
    )


def _change(found: Verdict, one: LawCurve) -> str:
    first, last = one.values[0], one.values[-1]
    verb = "rises" if last > first else "falls"
    ends = f"between {one.speeds[0]:.2g} and {one.speeds[-1]:.2g} m/s"
    from_to = _from_to(float(first), float(last), found.units[one.law.parameter])
    return f"{one.law.parameter} {verb} {from_to} {ends}"


def _from_to(first: float, last: float, unit: str) -> str:
    """Two values, to as many digits as tell them from each other."""
    for digits in range(3, 10):
        ends = [format_quantity(value, unit, digits) for value in (first, last)]
        if ends[0] != ends[1]:
            break
    return f"from {ends[0]} to {ends[1]}"


def _form(found: Verdict, one: LawCurve) -> str:
    law, best = one.law, found.best
    name = f"{law.effect.name}.exponent"
    if law.form == "free curve":
        return f"a free curve of speed ({law.effect.name})"
    power = f"{format_number(best.shared[name], 2)} +/- {best.errors[name]:.1g}"
    added = "" if law.form == "power" else " added to a constant"
    return f"a power law of exponent {power}{added} ({law.effect.name})"


def _rest(found: Verdict) -> str:
    lawful = {one.law.parameter for one in found.curves}
    rest = [name for name in dict.fromkeys(law.parameter for law in BY_EFFECT.values()) if name not in lawful]
    rest = [name for name in rest if name in found.speeds]
    if not rest:
        return ""
    return f"; {in_words(rest)} {'needs' if len(rest) == 1 else 'need'} no law"


def _constant(found: Verdict, number: int) -> str:
    name = max(found.speeds, key=lambda key: span(found.speeds[key])[1])
    slow, fast = span(found.speeds[name])
    best = found.models.law
    tried = parameter_of(best.effects[0])
    gap = f"gap {found.gaps['constant']:.2f}, and {found.left_out['constant'].gap:.2f} where each is left out in turn"
    needs = f"it would need {PREFERRED:.0f}"
    if found.logs["speed_law"] > PREFERRED:
        gained = float(found.left_out["speed_law"].elpd.sum() - found.left_out["constant"].elpd.sum())
        needs = f"but it predicts records left out no better: their log density changes by {gained:.2g}"
    return (
        f"One set of parameters serves all {number} records, at speeds from {slow:.2g} to {fast:.2g} m/s ({gap}). "
        f"The best law of speed, of {tried} ({best.effects[0].name}), has a logarithm of the Bayes factor of "
        f"{found.logs['speed_law']:.2g}; {needs}.{_scatter(found)}"
    )


def _scatter(found: Verdict) -> str:
    said = [
        f"{100 * one.sd:.2g} % in {name}"
        for name, one in found.populations.items()
        if one.logarithmic and one.chance < RECORDS_DIFFER
    ]
    return f" Beyond their errors records differ by {in_words(said)}." if said else ""


def _of_each(found: Verdict, number: int) -> str:
    columns = zip(found.own.names, found.own.values.T.tolist(), strict=True)
    ranges = [f"{name} {_from_to(min(values), max(values), found.units[name])}" for name, values in columns]
    return (
        f"Neither one set of parameters nor a law of speed serves all {number} records: each has values of its own, "
        f"{', '.join(ranges)} (gap {found.gaps['per_record']:.2f}; constant: {found.gaps['constant']:.2f}, with "
        f"the best law: {found.gaps['speed_law']:.2f}). Logarithm of the Bayes factor over constant parameters: "
        f"{found.logs['per_record']:.3g}."
    )


def _names(effects: tuple[str, ...]) -> str:
    return in_words(f"{BY_EFFECT[name].form if name in BY_EFFECT else name} ({name})" for name in effects)
