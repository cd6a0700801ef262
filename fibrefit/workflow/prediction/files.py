"""A prediction as the files of a result: the summary and the groups of ``result.h5``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core.declarations import ROLES
from fibrefit.core.formatting import format_quantity, in_words
from fibrefit.problem import ForceBalance
from fibrefit.records import Record
from fibrefit.report.sentences.prediction import OF_PREDICTION, prediction_check_summaries, prediction_sentence
from fibrefit.report.text import explained_told
from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.part import Z_95, Variable
from fibrefit.study.summaries.results import (
    InputErrorSummary,
    ParameterSummary,
    PredictedChannel,
    PredictionSummary,
    Provenance,
    RecordSummary,
    Verdict,
)
from fibrefit.workflow.fit_files import RESIDUALS, conditions_of_record, gap_summary
from fibrefit.workflow.groups_in_common import (
    BY_SAMPLE,
    conditions_group,
    motion_group,
    observed_group,
    phase_of,
    sample_times,
    within_records,
)
from fibrefit.workflow.prediction.judge import expected_square, limit, prediction_checks
from fibrefit.workflow.prediction.predicted import Predicted
from fibrefit.workflow.thresholds import LACKING


def prediction_summary(found: Predicted, origin: Provenance) -> PredictionSummary:
    """Content of ``summary.json`` of a prediction."""
    task, channels = found.task, {}
    ratios = {}
    for c, channel in enumerate(task.problem.model.rig.channels):
        channels[channel], ratios[channel] = _channel(found, c, channel)
    if found.force is not None:
        channels["force"] = _force(found, found.force)
        # What the fit left of it is all that it is held against: where no fit says so, there is nothing to check.
        if (fitted := channels["force"].fit_rms) is not None:
            ratios["force"] = (found.force.rms / fitted, LACKING)
    readings = np.stack(list(found.seen.motion.readings.values()))
    known = [record.label for record in found.study.records if _was_used(found, record.files)]
    checks = prediction_checks(ratios, readings, found.seen.motion.trouble, task.problem.layout.records, known)
    status, verdict = _judged(checks, found.held.success)
    return PredictionSummary(
        status=status,
        verdict=verdict,
        says=_says(verdict, channels, checks),
        study=found.study.name,
        result=found.known.name,
        rig=found.study.kind,
        effects=tuple(effect.name for effect in task.problem.model.effects),
        parameters=dict(found.known.parameters),
        channels=channels,
        gap=gap_summary(found.seen.gap),
        records={record.name: _record(found, r, record) for r, record in enumerate(found.records)},
        input_errors=_input_errors(found),
        checks=prediction_check_summaries(checks),
        advice=_advice(verdict),
        provenance=origin,
    )


def _was_used(found: Predicted, files: Sequence[str]) -> bool:
    """Whether the values were found from any of the files, as they were when they were read."""
    study = found.study
    return any(study.digests.get(study.path_of(file)) in found.known.digests for file in files)


def _channel(found: Predicted, c: int, channel: str) -> tuple[PredictedChannel, tuple[float, float]]:
    """What is said of a channel; how far it is from its prediction over what is expected, and the most that passes."""
    data, gap, fitted = found.task.problem.observations, found.seen.gap[channel], found.known.gaps.get(channel)
    counted = np.asarray(data.weight[channel]) > 0.0
    parts = {cause: found.sigma(cause)[:, c] ** 2 for cause in found.parts}
    sigma = found.sigma(*found.parts)[:, c]
    error = np.asarray(data.measured[channel]) - found.seen.motion.readings[channel]
    expected = np.sqrt(expected_square(parts, counted))
    predicted = PredictedChannel(
        rms=gap.rms,
        unit=gap.unit,
        explained=gap.explained,
        fit_rms=None if fitted is None else fitted.rms,
        fit_explained=None if fitted is None else fitted.explained,
        expected=float(expected),
        inside=float(np.mean(np.abs(error[counted]) <= Z_95 * sigma[counted])),
    )
    return predicted, (gap.rms / float(expected), limit(parts, counted, found.freedom[channel]))


def _force(found: Predicted, force: ForceBalance) -> PredictedChannel:
    """The same of a force that drives the rig: it is held against what the fit left of its own."""
    fitted = found.known.gaps.get("force")
    return PredictedChannel(
        rms=force.rms,
        unit="N",
        explained=force.explained,
        fit_rms=None if fitted is None else fitted.rms,
        fit_explained=None if fitted is None else fitted.explained,
        expected=None if fitted is None else fitted.rms,
    )


def _judged(checks: tuple[Check, ...], success: bool) -> tuple[Status, Verdict]:
    if not success or any(check.fatal and not check.passed for check in checks):
        return "failed", "not_trusted"
    holds = all(check.passed for check in checks if check.identifier.endswith(OF_PREDICTION))
    new = all(check.passed for check in checks if not check.identifier.endswith(OF_PREDICTION))
    if not new:
        return "suspect", "not_trusted"
    return ("ok", "holds") if holds else ("suspect", "does_not_hold")


def _says(verdict: Verdict, channels: dict[str, PredictedChannel], checks: tuple[Check, ...]) -> str:
    """The verdict with its numbers."""
    if verdict == "not_trusted":
        return next(prediction_sentence(check) for check in checks if not check.passed)
    shares = []
    for name, predicted in channels.items():
        rms = format_quantity(predicted.rms, predicted.unit, 3)
        share = "" if predicted.explained is None else f"{explained_told(predicted.explained, name)}, "
        shares.append(f"{share}within {rms} rms")
    begin = (
        "The values hold for these records: " if verdict == "holds" else "The values do not hold for these records: "
    )
    return f"{begin}they explain {in_words(shares)}."


def _record(found: Predicted, r: int, record: Record) -> RecordSummary:
    layout, local = found.task.problem.layout, found.held.local
    own = {
        slot.name: ParameterSummary(value=float(local[r, j]), unit=slot.unit, free=slot.fixed_in(r) is None)
        for j, slot in enumerate(layout.slots)
        if slot.name not in found.known.parameters
    }
    masked = int(sum(np.sum(~np.asarray(valid)) for valid in record.valid.values()))
    gap = gap_summary(found.seen.record_gaps[record.name])
    return RecordSummary(
        files=found.study.records[r].files,
        conditions=conditions_of_record(found.study, r, own),
        gap=gap,
        parameters=own,
        samples=len(record.time),
        masked=masked,
        notes=record.notes,
    )


def _input_errors(found: Predicted) -> dict[str, InputErrorSummary]:
    traces, known = found.task.traces, found.task.input_noise
    usual = {
        name: np.array([known[name].rms(one.duration, one.rate) for one in traces]) for name in found.held.input_rms
    }
    return {
        name: InputErrorSummary(rms=rms, noise=float(np.sqrt(np.mean(usual[name] ** 2))), unit=ROLES[name])
        for name, rms in found.held.input_rms.items()
    }


def _advice(verdict: Verdict) -> tuple[str, ...]:
    if verdict != "does_not_hold":
        return ()
    return (
        "Fit these records by themselves and lay both results side by side (fibrefit report): values that differ "
        "beyond their intervals tell what changed.",
        'Run "fibrefit discover" on all records together: it looks for what the model lacks and names it.',
    )


OF_MODEL = "The same of the model's reading."


def prediction_groups(found: Predicted) -> dict[str, dict[str, Variable]]:
    """Groups of ``result.h5``: data, prediction with its standard deviation, residuals."""
    task, problem, predicted, left = found.task, found.task.problem, {}, {}
    shared, observed = sample_times(problem), observed_group(problem, task.units)
    sigma, model = found.sigma(*found.parts), found.sigma("values")
    for c, channel in enumerate(problem.model.rig.channels):
        unit, reading = task.units[channel], found.seen.motion.readings[channel]
        predicted[channel] = Variable(
            within_records(problem, reading), BY_SAMPLE, unit, "Predicted; NaN beyond the record."
        )
        for name, of, doc in (("sd", sigma, "Standard deviation of a new reading."), ("model_sd", model, OF_MODEL)):
            predicted[f"{channel}_{name}"] = Variable(within_records(problem, of[:, c]), BY_SAMPLE, unit, doc)
        residual = (reading - observed[channel].values) / found.noise[:, c]
        left[channel] = Variable(residual, BY_SAMPLE, doc=RESIDUALS)
    return {
        "observed_data": observed,
        "predictions": {**shared, **predicted, "phase": phase_of(found.seen.motion)},
        "residuals": {**shared, **left},
        "motion": motion_group(problem, found.seen.motion),
        "constant_data": conditions_group(problem),
    }
