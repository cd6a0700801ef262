"""From a study, its records and a model to a task: traces, noise, free numbers, starting values.

Of planned records from their conditions and clock alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from fibrefit.core.declarations import FORCES, ROLES, USUAL_NOISE, Parameter
from fibrefit.core.errors import DataError, StudyError
from fibrefit.core.limits import MOST_PLANNED, too_far_apart, too_long
from fibrefit.problem.diagnose.channels import (
    force_and_position_exchanged,
    refuse_contradictory,
    rules_out_a_factor,
)
from fibrefit.problem.inputs.smoothing import smoothed
from fibrefit.problem.noise.readings import (
    at_rest,
    coarse_step,
    estimate_noise,
    growth_with_load,
    largest_load,
    louder_under_load,
    noise_in_motion,
)
from fibrefit.problem.noise.rounding import noise_of_rounding, steps_of
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import with_lines
from fibrefit.problem.statement.layout import Belief, Layout, Range, Slot
from fibrefit.problem.statement.observations import stack
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import FEWEST_READINGS
from fibrefit.records.thresholds import SAME_RATE
from fibrefit.rigs.excitation import Excitation
from fibrefit.rigs.rig import Rig, Starting
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.model import ORDER, Model
from fibrefit.simulation.windows import WindowedModel
from fibrefit.study import ParameterSetting, Study

ESTIMATED = ("lift",)
"""Conditions that the data can tell where a study is silent."""
WINDOW = 0.1
"""Length in s of the windows of a motion that nothing brings back to its place, where the study states none."""
EXCHANGED = "force and position look exchanged, as the position is rougher than the force"
EXCHANGE_THEM = "Exchange the columns of force and position under [channels], or their headings."


def formulate(study: Study, records: Sequence[Measured], model: Model) -> Task:
    """Task of a study.

    Parameters
    ----------
    records : sequence of Measured
        The study's records as read, in its order.

    Raises
    ------
    StudyError
        If the study names a parameter the model does not have or a value that it cannot have, lacks a condition, lists
        no record, or holds no scale, such as a mass, where records do not tell it.
    DataError
        If a record lacks a channel or part of an input, is too short, does not show what the rig's starting values are
        taken from, has a channel of the wrong sign, or moves by another factor than force and mass ask for.
    """
    study.refuse_without_records()
    declared = {parameter.name: parameter for parameter in model.parameters}
    settings = study.settings(declared)
    stated = [stated_numbers(record) for record in study.records]
    traces = in_order([trace_of(record, model.rig, said) for record, said in zip(records, stated, strict=True)])
    model = _in_windows(model, study, traces)
    noise, stated_over_rest = _noise(study, traces, model.rig.channels)
    given = tuple(stated_over_rest)
    if model.rig.prepared is not None:
        traces = [model.rig.prepared(trace) for trace in traces]
    beliefs = {name: belief for name, setting in settings.items() if (belief := Belief.of(setting)) is not None}
    # A search begins with the value that is stated, or with the centre of what is believed where zero is more than two
    # standard deviations away from that.
    initial = {name: setting.initial for name, setting in settings.items()}
    for name, belief in beliefs.items():
        if initial[name] is None and belief.relative < 0.5:
            initial[name] = belief.centre
    # Parameters that are known too well for a scale of the records to be off by a factor because of them.
    known = {name for name, belief in beliefs.items() if rules_out_a_factor(belief.relative)}
    try:
        refuse_contradictory(traces, model.rig, [effect.name for effect in model.effects], known)
        starting = model.rig.starting(traces, stated, initial)
    except DataError as error:
        raise _with_exchange(error, traces) from None
    _refuse_unknown_scale(study, model, settings, traces)
    layout = Layout(slots_of(model, settings, stated, traces), tuple(trace.name for trace in traces))
    rms = {channel: [noise[channel].rms(one.duration, one.rate) for one in traces] for channel in model.rig.channels}
    # What is stated holds whatever the rate of a record.
    rms |= {channel: [float(getattr(study.noise, channel))] * len(traces) for channel in given}
    learnt = [
        {name: float(starting.each[name][r]) for name in ESTIMATED if name in starting.each} for r in range(len(traces))
    ]
    completed = [
        trace._replace(conditions={**trace.conditions, **own}) for trace, own in zip(traces, learnt, strict=True)
    ]
    start: dict[str, Any] = {**starting.each}
    for name, parameter in declared.items():
        given_value = initial[name]
        start[name] = starting.shared.get(name, first_size(parameter)) if given_value is None else given_value
    # An effect is looked for within a factor of five of where it starts.
    spread = {name: starting.spread.get(name, 5.0) for name in declared if not settings[name].fixed}
    spread |= {name: min(spread[name], 1.0 + 2.0 * one.relative) for name, one in beliefs.items() if name in spread}
    inputs = dict.fromkeys(model.rig.inputs, Noise(0.0, 0.0, 0.0, 0))
    # What a motor's force is wrong by does not show at rest: the error bars see it in the residuals.
    if model.rig.anchor is None and not model.rig.derived:
        measured = [
            trace._replace(channels={**trace.channels, **{name: trace.inputs[name][:, 2] for name in inputs}})
            for trace in traces
        ]
        inputs = _noise(study, measured, model.rig.inputs, inputs=True)[0]
    steps = {channel: steps_of(traces, channel, rms[channel]) for channel in rms}
    return Task(
        problem=Problem(model, layout, stack(completed, _by_reading(model, traces, rms, given))),
        traces=tuple(traces),
        start=layout.pack(start),
        spread=spread,
        horizons=_horizons(traces, starting),
        noise=noise,
        input_noise=inputs,
        noise_given=given,
        stated_over_rest=stated_over_rest,
        units={channel: ROLES[channel] for channel in model.rig.channels},
        steps={channel: known for channel, known in steps.items() if known is not None},
    )


def _horizons(traces: Sequence[Trace], starting: Starting) -> np.ndarray:
    """Samples of each record at each stage of each way to lengthen the horizon."""
    span = starting.settled - starting.moving
    ends = [[starting.moving + factor * span for factor in way] for way in starting.horizons]
    places = [
        [[int(np.searchsorted(trace.times, end[r])) for r, trace in enumerate(traces)] for end in way]
        + [[len(trace.times) for trace in traces]]
        for way in ends
    ]
    return np.array(places, dtype=np.int32)


def _with_exchange(error: DataError, traces: Sequence[Trace]) -> DataError:
    """The error, with the likeliest reason where force and position stand in each other's place."""
    if not force_and_position_exchanged(traces):
        return error
    return DataError(error.where, f"{error.got}: {EXCHANGED}", error.expected, EXCHANGE_THEM)


def stated_numbers(record: object) -> dict[str, float]:
    """Numbers a study states of a record, in SI units."""
    return {name: value for name, value in dict(record).items() if isinstance(value, float | int)}  # type: ignore[call-overload]


def _in_windows(model: Model, study: Study, traces: Sequence[Trace]) -> Model:
    """The model as its rig wants it: in windows where a motion is begun anew again and again."""
    if model.rig.anchor is None:
        return model
    where, rate = str(study.source), traces[0].rate
    said = list(dict.fromkeys(record.window for record in study.records if record.window is not None))
    if len(said) > 1:
        expected, do = "one length for all records", "State one of them."
        raise StudyError(where, f"windows of {said[0]:g} s and {said[1]:g} s", expected, do)
    # All windows hold as many samples: of records at two rates, one cannot have those that are stated.
    for trace in traces:
        if said and abs(trace.rate / rate - 1.0) > SAME_RATE:
            raise StudyError(
                where,
                f"a window of {said[0]:g} s, and records at {rate:g} Hz and at {trace.rate:g} Hz",
                "one rate for all records",
                "State no window, or fit the records of each rate by themselves.",
            )
    asked = round((said[0] if said else WINDOW) / traces[0].step)
    window = max(asked, FEWEST_READINGS)
    if said and window != asked:
        raise StudyError(
            where,
            f"a window of {said[0]:g} s at {rate:g} Hz",
            f"{window} samples or more",
            f"State {window / rate:g} s or more, or leave it out.",
        )
    return WindowedModel(model.rig, model.effects, model.tension_law, window)


def _noise(
    study: Study, traces: Sequence[Trace], channels: Sequence[str], inputs: bool = False
) -> tuple[dict[str, Noise], dict[str, float]]:
    """Noise of each channel as records show it, and the factor by which that was made as large as the study states."""
    noise, factors, rate = dict[str, Noise](), dict[str, float](), traces[0].rate
    for channel in channels:
        size = coarse_step(traces, channel)
        if inputs and size is not None:
            # Of an input in coarse steps a rest says nothing; its course does.
            noise[channel] = noise_of_rounding(traces, channel, size)
        else:
            still = with_lines(estimate_noise(traces, channel), at_rest(traces, channel))
            if size is not None:
                # A rest does not show what rounding adds to readings in coarse steps.
                white = noise_in_motion(traces, channel, size) ** 2 / (0.5 * rate)
                still = replace(still, white=max(still.white, white))
            noise[channel] = still
    for channel in channels:
        if (said := getattr(study.noise, channel, None)) is not None:
            # A standard deviation says nothing of frequencies: the stated one is that over the longest record.
            rms = noise[channel].rms(max(trace.duration for trace in traces), rate)
            factors[channel] = said / rms if rms > 0.0 else 1.0
            # What is silent has no colour, and is white.
            white_noise = Noise(said**2 / (0.5 * rate), 0.0, 0.0, 0)
            noise[channel] = noise[channel].scaled(said / rms) if rms > 0.0 else white_noise
    return noise, factors


def _by_reading(
    model: Model, traces: Sequence[Trace], rms: Mapping[str, Sequence[float]], given: Sequence[str]
) -> dict[str, list[np.ndarray]]:
    """Noise of each reading in SI units, ``(n_time,)`` for each record: that of a force may grow with the load.

    What is stated is what a force without load has; what rests show, where a weight may hang, has grown with theirs.
    """
    found = {
        channel: [np.full(len(t.times), size) for t, size in zip(traces, rms[channel], strict=True)] for channel in rms
    }
    # A motor's force is what its motion asks for, and what that leaves out is louder under load too.
    free = () if model.rig.anchor is not None or model.rig.derived else set(FORCES) & set(rms)
    for channel in free:
        if growth := growth_with_load(traces, channel):
            largest = largest_load(traces, channel)
            louder = [louder_under_load(trace, channel, growth, largest) for trace in traces]
            if channel not in given:
                # Over the readings of all rests; over all readings where there is none.
                still = [more[rest] for trace, more in zip(traces, louder, strict=True) for rest in rests(trace)]
                at_rests = float(np.sqrt(np.mean(np.concatenate(still or list(louder)) ** 2)))
                louder = [more / at_rests for more in louder]
            found[channel] = [size * more for size, more in zip(found[channel], louder, strict=True)]
    return found


def slots_of(
    model: Model,
    settings: Mapping[str, ParameterSetting],
    stated: Sequence[Mapping[str, float | None]],
    traces: Sequence[Trace],
) -> tuple[Slot, ...]:
    """Slots of a model's parameters, of the rig's nuisances, and of conditions that not every record states.

    Parameters
    ----------
    settings : mapping of str to ParameterSetting
        What the study says of each parameter.
    stated : sequence of mapping of str to float
        What it says of each record, in SI units.
    """
    unknown = [
        condition
        for condition in model.rig.conditions
        if condition.name in ESTIMATED and any(np.isnan(trace.conditions[condition.name]) for trace in traces)
    ]
    slots = parameter_slots(model, settings)
    for each in (*model.rig.nuisances, *unknown):
        fixed = tuple(said.get(each.name) for said in stated)
        known = any(value is not None for value in fixed)
        slots.append(Slot(each.name, each.unit, Range.of(each), False, fixed if known else ()))
    return tuple(slots)


def parameter_slots(model: Model, settings: Mapping[str, ParameterSetting]) -> list[Slot]:
    """Slots of a model's parameters; one that an effect stands for is fixed at zero where the study does not state it.

    Parameters
    ----------
    settings : mapping of str to ParameterSetting
        What the study says of each.
    """
    stood_for = {name for effect in model.effects for name in effect.stands_for}
    slots = []
    for parameter in model.parameters:
        setting = settings[parameter.name]
        fixed: tuple[float | None, ...] = (setting.initial,) if setting.fixed else ()
        if parameter.name in stood_for and setting.initial is None:
            fixed = (0.0,)
        limits = Range.of(parameter).within(setting.lower, setting.upper)
        slots.append(Slot(parameter.name, parameter.unit, limits, setting.shared, fixed, Belief.of(setting)))
    return slots


def _refuse_unknown_scale(
    study: Study, model: Model, settings: Mapping[str, ParameterSetting], traces: Sequence[Trace]
) -> None:
    """Refuse a free decay without a known mass, or what a rig has in its place: it tells values per unit of it only."""
    if not (name := model.rig.per_unit_of) or settings[name].fixed or Belief.of(settings[name]):
        return
    if len({trace.conditions.get(f"added_{name}", 0.0) for trace in traces}) == 1:
        (declared,) = (parameter for parameter in model.rig.parameters if parameter.name == name)
        do = f'State it: [parameters.{name}] fixed = "2.1 {declared.unit}" ("1 {declared.unit}": values per'
        do += f' {declared.unit}), or prior = "2.1 +/- 0.1 {declared.unit}". Or add a known {name}.'
        raise StudyError(str(study.source), f"a free decay, and a {name} that is not held", f"the {declared.doc}", do)


def first_size(parameter: Parameter) -> float:
    """Where an effect's parameter starts, in its unit."""
    if parameter.log or parameter.reciprocal:
        return parameter.typical
    # A tenth of its typical size is large enough to have a slope in all of them.
    return parameter.null + 0.1 * (parameter.typical - parameter.null)


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
    # Records are refused by what they declare: nothing is made of them before.
    together = 0
    for record in study.records:
        together += (size := _planned_samples(record))
        if size < FEWEST_READINGS:
            do = "Give it a longer duration, or a larger sampling_rate."
            raise StudyError(record.label, f"a planned record of {size} samples", f"at least {FEWEST_READINGS}", do)
        if together > MOST_PLANNED:
            raise too_long(record.label, size, StudyError)
    traces = tuple(in_order([_planned_trace(record, model) for record in study.records]))
    settings = study.settings({parameter.name: parameter for parameter in model.parameters})
    stated = [stated_numbers(record) for record in study.records]
    layout = Layout(slots_of(model, settings, stated, traces), tuple(trace.name for trace in traces))
    said = {channel: getattr(study.noise, channel, None) for channel in rig.channels}
    rms = {channel: float(USUAL_NOISE[channel] if sd is None else sd) for channel, sd in said.items()}
    return Task(
        problem=Problem(model, layout, stack(traces, {channel: [sd] * len(traces) for channel, sd in rms.items()})),
        traces=traces,
        start=layout.pack(_planned_values(study, model, traces)),
        spread={},
        horizons=np.array([[[len(trace.times) for trace in traces]]], dtype=np.int32),
        noise={channel: Noise(sd**2 / (0.5 * traces[0].rate), 0.0, 0.0, 0) for channel, sd in rms.items()},
        input_noise={},
        noise_given=rig.channels,
        units={channel: ROLES[channel] for channel in rig.channels},
    )


def _planned_samples(record: Any) -> int:
    return round(record.duration * record.sampling_rate) + 1


def _planned_trace(record: Any, model: Model) -> Trace:
    times = np.arange(_planned_samples(record)) / record.sampling_rate
    conditions = conditions_of(record.label, model.rig, stated_numbers(record))
    for name, value in conditions.items():
        if np.isnan(value):
            raise StudyError(record.label, f"no {name}", "it for a planned record", f"Give {name} in the record.")
    inputs = {name: np.column_stack(_planned_drive(record, times)) for name in model.rig.inputs if name == "drive"}
    return Trace(record.label, times, {name: np.zeros(len(times)) for name in model.rig.channels}, inputs, conditions)


def _planned_drive(record: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, rate and reading of a drive that is harmonic, or follows an excitation."""
    harmonic = hasattr(record, "frequency")
    needed = ("amplitude", "frequency") if harmonic else ("excitation", "amplitude", "rate")
    if missing := [name for name in needed if getattr(record, name) is None]:
        of = "the driven ends" if harmonic else "the drive of a planned record"
        example = 'amplitude = "20 mm", frequency = "4 Hz"'
        example = example if harmonic else 'excitation = "trapezoid", amplitude = "60 mm", rate = "200 mm/s"'
        got = f"no {' and no '.join(missing)}"
        raise StudyError(record.label, got, f"the movement of {of}", f"For example {example}.")
    if harmonic:
        omega = 2.0 * np.pi * record.frequency
        position = record.amplitude * np.sin(omega * times)
        return position, record.amplitude * omega * np.cos(omega * times), position
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


def _planned_values(study: Study, model: Model, traces: tuple[Trace, ...]) -> Mapping[str, float | np.ndarray]:
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
    stated = [stated_numbers(record) for record in study.records]
    usual = [model.rig.planned(trace.conditions) if model.rig.planned else {} for trace in traces]
    for nuisance in model.rig.nuisances:
        said = [row.get(nuisance.name) for row in stated]
        default = [known.get(nuisance.name, 0.0) for known in usual]
        values[nuisance.name] = np.array([d if s is None else s for s, d in zip(said, default, strict=True)])
    return values


class Measured(Protocol):
    """What a trace needs of a record that was read."""

    @property
    def name(self) -> str:
        """In results and messages."""

    @property
    def time(self) -> np.ndarray:
        """Instants ``(n_time,)``, in s."""

    @property
    def channels(self) -> Mapping[str, np.ndarray]:
        """Measured values ``(n_time,)`` in SI units, by role; NaN where a sample is damaged."""

    @property
    def rate(self) -> float:
        """Samples a second, in Hz."""

    @property
    def uniform(self) -> bool:
        """Whether all steps in time are equal, gaps aside."""


def trace_of(record: Measured, rig: Rig, stated: Mapping[str, float | None]) -> Trace:
    """Trace of one record.

    Parameters
    ----------
    record : Measured
        Channels in SI units, NaN where a sample is damaged.
    stated : mapping of str to float or None
        What the study says of the record, in SI units.

    Raises
    ------
    StudyError
        If a condition the rig needs is missing.
    DataError
        If a channel the rig needs is missing, or an input has holes.
    """
    conditions = conditions_of(record.name, rig, stated)
    for name in rig.measured:
        if name not in record.channels:
            do = f'Name its column: [channels] {name} = "..."; fibrefit inspect tells what was left out, and why.'
            # Where a channel was not measured at all, the rig may know of such records.
            fitting = [
                variant.channels
                for variant in rig.variants.values()
                if variant.inputs == rig.inputs
                and name not in variant.measured
                and set(variant.measured) <= set(record.channels)
            ]
            if fitting and name in rig.channels:
                do += f' Where it was not measured: measured = "{" and ".join(fitting[0])}" under [rig].'
            raise DataError(record.name, f"no {name} channel", f"one, for a {rig.kind} rig", do)
        valid = int(np.count_nonzero(np.isfinite(record.channels[name])))
        if valid < FEWEST_READINGS:
            raise DataError(
                f'{record.name}, channel "{name}"',
                f"{valid} valid samples",
                f"at least {FEWEST_READINGS}",
                "Check its column and unit; fibrefit inspect tells what was masked, and why.",
            )
    times = np.asarray(record.time, dtype=float)
    place = np.arange(len(times))
    if record.uniform:
        # Instants of an unbroken grid: what is missing in it is left out, not bridged.
        place = np.round((times - times[0]) * record.rate).astype(int)
        if place[-1] >= max(MOST_PLANNED, 2 * len(times)):
            longest = int(np.argmax(np.diff(place)))
            raise too_far_apart(record.name, int(place[-1]) + 1, float(np.diff(times)[longest]), float(times[longest]))
        times = times[0] + np.arange(place[-1] + 1) / record.rate
    spread = {name: np.full(len(times), np.nan) for name in rig.measured}
    for name, values in spread.items():
        values[place] = record.channels[name]
    read = {name: name for name in rig.inputs if name not in rig.derived} | (
        {} if rig.anchor is None else {"anchor": rig.anchor}
    )
    inputs = {
        name: np.column_stack([smoothed(spread[role], times, f'{record.name}, channel "{role}"'), spread[role]])
        for name, role in read.items()
    }
    return Trace(record.name, times, {name: spread[name] for name in rig.channels}, inputs, conditions)


def conditions_of(name: str, rig: Rig, stated: Mapping[str, float | None]) -> dict[str, float]:
    """Conditions of a record, in SI units; NaN for one that the data must tell.

    Raises
    ------
    StudyError
        If one that must be known is missing.
    """
    conditions = {}
    for condition in rig.conditions:
        value = stated.get(condition.name)
        value = condition.typical if value is None else value
        if math.isnan(value) and condition.name not in ESTIMATED:
            raise StudyError(
                name,
                f"no {condition.name}",
                f"{condition.doc}, in {condition.unit}",
                f"Give it in the record, under [rig], or with --set rig.{condition.name}=...",
            )
        conditions[condition.name] = float(value)
    return conditions


def in_order(traces: Sequence[Trace]) -> list[Trace]:
    """Traces that know their place in the series, from 1: some laws change from record to record."""
    return [trace._replace(conditions={**trace.conditions, ORDER: float(i)}) for i, trace in enumerate(traces, 1)]
