"""From a study, its records and a model to a task; of planned records from their conditions and clock alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fibrefit.core.declarations import FORCES, ROLES, USUAL_NOISE, Parameter
from fibrefit.core.errors import DataError, StudyError
from fibrefit.core.limits import MOST_PLANNED, too_long
from fibrefit.problem.diagnose.channels import are_exchanged, refuse_misread, refuse_turned, rules_out_a_factor
from fibrefit.problem.formulate.traces import ESTIMATED, Measured, conditions_of, in_order, trace_of
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
from fibrefit.rigs.rig import Starting
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.model import Model
from fibrefit.simulation.windows import WindowedModel
from fibrefit.study import ParameterSetting, Study

WINDOW = 0.1
"""Length in s of the windows of a motion that nothing brings back to its place, where the study states none."""
EXACT = Noise(0.0, 0.0, 0.0, 0)
EFFECT_SPREAD = 5.0
EXCHANGED = "force and position look exchanged, as the position is rougher than the force"
EXCHANGE_THEM = "Exchange the columns of force and position under [channels], or their headings."
CENTRED = 0.5
"""Relative standard deviation of a prior below which a search begins at its centre."""
FIRST_SIZE = 0.1
"""Share of its typical size at which an effect's parameter starts: large enough to have a slope in all of them."""


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
    stated = [stated_of(record) for record in study.records]
    traces = in_order([trace_of(record, model.rig, said) for record, said in zip(records, stated, strict=True)])
    model = _in_windows(model, study, traces)
    noise, stated_over_rest = _noise(study, traces, model.rig.channels)
    given = tuple(stated_over_rest)
    if model.rig.prepared is not None:
        traces = [model.rig.prepared(trace) for trace in traces]
    initial = {name: _begun(setting) for name, setting in settings.items()}
    try:
        refuse_turned(traces, model.rig)
        refuse_misread(traces, model.rig, [effect.name for effect in model.effects], _well_known(settings))
        starting = model.rig.starting(traces, stated, initial)
    except DataError as error:
        raise _with_exchange(error, traces) from None
    _refuse_unknown_scale(study, model, settings, traces)
    layout = Layout(slots_of(model, settings, stated, traces), tuple(trace.name for trace in traces))
    rms = {channel: _rms(study, noise, given, channel, traces) for channel in model.rig.channels}
    found = {channel: steps_of(traces, channel, rms[channel]) for channel in rms}
    return Task(
        problem=Problem(model, layout, stack(_completed(traces, starting), _by_reading(model, traces, rms, given))),
        traces=tuple(traces),
        start=_start(layout, declared, settings, starting),
        spread=_spread(declared, settings, starting),
        horizons=_horizons(traces, starting),
        noise=noise,
        input_noise=_input_noise(study, traces, model),
        noise_given=given,
        stated_over_rest=stated_over_rest,
        units={channel: ROLES[channel] for channel in model.rig.channels},
        steps={channel: known for channel, known in found.items() if known is not None},
    )


def _with_exchange(error: DataError, traces: Sequence[Trace]) -> DataError:
    """The error, with the likeliest reason where force and position stand in each other's place."""
    if not are_exchanged(traces):
        return error
    return DataError(error.where, f"{error.got}: {EXCHANGED}", error.expected, EXCHANGE_THEM)


def stated_of(record: object) -> dict[str, float]:
    """Numbers a study states of a record, in SI units."""
    return {name: value for name, value in dict(record).items() if isinstance(value, float | int)}  # type: ignore[call-overload]


def _in_windows(model: Model, study: Study, traces: Sequence[Trace]) -> Model:
    """The model as its rig wants it: in windows where a motion is begun anew again and again."""
    if model.rig.anchor is None:
        return model
    said = list(dict.fromkeys(record.window for record in study.records if record.window is not None))
    if len(said) > 1:
        raise StudyError(
            str(study.source),
            f"windows of {said[0]:g} s and {said[1]:g} s",
            "one length for all records",
            "State one of them.",
        )
    rate = traces[0].rate
    # All windows hold as many samples: of records at two rates, one cannot have those that are stated.
    for trace in traces:
        if said and abs(trace.rate / rate - 1.0) > SAME_RATE:
            raise StudyError(
                str(study.source),
                f"a window of {said[0]:g} s, and records at {rate:g} Hz and at {trace.rate:g} Hz",
                "one rate for all records",
                "State no window, or fit the records of each rate by themselves.",
            )
    asked = round((said[0] if said else WINDOW) / traces[0].step)
    window = max(asked, 16)
    if said and window != asked:
        raise StudyError(
            str(study.source),
            f"a window of {said[0]:g} s at {rate:g} Hz",
            f"{window} samples or more",
            f"State {window / rate:g} s or more, or leave it out.",
        )
    return WindowedModel(model.rig, model.effects, model.tension_law, window)


def _input_noise(study: Study, traces: Sequence[Trace], model: Model) -> dict[str, Noise]:
    """Noise of each input as it was measured."""
    inputs = model.rig.inputs
    if model.rig.anchor is not None or model.rig.derived:
        # What a motor's force is wrong by does not show at rest: the error bars see it in the residuals.
        return dict.fromkeys(inputs, EXACT)
    raw = [
        trace._replace(channels={**trace.channels, **{name: trace.inputs[name][:, 2] for name in inputs}})
        for trace in traces
    ]
    return _noise(study, raw, inputs, _of_input)[0]


def _of_input(traces: Sequence[Trace], name: str) -> Noise:
    """Noise of an input from that at rest; of one in coarse steps, which a rest says nothing of, from its course."""
    if (step := coarse_step(traces, name)) is not None:
        return noise_of_rounding(traces, name, step)
    return _of_channel(traces, name)


def _of_channel(traces: Sequence[Trace], channel: str) -> Noise:
    """Noise of a channel as the rests of the records show it."""
    return _in_motion(traces, channel, with_lines(estimate_noise(traces, channel), at_rest(traces, channel)))


def _noise(
    study: Study,
    traces: Sequence[Trace],
    channels: Sequence[str],
    shown: Callable[[Sequence[Trace], str], Noise] = _of_channel,
) -> tuple[dict[str, Noise], dict[str, float]]:
    """Noise of each channel as records show it, and the factor by which that was made as large as the study states."""
    noise, factors = {channel: shown(traces, channel) for channel in channels}, {}
    for channel in channels:
        if (said := getattr(study.noise, channel, None)) is not None:
            noise[channel], factors[channel] = _as_large_as(noise[channel], said, traces)
    return noise, factors


def _as_large_as(noise: Noise, said: float, traces: Sequence[Trace]) -> tuple[Noise, float]:
    """Noise of the same colour that has a stated rms over the longest record, and by which factor it is larger.

    A standard deviation says nothing of frequencies; what is silent has no colour, and is white.
    """
    rate = traces[0].rate
    rms = noise.rms(max(trace.duration for trace in traces), rate)
    if rms > 0.0:
        return noise.scaled(said / rms), said / rms
    return Noise(said**2 / (0.5 * rate), 0.0, 0.0, 0), 1.0


def _in_motion(traces: Sequence[Trace], channel: str, at_rest: Noise) -> Noise:
    """Noise of a channel from that at rest, which does not show what rounding adds to readings in coarse steps."""
    if (size := coarse_step(traces, channel)) is None:
        return at_rest
    white = noise_in_motion(traces, channel, size) ** 2 / (0.5 * traces[0].rate)
    return replace(at_rest, white=max(at_rest.white, white))


def _rms(
    study: Study, noise: Mapping[str, Noise], given: Sequence[str], channel: str, traces: Sequence[Trace]
) -> list[float]:
    """Standard deviation of the noise of a channel in each record: as stated, whatever the rate of the record."""
    if channel in given:
        return [float(getattr(study.noise, channel))] * len(traces)
    return [noise[channel].rms(trace.duration, trace.rate) for trace in traces]


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
                still = _at_rests(traces, louder)
                louder = [more / still for more in louder]
            found[channel] = [size * more for size, more in zip(found[channel], louder, strict=True)]
    return found


def _at_rests(traces: Sequence[Trace], louder: Sequence[np.ndarray]) -> float:
    """Root of the mean square of a factor over the readings of all rests; over all readings where there is none."""
    still = [more[rest] for trace, more in zip(traces, louder, strict=True) for rest in rests(trace)]
    return float(np.sqrt(np.mean(np.concatenate(still or list(louder)) ** 2)))


def _completed(traces: Sequence[Trace], starting: Starting) -> list[Trace]:
    """Traces with the conditions that had to be learnt."""
    done = []
    for r, trace in enumerate(traces):
        learnt = {name: float(starting.each[name][r]) for name in ESTIMATED if name in starting.each}
        done.append(trace._replace(conditions={**trace.conditions, **learnt}))
    return done


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
    slots = parameter_slots(model, settings)
    for nuisance in model.rig.nuisances:
        held = tuple(said.get(nuisance.name) for said in stated)
        slots.append(Slot(nuisance.name, nuisance.unit, Range.of(nuisance), False, held if any_held(held) else ()))
    for condition in model.rig.conditions:
        said = tuple(None if np.isnan(trace.conditions[condition.name]) else 0.0 for trace in traces)
        if condition.name in ESTIMATED and None in said:
            held = tuple(row.get(condition.name) for row in stated)
            slots.append(
                Slot(condition.name, condition.unit, Range.of(condition), False, held if any_held(held) else ())
            )
    return tuple(slots)


def parameter_slots(model: Model, settings: Mapping[str, ParameterSetting]) -> list[Slot]:
    """Slots of a model's parameters; one that an effect stands for is held at zero where the study does not state it.

    Parameters
    ----------
    settings : mapping of str to ParameterSetting
        What the study says of each.
    """
    spoken_for = {name for effect in model.effects for name in effect.stands_for}
    return [_slot(parameter, settings[parameter.name], parameter.name in spoken_for) for parameter in model.parameters]


def any_held(values: Sequence[float | None]) -> bool:
    """Whether any value is given."""
    return any(value is not None for value in values)


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


def _well_known(settings: Mapping[str, ParameterSetting]) -> set[str]:
    """Parameters of which it is believed beforehand that no scale of the records is off by a factor because of them."""
    beliefs = {name: Belief.of(setting) for name, setting in settings.items()}
    return {name for name, belief in beliefs.items() if belief is not None and rules_out_a_factor(belief.relative)}


def _begun(setting: ParameterSetting) -> float | None:
    """Value that a search begins with: the one stated, or the centre of what is believed."""
    belief = Belief.of(setting)
    inside = belief is not None and belief.relative < CENTRED
    return belief.centre if setting.initial is None and inside and belief is not None else setting.initial


def _slot(parameter: Parameter, setting: ParameterSetting, spoken_for: bool = False) -> Slot:
    """Slot of a parameter, which an effect may stand for."""
    limits = Range.of(parameter).within(setting.lower, setting.upper)
    fixed: tuple[float | None, ...] = (setting.initial,) if setting.fixed else ()
    if spoken_for and setting.initial is None:
        fixed = (0.0,)
    return Slot(parameter.name, parameter.unit, limits, setting.shared, fixed, Belief.of(setting))


def _start(
    layout: Layout,
    declared: Mapping[str, Parameter],
    settings: Mapping[str, ParameterSetting],
    starting: Starting,
) -> np.ndarray:
    named: dict[str, float | np.ndarray] = {**starting.each}
    for name, parameter in declared.items():
        given = _begun(settings[name])
        named[name] = starting.shared.get(name, first_size(parameter)) if given is None else given
    return layout.pack(named)


def first_size(parameter: Parameter) -> float:
    """Where an effect's parameter starts, in its unit."""
    if parameter.log or parameter.reciprocal:
        return parameter.typical
    return parameter.null + FIRST_SIZE * (parameter.typical - parameter.null)


def _spread(
    declared: Mapping[str, Parameter], settings: Mapping[str, ParameterSetting], starting: Starting
) -> dict[str, float]:
    found = {name: starting.spread.get(name, EFFECT_SPREAD) for name in declared if not settings[name].fixed}
    beliefs = {name: Belief.of(settings[name]) for name in found}
    return found | {name: min(found[name], 1.0 + 2.0 * b.relative) for name, b in beliefs.items() if b is not None}


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
    stated = [stated_of(record) for record in study.records]
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
    conditions = conditions_of(record.label, model.rig, stated_of(record))
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
    stated = [stated_of(record) for record in study.records]
    usual = [model.rig.planned(trace.conditions) if model.rig.planned else {} for trace in traces]
    for nuisance in model.rig.nuisances:
        said = [row.get(nuisance.name) for row in stated]
        default = [known.get(nuisance.name, 0.0) for known in usual]
        values[nuisance.name] = np.array([d if s is None else s for s, d in zip(said, default, strict=True)])
    return values
