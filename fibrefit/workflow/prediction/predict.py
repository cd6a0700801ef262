"""Prediction: the values of a result on records it has not seen; only zero and start are fitted to them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.core.limits import Progress, quiet
from fibrefit.core.threads import one_blas_thread
from fibrefit.fitting.residuals import evaluate
from fibrefit.fitting.uncertainty import Freedom, freedom_of, predictive_slopes, predictive_variance
from fibrefit.problem import ForceBalance, Layout, Problem, Task, formulate
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.parameters import ParameterSetting, ParameterTable, with_initial
from fibrefit.study.summaries.part import Groups
from fibrefit.study.summaries.results import PredictionSummary
from fibrefit.workflow.prediction.files import prediction_groups, prediction_summary
from fibrefit.workflow.prediction.held import Held, with_nuisances_found
from fibrefit.workflow.prediction.known import Difference, HasValues, Known, as_known
from fibrefit.workflow.prediction.predicted import Predicted, noise_of_readings
from fibrefit.workflow.prepare import model_of, read_records, refuse_places
from fibrefit.workflow.saved import FoundResult

SAME_STATED = 1e-6
"""Relative difference of two values that are the same one, stated with as many digits."""


@dataclass(frozen=True, repr=False)
class Prediction(Predicted, FoundResult):
    """Records beside what was predicted of them, to be read, drawn and saved."""

    @property
    def verdict(self) -> str:
        """``holds``, ``does_not_hold`` or ``not_trusted``."""
        return self.summary().verdict

    def inputs(self) -> list[Path]:
        """Files of the study, and of the result whose values it is."""
        return [*super().inputs(), *map(Path, self.known.files)]

    def summary(self) -> PredictionSummary:
        """Content of ``summary.json``."""
        origin = provenance(self.study, self.inputs(), seconds=self.seconds, read=self.known.files)
        return prediction_summary(self, origin)

    def groups(self) -> Groups:
        """Arrays of ``result.h5``."""
        return prediction_groups(self)


@one_blas_thread
def predict_study(
    result: HasValues | PathLike[str] | str | Known, study: Study | str | Path, *, progress: Progress | None = None
) -> Prediction:
    """Predict the records of a study with the model and the values of a result.

    Only what belongs to a record alone is fitted to it: the zero of its position, its release or start, and the error
    of a measured input within its noise.

    Parameters
    ----------
    result : Fit, Discovery, Sampled, StoredResult, os.PathLike or str
        What was found, its folder, or one that `load_result` has read.
    study : Study, str or pathlib.Path
        Rig, conditions and records; its own model and parameters do not count.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    Prediction
        With ``verdict``, ``status``, ``report()``, ``summary()``, ``to_dataframe()``, ``residuals``, ``plot()`` and
        ``save(folder)``.

    Raises
    ------
    StudyError
        If the rig is of another kind than that of the result, or another variant of it; if it states another value of
        a constant that was found with the model; if the model goes by the places of the records it was found from.
    UsageError
        If the result holds no values that can be relied on.
    DataError
        If a record is not understood.

    Examples
    --------
    >>> found = fibrefit.fit(fibrefit.example("drop_series"), starts=4)
    >>> found.predict(fibrefit.example("drop_series") / "holdout").verdict
    'holds'
    """
    study = as_study(study)
    began, tell = time.perf_counter(), progress or quiet
    known = as_known(result)
    model = model_of(known.study)
    _refuse_another_rig(study, known)
    _refuse_other_constants(study, known)
    do = "Fit without it; or, for an effect of single records, fit the others."
    refuse_places(model.effects, known.name, do)  # new records have other places
    tell("reading records", None)
    records = read_records(study)
    study = _with_values(study, known)
    task = formulate(_all_held(study), records, model)
    tell("fitting zero and start of each record", 0.3)
    held = with_nuisances_found(task)
    tell("simulating", 0.7)
    seen = evaluate(held.task, held.task.problem, held.local)
    tell("predictive band", 0.8)
    force, (parts, freedom) = ForceBalance.of(held.task, held.task.start), _expected(task, held, known)
    return Prediction(study, records, known, held, seen, force, parts, freedom, time.perf_counter() - began)


def _refuse_another_rig(study: Study, known: Known) -> None:
    """Refuse records of a rig that the values are not of: its equations are others, or it needs other channels."""
    if (study.kind, study.variant) != (known.study.kind, known.study.variant):
        expected = f"a {_rig_in_words(known.study)}, as {known.name}"
        alike = "a rig that is measured and driven alike" if study.kind == known.study.kind else "the same kind of rig"
        do = f"Predict records of {alike}, or fit such a study."
        raise StudyError(str(study.source), f"a {_rig_in_words(study)}", expected, do)


def _refuse_other_constants(study: Study, known: Known) -> None:
    """Refuse records of which a constant is stated otherwise than where it was found: what was found is not of them."""
    tables = {"rig": study.rig} | {f"records[{i}]": record for i, record in enumerate(study.records)}
    for name, stated in known.study.found_constants.items():
        alike = (stated, known.parameters[name].value if name in known.parameters else stated)
        for place, table in tables.items():
            value = getattr(table, name, None)
            if value is not None and not any(math.isclose(value, one, rel_tol=SAME_STATED) for one in alike):
                got = f"another value than in {known.name}, where it is a parameter of the model"
                do = f"State {name} without an uncertainty in the study of the result, and fit it again."
                raise StudyError(study.place_of(f"{place}.{name}"), got, "the value that is stated there", do)


def _rig_in_words(study: Study) -> str:
    """Kind of its rig, with what the study says where that makes a variant of it."""
    if not study.variant:
        return study.kind
    usual = {name: field.default for name, field in type(study.rig).model_fields.items()}
    stated = {name: value for name, value in dict(study.rig).items() if isinstance(value, str) and name != "kind"}
    said = [f'{name} = "{value}"' for name, value in stated.items() if value != usual[name]]
    return f"{study.kind} with {' and '.join(said)}"


def _all_held(study: Study) -> Study:
    """The study with every value held, also where the result had to find it: nothing of them is asked of its data."""
    tables = {name: table.model_copy(update={"fixed": True}) for name, table in study.parameters.items()}
    return study.model_copy(update={"parameters": tables})


def _with_values(study: Study, known: Known) -> Study:
    """The study with the model and the values of a result."""
    declared = {parameter.name: parameter for parameter in model_of(known.study).parameters}
    tables = {
        name: with_initial(
            ParameterTable(fixed=not parameter.free),
            parameter.value,
            ParameterSetting(name, parameter.unit),
            declared[name],
        )
        for name, parameter in known.parameters.items()
    }
    effects = tuple(_found_from_anywhere(effect, known.study) for effect in known.study.model.effects)
    model = known.study.model.model_copy(update={"effects": effects})
    return study.model_copy(update={"model": model, "parameters": tables})


def _found_from_anywhere(effect: str, study: Study) -> str:
    """Name of an effect; that of a user's own with the whole path of its file."""
    file, colon, name = effect.rpartition(":")
    return f"{study.path_of(file).resolve().as_posix()}{colon}{name}" if colon else effect


def _expected(task: Task, held: Held, known: Known) -> tuple[dict[str, np.ndarray], dict[str, Freedom]]:
    """Variance of a new reading by its cause, in units of that of its noise; freedom of that of values by channel."""
    layout = task.problem.layout
    slots = tuple(replace(slot, fixed=()) if slot.name in known.names else slot for slot in layout.slots)
    problem = Problem(task.problem.model, Layout(slots, layout.records), held.task.problem.observations)
    slopes, noise = predictive_slopes(problem, held.local, known.names), noise_of_readings(problem)
    values = predictive_variance(slopes, known.covariance)
    lacking = np.array([_lacking(known, channel) for channel in problem.model.rig.channels])[:, None]
    parts = {"noise": np.ones_like(values), "model": lacking / noise**2, "values": values}
    alike = Difference(0.0)
    own, freedom = np.array([known.differences.get(name, alike) for name in known.names]).reshape(-1, 2).T
    found = {}
    for c, channel in enumerate(problem.model.rig.channels):
        counted = np.asarray(problem.observations.weight[channel]) > 0.0
        rows = slopes[:, c] * np.where(counted, noise[:, c], 0.0)[:, :, None]
        found[channel] = freedom_of(rows, known.covariance, own, freedom)
    return parts, found


def _lacking(known: Known, channel: str) -> float:
    """Mean square of what the fit left of a channel beyond its noise, in SI units."""
    gap = known.gaps.get(channel)
    return 0.0 if gap is None or gap.noise is None else max(gap.rms**2 - gap.noise**2, 0.0)
