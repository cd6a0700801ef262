"""``series``: three models of the same records, which of them serves, and what the records say together."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.core.limits import Progress, quiet
from fibrefit.core.threads import one_blas_thread
from fibrefit.series.meta_analysis import Quantity, trends
from fibrefit.series.speed_laws import laws_on, parameter_of
from fibrefit.series.speed_models import Answer, Verdict, compare_models
from fibrefit.store import ResultDirectory
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.part import Measure
from fibrefit.study.summaries.series import SeriesSummary, TrendSummary, speed_name
from fibrefit.workflow.prepare import read_records, task_of
from fibrefit.workflow.saved import FoundResult, write_parts
from fibrefit.workflow.thresholds import SHORTEST_SERIES
from fibrefit.workflow.together import files
from fibrefit.workflow.together.conditions import conditions_of_records, speed_condition
from fibrefit.workflow.together.pooled import population_summary
from fibrefit.workflow.together.tidy import write_table
from fibrefit.workflow.together.words import answer_in_words

if TYPE_CHECKING:
    import pandas as pd

    from fibrefit.study.summaries.part import Variable


@dataclass(frozen=True, repr=False)
class SeriesResult(FoundResult):
    """A series, tested for whether one set of parameters serves all speeds.

    Parameters
    ----------
    study : Study
    names : tuple of str
        Of the records.
    verdict : Verdict
    seed : int
    seconds : float
    """

    study: Study
    names: tuple[str, ...]
    verdict: Verdict
    seed: int
    seconds: float

    @property
    def answer(self) -> Answer:
        """``"constant"``, ``"speed_law"`` or ``"per_record"``."""
        return self.verdict.answer

    @property
    def sentence(self) -> str:
        """The answer in words and numbers."""
        return answer_in_words(self.verdict)

    @property
    def status(self) -> Literal["ok", "suspect"]:
        """``ok`` or ``suspect``, as the checks have it."""
        return "ok" if all(check.passed for check in files.series_checks(self.verdict)) else "suspect"

    @cached_property
    def conditions(self) -> tuple[Quantity, ...]:
        """Conditions that differ between records."""
        return conditions_of_records(self.study, self.study.records)

    @cached_property
    def _with_speeds(self) -> tuple[Quantity, ...]:
        """Conditions, and the speed at which each parameter was determined."""
        speeds = (replace(speed_condition(rows), name=speed_name(name)) for name, rows in self.verdict.speeds.items())
        return (*self.conditions, *speeds)

    @cached_property
    def parameters(self) -> tuple[Quantity, ...]:
        """Base parameters of each record by itself."""
        own, units = self.verdict.own, self.verdict.units
        return tuple(
            Quantity(name, units[name], own.values[:, j], own.errors[:, j], float(own.common[j]))
            for j, name in enumerate(own.names)
        )

    @cached_property
    def _shrunk(self) -> dict[str, dict[str, Measure]]:
        """Values drawn to the mean of all, by record and parameter."""
        return {
            name: {
                key: Measure(value=float(one.shrunk[r]), error=float(one.shrunk_error[r]))
                for key, one in self.verdict.populations.items()
                if np.isfinite(one.shrunk[r])
            }
            for r, name in enumerate(self.names)
        }

    @cached_property
    def trends(self) -> tuple[TrendSummary, ...]:
        """Every parameter against every condition and, where it has one, its speed; the surest first."""
        speeds = {name: (speed_condition(rows),) for name, rows in self.verdict.speeds.items()}
        pairs = [(y, x) for y in self.parameters for x in (*speeds.get(y.name, ()), *self.conditions)]
        return trends(self.names, pairs)

    def summary(self) -> SeriesSummary:
        """Content of ``summary.json``."""
        found = self.verdict
        inputs = self.study.input_files()
        return SeriesSummary(
            status=self.status,
            study=self.study.name,
            rig=self.study.kind,
            answer=found.answer,
            sentence=self.sentence,
            models=files.rival_summaries(found),
            laws=files.law_summaries(found),
            indistinguishable=found.alike if found.answer == "speed_law" else (),
            curves=tuple(files.speed_curve_summary(found, one) for one in found.curves),
            population={name: population_summary(one, found.units[name]) for name, one in found.populations.items()},
            records=files.record_summaries(found, self.names, self._with_speeds),
            trends=self.trends,
            checks=files.series_checks(found),
            advice=self._advice(),
            provenance=provenance(self.study, inputs, seed=self.seed, seconds=self.seconds),
        )

    def _advice(self) -> tuple[str, ...]:
        said = []
        if self.status != "ok":
            said.append("Run discover: something besides speed may be missing.")
        if self.answer == "speed_law":
            said.append("Fit study.toml of this result, which holds the winning model: fibrefit fit DIR/study.toml.")
        if self.answer == "per_record":
            said.append("Look at the trends: a condition other than speed may order the values of the records.")
        return tuple(said)

    def groups(self) -> Mapping[str, Mapping[str, Variable]]:
        """Arrays of ``result.h5``: each record's values, the curves, the predictions of records left out."""
        return files.series_groups(self.verdict, self.names)

    def to_dataframe(self) -> pd.DataFrame:
        """One row a record and base parameter.

        Returns
        -------
        pandas.DataFrame
            ``name``, ``record``, ``value``, ``std_error``, ``low``, ``high``, ``unit``, then every condition and the
            speed at which each parameter was determined, SI units.
        """
        from fibrefit.tables.frames import values_frame

        return values_frame(self._tidy())

    def _tidy(self) -> pd.DataFrame:
        """One row a record and base parameter, as ``table.csv`` and ``table.parquet`` hold it."""
        from fibrefit.workflow.together.tidy import tidy_frame, tidy_rows

        return tidy_frame(tidy_rows(self.names, self.parameters, self._with_speeds, self._shrunk))

    def write_data(self, directory: ResultDirectory) -> None:
        """Write ``summary.json``, ``result.h5``, ``study.toml`` of the winning model and the table."""
        winner = files.winning_study(self.study, self.verdict)
        write_parts(directory, self.summary(), self.groups(), winner)
        write_table(directory.path / "table", self._tidy())


@one_blas_thread
def series_study(study: Study | str | Path, *, seed: int = 0, progress: Progress | None = None) -> SeriesResult:
    """Ask a series of records whether one set of parameters serves all of them, a law of speed, or neither.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        With three records or more.
    seed : int
        Of the scatter of starts.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    SeriesResult
        With ``answer``, ``sentence``, ``summary()``, ``report()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    StudyError
        If there are too few records, or the model has a law of speed already, or none makes sense on the rig.
    DataError
        If a record is not understood.

    Examples
    --------
    >>> found = fibrefit.series_of(fibrefit.example("lubricated_guide"))
    >>> found.answer
    'speed_law'
    >>> found.sentence
    'One set of parameters does not serve all speeds: friction rises from ...
    >>> len(found.to_dataframe())  # three parameters of three records
    9
    """
    began, tell = time.perf_counter(), progress or quiet
    study = as_study(study)
    if len(study.records) < SHORTEST_SERIES:
        do = "Add records; of a single one, fit says what it holds."
        wanted = f"a series of {SHORTEST_SERIES} or more"
        raise StudyError(str(study.source), f"{len(study.records)} record{'s' * (len(study.records) != 1)}", wanted, do)
    tell("reading records", None)
    task = task_of(study, read_records(study))
    model = task.problem.model
    if any(parameter_of(effect) for effect in model.effects):
        do = "Leave it out: this command looks for it."
        raise StudyError(str(study.source), "a model with a law of speed", "constant parameters", do)
    asked = {law.parameter for law in laws_on(model.rig)}
    if not asked:
        raise StudyError(str(study.source), f"the rig {study.kind}", "one with a fibre or a guide", "")
    held = [slot.name for slot in task.problem.layout.slots if slot.name in asked and not (slot.free and slot.shared)]
    if held:
        do = "Leave out fixed and shared of them: this command asks whether they are constant."
        raise StudyError(str(study.source), f"{' and '.join(held)} fixed, or not shared", "free and shared", do)
    names = tuple(trace.name for trace in task.traces)
    return SeriesResult(study, names, compare_models(task, seed, tell), seed, time.perf_counter() - began)
