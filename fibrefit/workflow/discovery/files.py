"""A discovery as the files of a result: the summary, the groups of ``result.h5``, and the study of the final model."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fibrefit.discovery.model.finding import Finding
from fibrefit.laws.fibre.point_masses import PointMasses
from fibrefit.records import Record
from fibrefit.report.sentences.discovery import (
    UNDONE,
    discovery_sentence,
    reason,
    worded_round,
    worded_separation,
    worded_weight,
)
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.study import Study
from fibrefit.study.parameters import ParameterTable, with_initial
from fibrefit.study.summaries import discovery as d
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries.part import Variable
from fibrefit.workflow.discovery.advice import next_steps
from fibrefit.workflow.discovery.residual_files import residual_groups
from fibrefit.workflow.discovery.statements import statements_of
from fibrefit.workflow.fit_files import fit_groups, fit_summary, gap_summary


def discovery_summary(
    study: Study, records: Sequence[Record], finding: Finding, origin: s.Provenance
) -> d.DiscoverySummary:
    """Content of ``summary.json`` of a discovery."""
    final = fit_summary(study, records, finding.after, origin)
    narrowed = bool({"only", "exclude"} & set(origin.settings))
    shared = {name: getattr(final, name) for name in s.FitResultSummary.model_fields} | {
        "advice": next_steps(finding, narrowed)
    }
    looks_like = finding.looks_like and discovery_sentence(finding.looks_like)
    return d.DiscoverySummary(
        **shared,
        verdict=finding.verdict,
        reason=reason(finding.reason) or " ".join(map(fit_sentence, finding.broken)),
        added=tuple(effect.name for effect in finding.added),
        statements=statements_of(finding),
        rounds=tuple(worded_round(step.summary, step.statements) for step in finding.steps),
        cannot_tell_apart=finding.cannot_tell_apart,
        separated_by=tuple(map(worded_separation, finding.separated_by)),
        detectable=finding.detectable,
        unexplained=finding.unexplained.model_copy(update={"looks_like": looks_like}),
        before=_before(finding),
        held_out=finding.held_out,
        weights=tuple(map(worded_weight, finding.weights)),
        ranking=finding.ranking,
        proposed_law=finding.proposed_law and finding.proposed_law.summary,
        untried=finding.untried,
        undone=tuple(UNDONE[part] for part in finding.undone),
    )


def final_study(study: Study, finding: Finding, added: Sequence[str]) -> Study:
    """Study of the final model: with what was added, starting at the values that were found.

    Parameters
    ----------
    study : Study
        The one the search began with.
    finding : Finding
    added : sequence of str
        Effects that were added, by the names a study gives them.

    Returns
    -------
    Study
        The same where the fits could not be trusted: their values are no place to start from.
    """
    if finding.verdict == "not_trusted":
        return study
    found: dict[str, list[float]] = {}
    for name, _, one in finding.after.estimates:
        if one.free and np.isfinite(one.value):
            found.setdefault(name, []).append(one.value)
    declared = {parameter.name: parameter for parameter in finding.after.problem.model.parameters}
    parameters = dict(study.parameters)
    for name, setting in study.settings(declared).items():
        if name in found:
            table = parameters.get(name, ParameterTable())
            parameters[name] = with_initial(table, float(np.mean(found[name])), setting, declared[name])
    model = study.model.model_copy(update={"effects": (*study.model.effects, *added)})
    rig = study.rig.model_copy(update=_points(finding))
    return study.model_copy(update={"model": model, "rig": rig, "parameters": parameters})


def _points(finding: Finding) -> dict[str, int]:
    """Setting of the rig that says how many points a fibre has whose mass was found."""
    found = [effect.points for effect in finding.added if issubclass(effect, PointMasses)]
    return {"masses_per_fibre": found[0]} if found else {}


def discovery_groups(finding: Finding) -> dict[str, dict[str, Variable]]:
    """Groups of ``result.h5``: those of the final fit, the readings before, every candidate, and what is left."""
    readings = fit_groups(finding.before)["predictions"]
    return {
        **fit_groups(finding.after),
        "predictions_before": readings,
        **residual_groups(finding),
        "discovery": _trials(finding),
        "curves": _curves(finding.unexplained.curves),
        "held_out": {
            "record": Variable(_text(held.record for held in finding.held_out), ("record",)),
            "gap_before": Variable(np.array([held.gap_before for held in finding.held_out]), ("record",)),
            "gap_after": Variable(np.array([held.gap_after for held in finding.held_out]), ("record",)),
        },
    }


def _trials(finding: Finding) -> dict[str, Variable]:
    looks = [step.summary.ranking for step in finding.steps] or [finding.ranking]
    trials = [(number, candidate) for number, look in enumerate(looks, 1) for candidate in look]
    values = [(i, name, one) for i, (_, c) in enumerate(trials) for name, one in c.parameters.items()]
    return {
        "round": Variable(np.array([number for number, _ in trials], dtype=int), ("trial",), doc="Counted from 1."),
        "effect": Variable(_text(candidate.effect for _, candidate in trials), ("trial",)),
        "gap_after": Variable(np.array([c.gap_after for _, c in trials], dtype=float), ("trial",)),
        "evidence": Variable(
            np.array([c.evidence for _, c in trials], dtype=float),
            ("trial",),
            doc="Natural logarithm of the Bayes factor against the model before the round.",
        ),
        "false_alarm": Variable(
            np.array([c.false_alarm for _, c in trials], dtype=float),
            ("trial",),
            doc="Probability that the best of all candidates reaches as much although nothing is missing.",
        ),
        "value_of": Variable(np.array([v[0] for v in values], dtype=int), ("value",), doc="Trial it belongs to."),
        "parameter": Variable(_text(v[1] for v in values), ("value",)),
        "estimate": Variable(np.array([one.value for *_, one in values], dtype=float), ("value",), doc="In `unit`."),
        "std_error": Variable(_seen(one.std_error for *_, one in values), ("value",), doc="In `unit`."),
        "unit": Variable(_text(one.unit for *_, one in values), ("value",)),
    }


def _curves(curves: Sequence[d.FreeCurve]) -> dict[str, Variable]:
    """Every knot of every curve, best curve first."""
    sizes = [len(curve.knots) for curve in curves]

    def knots(name: str, unit_of: str, doc: str) -> Variable:
        values = np.concatenate([np.zeros(0), *(_seen(getattr(curve, name)) for curve in curves)])
        return Variable(values, ("value",), doc=f"{doc}, in {unit_of}.")

    return {
        "variable": Variable(_text(curve.variable for curve in curves), ("curve",), doc="What it depends on."),
        "says": Variable(_text(curve.says for curve in curves), ("curve",)),
        "unit": Variable(_text(curve.unit for curve in curves), ("curve",), doc="Of the knots."),
        "height_unit": Variable(_text(curve.height_unit for curve in curves), ("curve",), doc="Of the heights."),
        "gap_after": Variable(np.array([curve.gap_after for curve in curves], dtype=float), ("curve",)),
        "cost": Variable(
            np.array([curve.cost for curve in curves], dtype=float),
            ("curve",),
            doc="Sum of squared residuals over the noise, with the curve in the model.",
        ),
        "curve_of": Variable(np.repeat(np.arange(len(curves)), sizes), ("value",), doc="Curve it belongs to."),
        "knot": knots("knots", "`unit`", "Value of the variable"),
        "height": knots("heights", "`height_unit`", "Height of the curve without its median"),
        "std_error": knots("std_errors", "`height_unit`", "Of the height, but for the level of the whole curve"),
        "seconds": knots("seconds", "s", "Time the motion spends nearest to the knot"),
    }


def _seen(errors: Iterable[float | None]) -> np.ndarray:
    """Errors; infinite where records do not see what they are of."""
    return np.array([np.inf if error is None else error for error in errors])


def _text(words: object) -> np.ndarray:
    return np.array(list(words), dtype=object)  # type: ignore[call-overload]


def _before(finding: Finding) -> d.Before:
    before = finding.before
    return d.Before(
        status=before.status,
        effects=tuple(effect.name for effect in before.problem.model.effects),
        parameters=before.parameters,
        gap=gap_summary(before.gap),
        records={name: gap_summary(gap) for name, gap in before.record_gaps.items()},
    )
