"""What was found, in the words of the study: what it says and what the records say, and what happened when."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import jax.numpy as jnp
import numpy as np

from fibrefit.core.formatting import in_words, shown_unit
from fibrefit.discovery.model.finding import Finding
from fibrefit.laws.families import instants_of
from fibrefit.laws.law import Effect, StudyLaw
from fibrefit.laws.study import InclinationError, OtherFibre
from fibrefit.study.summaries.results import ParameterSummary

CONDITIONS = {
    "weight_mass": ("a mass of the weight of", "kg"),
    "added_mass": ("an added mass of", "kg"),
    "inclination": ("an inclination of", "deg"),
    "lift": ("a lift of", "m"),
    "wrap_angle": ("a wrap angle of", "deg"),
    "gain": ("a gain of", "-"),
}
"""How a sentence names a condition, and its unit."""
PERCENT = 100.0


def statements_of(finding: Finding) -> tuple[str, ...]:
    """Sentences on what was added that is a mistake of the study or belongs to one record."""
    return tuple(sentence for effect in finding.added for sentence in _of(effect, finding))


def _of(effect: type[Effect], finding: Finding) -> Iterator[str]:
    estimates = {p.name: finding.after.parameters[f"{effect.name}.{p.name}"] for p in effect.parameters}
    if condition := _condition(effect):
        yield _stated(effect, condition, estimates, finding) + _or_else(effect, finding)
    elif issubclass(effect, StudyLaw) and effect.retimes:
        yield _clock(estimates, finding) + _or_else(effect, finding)
    elif effect.records:
        yield _in_records(effect, estimates, finding) + _or_else(effect, finding)
    elif effect.recurs:
        yield _in_each(effect, estimates, finding) + _or_else(effect, finding)


def _condition(effect: type[Effect]) -> str:
    if issubclass(effect, InclinationError):
        return "inclination"
    return effect.condition if issubclass(effect, StudyLaw) else ""


def _stated(effect: type[Effect], condition: str, estimates: dict[str, ParameterSummary], finding: Finding) -> str:
    """The study says 3.096 kg; the records say 3.19 +/- 0.01 kg."""
    (estimate,) = estimates.values()
    known = finding.after.problem.observations.experiment.conditions
    stated = np.unique(np.asarray(known[condition]))
    true = [_corrected(effect, condition, size, estimate.value) for size in stated]
    beyond = [_corrected(effect, condition, size, estimate.value + _error(estimate)) for size in stated]
    words, unit = CONDITIONS[condition]
    error = max(abs(b - a) for a, b in zip(true, beyond, strict=True))
    return f"The study says {words} {_several(stated, unit)}; the records say {_several(true, unit, error)}."


def _corrected(effect: type[Effect], condition: str, stated: float, value: float) -> float:
    law = effect(jnp.asarray(value))
    assert hasattr(law, "correct"), "a law of the rig"
    return float(law.correct({condition: jnp.asarray(stated)})[condition])


def _clock(estimates: dict[str, ParameterSummary], finding: Finding) -> str:
    (estimate,) = estimates.values()
    rates = sorted({round(1.0 / float(np.diff(np.asarray(times)).mean()), 3) for times in _times(finding)})
    true = [rate / (1.0 + estimate.value) for rate in rates]
    error = max(true) * _error(estimate) / (1.0 + estimate.value)
    said = f"The study says a sampling rate of {_several(rates, 'Hz')}; the records say {_several(true, 'Hz', error)}"
    return f"{said}: their clock is off."


def _times(finding: Finding) -> list[np.ndarray]:
    experiment = finding.after.problem.observations.experiment
    return [
        np.asarray(row)[: int(count)]
        for row, count in zip(np.asarray(experiment.times), np.asarray(experiment.count), strict=True)
    ]


def _in_records(effect: type[Effect], estimates: dict[str, ParameterSummary], finding: Finding) -> str:
    """In which records, at what instant, and by how much."""
    names = dict(enumerate(finding.after.problem.layout.records, start=1))
    these = in_words([names.get(place, f"record {place}") for place in effect.records])
    if issubclass(effect, OtherFibre):
        taken = "was" if len(effect.records) == 1 else "were"
        return f"{these} {taken} taken with another fibre: {_compared(effect, estimates)}."
    where = f"From {these} on" if effect.family == "since" else f"In {these}"
    when = f" at {_instant(estimates['instant'], _times(finding)[effect.records[0] - 1])}" if effect.sudden else ""
    return f"{where}{when}: {_strengths(effect, estimates)}."


def _compared(effect: type[Effect], estimates: dict[str, ParameterSummary]) -> str:
    """What is larger or smaller than in the other records, and by how much."""
    said = []
    for parameter in effect.parameters:
        one, what = estimates[parameter.name], parameter.name.removesuffix("_change")
        size = _several([PERCENT * abs(one.value)], "%", PERCENT * _error(one))
        said.append(f"{what} {size} {'larger' if one.value > 0.0 else 'smaller'}")
    return ", ".join(said)


def _in_each(effect: type[Effect], estimates: dict[str, ParameterSummary], finding: Finding) -> str:
    """By how much in each record, and when."""
    names, times = finding.after.problem.layout.records, _times(finding)
    when = [
        f"{_instant(estimates[instant], times[r])} in {names[r]}"
        for r, instant in enumerate(instants_of(effect)[: len(names)])
    ]
    return f"Once in each record, {_strengths(effect, estimates)}: at {', '.join(when)}."


def _strengths(effect: type[Effect], estimates: dict[str, ParameterSummary]) -> str:
    """What is changed, and by how much."""
    said = []
    for parameter in effect.parameters:
        if parameter.name in effect.strength:
            one = estimates[parameter.name]
            factor, unit = (PERCENT, "%") if parameter.unit == "-" else (1.0, parameter.unit)
            said.append(f"{parameter.doc} {_several([factor * one.value], unit, factor * _error(one))}")
    return ", ".join(said)


def _instant(share: ParameterSummary, times: np.ndarray) -> str:
    """When something happens in a record: ``1.31 +/- 0.02 s``."""
    span, error = float(times[-1] - times[0]), _error(share)
    # Slopes say nothing of an instant at which no reading moves: an error as long as the record is none.
    return _several([float(times[0]) + share.value * span], "s", span * error if error < 1.0 else 0.0)


def _error(estimate: ParameterSummary) -> float:
    return estimate.std_error or 0.0


def _several(values: Sequence[float] | np.ndarray, unit: str, error: float = 0.0) -> str:
    """Values in one unit, with their error where there is one: ``3.158 +/- 0.0003 kg``."""
    sizes = np.asarray(values, dtype=float)
    name, worth = ("deg", np.pi / 180.0) if unit == "deg" else shown_unit(float(np.abs(sizes).max()), unit)
    if error > 0.0:
        decimals = max(0, -int(np.floor(np.log10(error / worth))))
        each = [f"{size / worth:.{decimals}f}" for size in sizes]
    else:
        each = [f"{size / worth:.6g}" for size in sizes]
    said = in_words(each)
    if error > 0.0:
        said += f" +/- {error / worth:.1g}" if len(each) == 1 else f" (each +/- {error / worth:.1g})"
    return said if name == "-" else f"{said} {name}"


def _or_else(effect: type[Effect], finding: Finding) -> str:
    """What else would explain it."""
    names = [name for group in finding.cannot_tell_apart if effect.name in group for name in group]
    others = [name for name in names if name not in (effect.name, InclinationError.name)]
    return f" {' or '.join(dict.fromkeys(others))} would explain it as well." if others else ""
