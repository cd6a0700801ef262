"""An identification as the files of a result: the summary and the groups of ``result.h5``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.matrices import correlation_matrix
from fibrefit.fitting.checks import BOUNDS
from fibrefit.fitting.result import Gap, Identification, Starts, total
from fibrefit.problem import Belief, Problem
from fibrefit.records import Record
from fibrefit.report.sentences.fit import (
    advice_sentence,
    estimator_sentence,
    fit_checks,
    fit_sentence,
    prior_not_weighed,
    taken_for_exact,
)
from fibrefit.series.speed_laws import laws_on, speeds_of
from fibrefit.study import Study
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import MOST_MINIMA, Variable
from fibrefit.study.summaries.results import (
    Basin,
    ChannelGap,
    ConditionSummary,
    CorrelationSummary,
    FitSummary,
    ParameterSummary,
    Provenance,
    RecordSummary,
    StartsSummary,
    StatisticsSummary,
)
from fibrefit.study.summaries.results import Gap as GapSummary
from fibrefit.workflow.groups_in_common import (
    BY_SAMPLE,
    conditions_group,
    motion_group,
    observed_group,
    phase_of,
    reading_errors,
    sample_times,
    within_records,
)
from fibrefit.workflow.thresholds import CORRELATED

DETERMINED = "identifiability"


def fit_summary(study: Study, records: Sequence[Record], found: Identification, origin: Provenance) -> FitSummary:
    """Content of ``summary.json`` of a fit."""
    speeds = _speeds(found)
    return FitSummary(
        status=found.status,
        study=study.name,
        rig=study.kind,
        parameters=found.parameters,
        gap=gap_summary(found.gap, found.balance),
        expected_gap=found.expected_gap,
        input_errors=dict(found.input_errors),
        records={
            one.name: _record_summary(study, r, one, found, at)
            for r, (one, at) in enumerate(zip(records, speeds, strict=True))
        },
        between_records=dict(found.between),
        checks=fit_checks(found.checks),
        starts=starts_summary(found.starts),
        effects=tuple(effect.name for effect in found.problem.model.effects),
        own_parameters=own_parameters(found.problem),
        estimator=found.estimator,
        estimator_says=estimator_sentence(found.why),
        error_method=found.method,
        error_inflation=found.error_inflation,
        correlations=strong_correlations(found),
        statistics=statistics(found),
        findings=tuple(map(fit_sentence, filter(_tells, found.checks))),
        advice=(*map(advice_sentence, found.advice), *_taken_for_exact(study), *_not_weighed(study, found.problem)),
        provenance=origin,
    )


def _tells(check: Check) -> bool:
    """Whether a check says what the data do not determine, or of which value they tell one side alone."""
    by_chance = check.identifier == BOUNDS and bool(check.facts["by_chance"])
    return by_chance or (check.identifier == DETERMINED and not check.passed)


def _taken_for_exact(study: Study) -> tuple[str, ...]:
    """What to do where records say how well their conditions are known, which a fit does not weigh."""
    stated = {name: record.label for record in study.records for name in record.uncertainties or {}}
    return tuple(taken_for_exact(name, stated[name], hasattr(study.rig, name)) for name in sorted(stated))


def _not_weighed(study: Study, problem: Problem) -> tuple[str, ...]:
    """What is said of priors that only `sample` weighs."""
    stated = study.settings({parameter.name: parameter for parameter in problem.model.parameters})
    dropped = [one for one in stated.values() if one.prior is not None and not one.fixed and Belief.of(one) is None]
    return tuple(prior_not_weighed(one.name, one.shared) for one in dropped)


def own_parameters(problem: Problem) -> tuple[str, ...]:
    """Parameters of the model that each record has for itself."""
    declared = {parameter.name for parameter in problem.model.parameters}
    return tuple(slot.name for slot in problem.layout.slots if slot.name in declared and slot.free and not slot.shared)


def strong_correlations(found: Identification) -> tuple[CorrelationSummary, ...]:
    """Pairs of shared parameters whose errors are correlated by more than `CORRELATED`, the strongest first."""
    known = correlation_matrix(found.covariance)
    shared = [
        (i, slot.name)
        for i, (slot, record) in enumerate(found.problem.layout.entries)
        if record is None and np.isfinite(known[i, i])
    ]
    pairs = [
        (float(np.clip(known[i, j], -1.0, 1.0)), a, b) for n, (i, a) in enumerate(shared) for j, b in shared[n + 1 :]
    ]
    strong = sorted((pair for pair in pairs if abs(pair[0]) > CORRELATED), key=lambda pair: -abs(pair[0]))
    return tuple(CorrelationSummary(pair=(a, b), correlation=r) for r, a, b in strong)


def statistics(found: Identification) -> StatisticsSummary | None:
    """How much was fitted to how much; nothing where the motion could not be simulated.

    Sums of squares compare models only where all are of the same readings, weighed alike: errors of measured inputs and
    differences between records take some of them away, each model its own, at a price that stands in the evidence.
    """
    if not np.isfinite(found.residuals).all():
        return None
    samples, free = found.problem.n_measured, found.problem.layout.size
    chi_square = float(np.sum(found.residuals**2))
    alike = not found.input_errors and not any(one.found for one in found.between.values())
    bic = chi_square + free * math.log(samples) if alike else None
    return StatisticsSummary(samples=samples, free_values=free, chi_square=chi_square, bic=bic)


def gap_summary(gap: Gap, force: ChannelGap | None = None) -> GapSummary:
    """A gap as `summary.json` has it; `force` is that of a force that drives the rig, of which no noise is known."""
    channels = {} if force is None else {"force": force}
    return GapSummary(total=total(gap), **(channels | dict(gap)))


def starts_summary(starts: Starts) -> StartsSummary:
    """The table of starts, a line for each basin."""
    basins = []
    for basin in range(min(int(starts.basin.max()) + 1, MOST_MINIMA)):
        inside = starts.basin == basin
        first = int(np.flatnonzero(inside)[np.argmin(starts.cost[inside])])
        values = dict(zip(starts.names, starts.ended[first].tolist(), strict=True))
        excess = float(starts.cost[first] / starts.cost.min() - 1.0) if basin else 0.0
        basins.append(Basin(cost=excess, starts=int(inside.sum()), parameters=values))
    return StartsSummary(tried=starts.tried, agreeing=starts.agreeing, basins=tuple(basins))


def fit_groups(found: Identification) -> dict[str, dict[str, Variable]]:
    """Groups of ``result.h5``: estimates, data, the model's readings and residuals, starts."""
    problem = found.problem
    names, shared = np.array(problem.layout.free_names, dtype=object), sample_times(problem)
    units = {name: channel.unit for name, channel in found.gap.items()}
    return {
        "estimate": {
            "parameter": Variable(names, ("parameter",), doc="Free values; name[record] where each has its own."),
            "value": Variable(found.values, ("parameter",), doc="SI units."),
            "plain": Variable(found.plain.values, ("parameter",), doc="Of plain least squares; SI units."),
            "covariance": Variable(found.covariance, ("parameter", "parameter_2"), doc=f"From {found.method}."),
            "parameter_2": Variable(names, ("parameter_2",)),
            **_between_variables(found),
        },
        "observed_data": observed_group(problem, units),
        "predictions": {
            **shared,
            **{
                name: Variable(within_records(found.problem, found.readings[name]), BY_SAMPLE, units[name], SIMULATED)
                for name in units
            },
            **reading_errors(found),
            "phase": phase_of(found.motion),
        },
        "residuals": {
            **shared,
            **{name: Variable(found.residuals[:, i], BY_SAMPLE, doc=RESIDUALS) for i, name in enumerate(units)},
        },
        "motion": motion_group(problem, found.motion),
        "constant_data": conditions_group(problem),
        "starts": _starts_group(found.starts),
    }


SIMULATED = "Simulated; NaN beyond the record."
RESIDUALS = "Simulated minus measured over the noise."


def _between_variables(found: Identification) -> dict[str, Variable]:
    """Differences between records: what is believed of their size, and each record's own."""
    gls = found.gls
    if gls is None or not gls.between:
        return {}
    names, records = (np.array(of, dtype=object) for of in (tuple(gls.between), found.problem.layout.records))
    found_of = list(gls.between.values())
    limits = np.array([one.interval_95 for one in found_of])
    eta = gls.evidence.mode.place.eta
    return {
        "scattering": Variable(names, ("scattering",), doc="Parameters that may differ from record to record."),
        "scattering_record": Variable(records, ("scattering_record",)),
        "between_records": Variable(
            np.array([one.sd for one in found_of]), ("scattering",), doc="Relative standard deviation, median."
        ),
        "between_records_low": Variable(limits[:, 0], ("scattering",), doc="Lower end of its 95 % interval."),
        "between_records_high": Variable(limits[:, 1], ("scattering",), doc="Upper end of its 95 % interval."),
        "deviation": Variable(
            eta, ("scattering_record", "scattering"), doc="Logarithm of a record's value over the shared one."
        ),
    }


def _starts_group(starts: Starts) -> dict[str, Variable]:
    return {
        "parameter": Variable(np.array(starts.names, dtype=object), ("parameter",)),
        "began": Variable(starts.began, ("start", "parameter"), doc="SI units."),
        "ended": Variable(starts.ended, ("start", "parameter"), doc="SI units."),
        "cost": Variable(starts.cost, ("start",), doc="Sum of squared residuals over the noise."),
        "basin": Variable(starts.basin, ("start",), doc="0 for the best minimum; -1 where the solver gave up."),
    }


def _speeds(found: Identification) -> list[dict[str, tuple[float, float, float]]]:
    """Of each record: at which speeds it tells of the parameters that a law of speed may be about."""
    speeds = speeds_of(found.motion, np.asarray(found.problem.observations.experiment.count))
    lawful = {law.parameter for law in laws_on(found.problem.model.rig)} & set(speeds)
    rows = {name: speeds[name].tolist() for name in speeds if name in lawful}
    return [
        {name: (row[r][0], row[r][1], row[r][2]) for name, row in rows.items() if np.isfinite(row[r]).all()}
        for r in range(len(found.problem.layout.records))
    ]


def conditions_of_record(study: Study, number: int, own: Mapping[str, ParameterSummary]) -> dict[str, ConditionSummary]:
    """Conditions of a record, stated and found; what is a parameter of all records is told there.

    Parameters
    ----------
    number : int
        Its place in the study.
    own : mapping of str to ParameterSummary
        Values of this record alone.
    """
    record = study.records[number]
    known = {
        name: ConditionSummary(value=value, unit=unit, std_error=record.uncertainty(name) or None)
        for name, (value, unit) in record.in_numbers().items()
        if name not in study.found_constants
    }
    return known | {
        name: ConditionSummary(value=one.value, unit=one.unit, std_error=one.std_error, found=True)
        for name, one in own.items()
        if name in record.conditions() and one.free
    }


def _record_summary(
    study: Study, number: int, record: Record, found: Identification, speeds: dict[str, tuple[float, float, float]]
) -> RecordSummary:
    own = found.parameters_of(record.name)
    masked = int(sum(np.sum(~np.asarray(valid)) for valid in record.valid.values()))
    return RecordSummary(
        files=study.records[number].files,
        conditions=conditions_of_record(study, number, own),
        gap=gap_summary(found.record_gaps[record.name]),
        parameters=own,
        speeds=speeds,
        samples=len(record.time),
        masked=masked,
        notes=record.notes,
    )
