"""What was found, in the words of the study: what it says and what the records say, and what happened when."""

from __future__ import annotations

from collections.abc import Iterator

import jax.numpy as jnp
import numpy as np

from fibrefit.core.units import format_quantity
from fibrefit.discovery.model.finding import Finding
from fibrefit.effects.law import Effect, StudyLaw
from fibrefit.effects.rig.inclination_error import InclinationError
from fibrefit.fitting.result import Estimate

CONDITIONS = {
    "weight_mass": ("a mass of the weight of", "kg"),
    "added_mass": ("an added mass of", "kg"),
    "inclination": ("an inclination of", "deg"),
    "lift": ("a lift of", "m"),
    "wrap_angle": ("a wrap angle of", "deg"),
    "gain": ("a gain of", "-"),
}
"""How a sentence names a condition, and the unit it is told in."""
PERCENT = 100.0


def told(finding: Finding) -> tuple[str, ...]:
    """Sentences on what was added that is a mistake of the study or belongs to one record.

    Parameters
    ----------
    finding : Finding
    """
    return tuple(sentence for effect in finding.added for sentence in _of(effect, finding))


def _of(effect: type[Effect], finding: Finding) -> Iterator[str]:
    estimates = {p.name: finding.after.parameters[f"{effect.name}.{p.name}"] for p in effect.parameters}
    if condition := _condition(effect):
        yield _stated(effect, condition, estimates, finding) + _or_else(effect, finding)
    elif issubclass(effect, StudyLaw) and effect.retimes:
        yield _clock(estimates, finding) + _or_else(effect, finding)
    elif effect.record is not None:
        yield _in_record(effect, estimates, finding) + _or_else(effect, finding)


def _condition(effect: type[Effect]) -> str:
    if issubclass(effect, InclinationError):
        return "inclination"
    return effect.condition if issubclass(effect, StudyLaw) else ""


def _stated(effect: type[Effect], condition: str, estimates: dict[str, Estimate], finding: Finding) -> str:
    """The study says 3.096 kg; the records say 3.19 +/- 0.01 kg."""
    (estimate,) = estimates.values()
    known = finding.after.problem.observations.experiment.conditions
    stated = np.unique(np.asarray(known[condition]))
    true = [_corrected(effect, condition, size, estimate.value) for size in stated]
    beyond = [_corrected(effect, condition, size, estimate.value + _error(estimate)) for size in stated]
    words, unit = CONDITIONS[condition]
    error = max(abs(b - a) for a, b in zip(true, beyond, strict=True))
    said = f"The study says {words} {_several(stated, unit)}; the records say {_several(true, unit, error)}"
    return said + (f", {'each ' if len(stated) > 1 else ''}+/- {_size(error, unit, 1)}." if error > 0.0 else ".")


def _corrected(effect: type[Effect], condition: str, stated: float, value: float) -> float:
    law = effect(jnp.asarray(value))
    assert hasattr(law, "correct"), "a law of the rig"
    return float(law.correct({condition: jnp.asarray(stated)})[condition])


def _clock(estimates: dict[str, Estimate], finding: Finding) -> str:
    (estimate,) = estimates.values()
    rates = sorted({round(1.0 / float(np.diff(np.asarray(times)).mean()), 3) for times in _times(finding)})
    true = [rate / (1.0 + estimate.value) for rate in rates]
    error = max(true) * _error(estimate) / (1.0 + estimate.value)
    said = f"The study says a sampling rate of {_several(rates, 'Hz')}; the records say {_several(true, 'Hz', error)}"
    more = f" +/- {_size(error, 'Hz', 1)}" if error > 0.0 else ""
    return f"{said}{more}: their clock is off."


def _times(finding: Finding) -> list[np.ndarray]:
    experiment = finding.after.problem.observations.experiment
    return [
        np.asarray(row)[: int(count)]
        for row, count in zip(np.asarray(experiment.times), np.asarray(experiment.count), strict=True)
    ]


def _in_record(effect: type[Effect], estimates: dict[str, Estimate], finding: Finding) -> str:
    """In which record, at what instant, and by how much."""
    place = (effect.record or 1) - 1
    names = finding.after.problem.layout.records
    record = names[place] if place < len(names) else f"record {place + 1}"
    where = f"From {record} on" if effect.family == "since" else f"In {record}"
    said = []
    for parameter in effect.parameters:
        if parameter.name in effect.strength:
            one = estimates[parameter.name]
            factor, unit = (PERCENT, "%") if parameter.unit == "-" else (1.0, parameter.unit)
            said.append(f"{parameter.doc} {_with_error(factor * one.value, factor * _error(one), unit)}")
    when = ""
    if effect.sudden:
        times = _times(finding)[place]
        span, one = float(times[-1] - times[0]), estimates["instant"]
        at = float(times[0]) + one.value * span
        when = f" at {_with_error(at, span * _error(one), 's')}"
    return f"{where}{when}: {', '.join(said)}."


def _with_error(value: float, error: float, unit: str) -> str:
    digits = 3 if error <= 0.0 else int(np.clip(np.ceil(np.log10(abs(value) / error)) + 1, 1, 6)) if value else 1
    if unit == "%":
        return f"{value:.{digits}g} +/- {error:.1g} %"
    shown = format_quantity(value, unit, digits)
    return f"{shown} +/- {format_quantity(error, unit, 1)}" if error > 0.0 else shown


def _error(estimate: Estimate) -> float:
    return float(estimate.std_error) if np.isfinite(estimate.std_error) else 0.0


def _several(values: object, unit: str, error: float = 0.0) -> str:
    sizes = [_size(value, unit, _digits(value, error)) for value in np.asarray(values, dtype=float)]
    return sizes[0] if len(sizes) == 1 else f"{', '.join(sizes[:-1])} and {sizes[-1]}"


def _digits(value: float, error: float) -> int:
    if error <= 0.0 or value == 0.0:
        return 4
    return int(np.clip(np.ceil(np.log10(abs(value) / error)) + 1, 3, 7))


def _size(value: float, unit: str, digits: int) -> str:
    if unit == "deg":
        return f"{np.degrees(value):.{digits}g} deg"
    return f"{value:.{digits}g}" if unit == "-" else format_quantity(float(value), unit, digits)


def _or_else(effect: type[Effect], finding: Finding) -> str:
    """What else would explain it."""
    others = [n for names in finding.cannot_tell_apart if effect.name in names for n in names if n != effect.name]
    return f" {' or '.join(dict.fromkeys(others))} would explain it as well." if others else ""
