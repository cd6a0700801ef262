"""A series as the files of a result: the summary, groups of ``result.h5``, tables, the study of the winning model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.fitting.gls import interval_of_shared, kind_of_interval
from fibrefit.problem import GAP_OF_NOISE
from fibrefit.series.meta_analysis import Quantity
from fibrefit.series.speed_laws import BY_EFFECT, parameter_of
from fibrefit.series.speed_models import LawCurve, Verdict
from fibrefit.study import Study
from fibrefit.study.parameters import ParameterTable, with_initial
from fibrefit.study.summaries import series as s
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import Variable
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.workflow.thresholds import DECIDED
from fibrefit.workflow.together.conditions import by_record


def rival_summaries(found: Verdict) -> dict[s.Answer, s.RivalSummary]:
    """The three models."""
    base = float(found.left_out["constant"].elpd.sum())
    shared: dict[s.Answer, LaplaceFit] = {"constant": found.models.constant, "speed_law": found.models.law}
    summaries = {}
    for name, log in found.logs.items():
        model = shared.get(name)
        summaries[name] = s.RivalSummary(
            log_bayes_factor=log,
            gap=found.gaps[name],
            gap_left_out=found.left_out[name].gap,
            elpd=float(found.left_out[name].elpd.sum()) - base,
            laws=() if model is None else model.names,
            parameters={} if model is None else parameters_of(model),
        )
    return summaries


def parameters_of(model: LaplaceFit) -> dict[str, ParameterSummary]:
    """Shared values of a model with their errors."""
    units = {name: declared.unit for name, declared in model.supermodel.declared.items()}
    limits = {slot.name: slot.range for slot in model.supermodel.problem.layout.slots}
    errors, differ = model.errors, model.evidence.between_records()
    found = {}
    for index, (name, value) in enumerate(model.shared.items()):
        low, high = interval_of_shared(model.evidence, index)
        found[name] = ParameterSummary(
            value=value,
            std_error=errors[name],
            interval_95=(max(low, limits[name].lower), min(high, limits[name].upper))
            if np.isfinite(errors[name])
            else None,
            unit=units[name],
            interval_kind=kind_of_interval(name, differ),
        )
    return found


def law_summaries(found: Verdict) -> tuple[s.LawSummary, ...]:
    """Every law by itself: at its best, or by what slopes promise of it, without values, where that is too little."""
    summaries = []
    for tried in found.models.tried:
        law = BY_EFFECT[tried.found.effects[-1].name]
        values = {} if tried.linearised else parameters_of(tried.found)
        summaries.append(
            s.LawSummary(
                effect=law.effect.name,
                parameter=law.parameter,
                form=law.form,
                log_bayes_factor=tried.log,
                linearised=tried.linearised,
                parameters={name: one for name, one in values.items() if name.startswith(f"{law.effect.name}.")},
            )
        )
    return tuple(summaries)


def speed_curve_summary(found: Verdict, one: LawCurve) -> s.SpeedCurveSummary:
    """A parameter over speed."""
    return s.SpeedCurveSummary(
        parameter=one.law.parameter,
        effect=one.law.effect.name,
        form=one.law.form,
        unit=found.units[one.law.parameter],
        speeds=tuple(one.speeds.tolist()),
        values=tuple(one.values.tolist()),
        low=tuple(one.low.tolist()),
        high=tuple(one.high.tolist()),
    )


def record_summaries(found: Verdict, names: Sequence[str], conditions: Sequence[Quantity]) -> dict[str, s.SeriesRecord]:
    """What each record says."""
    summaries = {}
    for r, name in enumerate(names):
        speeds = {
            key: (float(rows[r, 0]), float(rows[r, 2]))
            for key, rows in found.speeds.items()
            if np.isfinite(rows[r]).all()
        }
        parameters = {}
        for j, parameter in enumerate(found.own.names):
            pooled = found.populations.get(parameter)
            parameters[parameter] = s.OwnSummary(
                value=float(found.own.values[r, j]),
                std_error=float(found.own.errors[r, j]),
                common_error=float(found.own.common[j]),
                shrunk=None if pooled is None else float(pooled.shrunk[r]),
                shrunk_error=None if pooled is None else float(pooled.shrunk_error[r]),
                unit=found.units[parameter],
            )
        left = {key: float(one.gaps[r]) for key, one in found.left_out.items()}
        values, errors = by_record(conditions, r)
        summaries[name] = s.SeriesRecord(
            speeds=speeds, conditions=values, condition_errors=errors, parameters=parameters, gap_left_out=left
        )
    return summaries


def series_checks(found: Verdict) -> tuple[Check, ...]:
    """Whether the answer can be trusted."""
    gap = found.gaps[found.answer]
    gained = float(found.left_out["speed_law"].elpd.sum() - found.left_out["constant"].elpd.sum())
    agree = (gained > 0.0) == (found.logs["speed_law"] > 0.0) or abs(found.logs["speed_law"]) < DECIDED
    ends = _at_ends(found)
    return (
        Check(
            name="the gap is noise",
            passed=gap <= GAP_OF_NOISE,
            says=f"Normalised residual RMS is {gap:.3g}; at most {GAP_OF_NOISE:g} is expected."
            + (
                ""
                if gap <= GAP_OF_NOISE
                else " What is left is more than noise: run discover before you trust the law."
            ),
            statistic=gap,
            threshold=GAP_OF_NOISE,
            identifier="gap",
            quantity="residual size",
        ),
        Check(
            name="records left out agree",
            passed=agree,
            says=f"Laws of speed predict records left out by {gained:.3g} nats more than constant parameters; the "
            f"marginal likelihood has it {found.logs['speed_law']:.3g}.",
            statistic=gained,
            threshold=0.0,
            identifier="left_out",
            quantity="records left out",
        ),
        Check(
            name="no parameter at a bound",
            passed=not ends,
            says="All: yes." if not ends else f"At a bound: {', '.join(ends)}. Another form of the law may be right.",
            identifier="bounds",
            quantity="distance of the parameters from their bounds",
        ),
    )


def _at_ends(found: Verdict) -> list[str]:
    unknowns, place = found.best.evidence.mode.unknowns, found.best.evidence.mode.place
    hit = (place.z <= unknowns.lower + 1e-9) | (place.z >= unknowns.upper - 1e-9)
    # Shares of a curve may well be all or nothing.
    return [name for name, at in zip(unknowns.names, hit, strict=False) if at and not name.endswith("_share")]


def winning_study(study: Study, found: Verdict) -> Study:
    """Study of the winning model, beginning at its values; with each record's own where that is the answer."""
    best = found.best
    declared = best.supermodel.declared
    settings = study.settings(declared)

    def begun(name: str, value: float) -> ParameterTable:
        return with_initial(study.parameters.get(name, ParameterTable()), value, settings[name], declared[name])

    if found.answer == "per_record":
        middles = np.exp(np.log(found.own.values).mean(axis=0))
        own = {name: begun(name, float(middle)) for name, middle in zip(found.own.names, middles, strict=True)}
        own = {name: table.model_copy(update={"shared": False}) for name, table in own.items()}
        return study.model_copy(update={"parameters": {**study.parameters, **own}})
    parameters = {**study.parameters, **{name: begun(name, value) for name, value in best.shared.items()}}
    added = [effect.name for effect in best.effects if parameter_of(effect)]
    model = study.model.model_copy(update={"effects": (*study.model.effects, *added)})
    return study.model_copy(update={"model": model, "parameters": parameters})


def series_groups(found: Verdict, names: Sequence[str]) -> dict[str, dict[str, Variable]]:
    """Groups of ``result.h5``: each record's values, the curves, the predictions of records left out."""
    records: dict[str, Variable] = {"record": Variable(np.array(list(names), dtype=object), ("record",))}
    for j, name in enumerate(found.own.names):
        unit = found.units[name]
        records[name] = Variable(found.own.values[:, j], ("record",), unit, "Of the record by itself.")
        said = "Its standard error, without the part that is alike in all records."
        records[f"{name}_std_error"] = Variable(found.own.errors[:, j], ("record",), unit, said)
    left = {
        f"{key}_{what}": Variable(getattr(one, what), ("record",), "-", "Of each record, predicted from the others.")
        for key, one in found.left_out.items()
        for what in ("gaps", "elpd")
    }
    curves = {
        f"curve_{one.law.parameter}": {
            "speed": Variable(one.speeds, ("speed",), "m/s", ""),
            **{
                key: Variable(getattr(one, key), ("speed",), found.units[one.law.parameter], one.law.effect.name)
                for key in ("values", "low", "high")
            },
        }
        for one in found.curves
    }
    return {"records": records, "left_out": left, **curves}
