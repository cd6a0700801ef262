"""Records that are planned, not measured: a task of their conditions and clock alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fibrefit.core.allowance import MOST_PLANNED, too_long
from fibrefit.core.errors import StudyError
from fibrefit.core.roles import ROLES, USUAL_NOISE
from fibrefit.problem.formulate.formulate import first_size, slots_of, stated_of
from fibrefit.problem.formulate.traces import conditions_of, in_order
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.observations import stack
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import FEWEST_READINGS
from fibrefit.rigs.excitation import Excitation
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.model import Model
from fibrefit.study import Study


def formulate_planned(study: Study, model: Model) -> Task:
    """Task of a study whose records are planned.

    Parameters
    ----------
    study : Study
        Each record with a name, a sampling rate and a duration; each base parameter with an initial value.

    Returns
    -------
    Task
        Nothing in it is measured: its channels are zero.

    Raises
    ------
    StudyError
        If there is no record, a parameter has no initial value, a record lacks a condition or an excitation, one is
        too short, or all together are too long.
    """
    study.refuse_without_records()
    rig = model.rig
    if rig.planned is None or rig.anchor is not None or rig.derived:
        measured = "records that were measured: only they tell how the motion begins"
        raise StudyError(
            str(study.source), f"planned records of a {study.kind}", measured, "Name a file for each record."
        )
    _check_lengths(study)
    traces = tuple(in_order([_trace(record, model) for record in study.records]))
    settings = study.settings({parameter.name: parameter for parameter in model.parameters})
    stated = [stated_of(record) for record in study.records]
    layout = Layout(slots_of(model, settings, stated, traces), tuple(trace.name for trace in traces))
    noise = {channel: _noise(study, channel, traces[0].rate) for channel in model.rig.channels}
    rms = {channel: [_level(study, channel)] * len(traces) for channel in model.rig.channels}
    whole = np.array([[[len(trace.times) for trace in traces]]], dtype=np.int32)
    return Task(
        problem=Problem(model, layout, stack(traces, rms)),
        traces=traces,
        start=layout.pack(_values(study, model, traces)),
        spread={},
        horizons=whole,
        noise=noise,
        input_noise={},
        noise_given=model.rig.channels,
        units={channel: ROLES[channel] for channel in model.rig.channels},
    )


def _check_lengths(study: Study) -> None:
    """Refuse records by what they declare: nothing is made of them before."""
    together = 0
    for record in study.records:
        together += (size := _size(record))
        if size < FEWEST_READINGS:
            do = "Give it a longer duration, or a larger sampling_rate."
            raise StudyError(record.label, f"a planned record of {size} samples", f"at least {FEWEST_READINGS}", do)
        if together > MOST_PLANNED:
            raise too_long(record.label, size, StudyError)


def _size(record: Any) -> int:
    return round(record.duration * record.sampling_rate) + 1


def _trace(record: Any, model: Model) -> Trace:
    times = np.arange(_size(record)) / record.sampling_rate
    conditions = conditions_of(record.label, model.rig, stated_of(record))
    for name, value in conditions.items():
        if np.isnan(value):
            raise StudyError(record.label, f"no {name}", "it for a planned record", f"Give {name} in the record.")
    inputs = {name: np.column_stack(_motion(record, times)) for name in model.rig.inputs if name == "drive"}
    return Trace(record.label, times, {name: np.zeros(len(times)) for name in model.rig.channels}, inputs, conditions)


def _motion(record: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if hasattr(record, "frequency"):
        return _harmonic(record, times)
    missing = [name for name in ("excitation", "amplitude", "rate") if getattr(record, name) is None]
    if missing:
        raise StudyError(
            record.label,
            f"no {' and no '.join(missing)}",
            "the movement of the drive of a planned record",
            'For example excitation = "trapezoid", amplitude = "60 mm", rate = "200 mm/s".',
        )
    hold = {} if record.hold is None else {"hold": record.hold}
    position, rate = Excitation(record.excitation, record.amplitude, record.rate, **hold).motion(times)
    if not np.ptp(position) > 0.0:
        raise StudyError(
            record.label,
            f"a drive that does not move within {record.duration:g} s",
            "at least one whole stroke of it",
            "Give it a longer duration, or a larger rate.",
        )
    return position, rate, position


def _harmonic(record: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    missing = [name for name in ("amplitude", "frequency") if getattr(record, name) is None]
    if missing:
        do = 'For example amplitude = "20 mm", frequency = "4 Hz".'
        raise StudyError(record.label, f"no {' and no '.join(missing)}", "the movement of the driven ends", do)
    omega = 2.0 * np.pi * record.frequency
    position = record.amplitude * np.sin(omega * times)
    return position, record.amplitude * omega * np.cos(omega * times), position


def _values(study: Study, model: Model, traces: tuple[Trace, ...]) -> Mapping[str, float | np.ndarray]:
    base = {parameter.name for parameter in model.rig.parameters}
    declared = {parameter.name: parameter for parameter in model.parameters}
    values: dict[str, float | np.ndarray] = {}
    for name, setting in study.settings(declared).items():
        if setting.initial is None and name in base:
            raise StudyError(
                f"{study.source}, parameters.{name}",
                "no initial",
                "a value: planned records have no data to find it from",
                f'For example [parameters.{name}] initial = "{declared[name].typical:g} {declared[name].unit}".',
            )
        values[name] = first_size(declared[name]) if setting.initial is None else setting.initial
    stated = [stated_of(record) for record in study.records]
    usual = [model.rig.planned(trace.conditions) if model.rig.planned else {} for trace in traces]
    for nuisance in model.rig.nuisances:
        said = [row.get(nuisance.name) for row in stated]
        default = [known.get(nuisance.name, 0.0) for known in usual]
        values[nuisance.name] = np.array([d if s is None else s for s, d in zip(said, default, strict=True)])
    return values


def _level(study: Study, channel: str) -> float:
    """Standard deviation of the noise of a channel, as stated or as usual."""
    said = getattr(study.noise, channel, None)
    return float(USUAL_NOISE[channel] if said is None else said)


def _noise(study: Study, channel: str, rate: float) -> Noise:
    return Noise(_level(study, channel) ** 2 / (0.5 * rate), 0.0, 0.0, 0)
