"""``plan``: the next records, ranked by what they would add."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

import numpy as np

from fibrefit.core.errors import StudyError, UsageError, did_you_mean, refuse_unknown
from fibrefit.core.limits import Progress, quiet
from fibrefit.core.threads import one_blas_thread
from fibrefit.discovery.design.menu import duration_of, motions_of, reach_of
from fibrefit.discovery.design.plan import Purpose, Standing, Worth, by_worth, options_of, worths
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.setup import set_up
from fibrefit.fitting.identify import identify
from fibrefit.fitting.thresholds import FEW_STARTS
from fibrefit.laws.law import Effect
from fibrefit.problem import Task
from fibrefit.report.sentences.discovery import further_record, shown_condition, shown_probability
from fibrefit.rigs.rig import Rig
from fibrefit.simulation.model import Experiment
from fibrefit.store import read_summary
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.check import Status
from fibrefit.study.summaries.discovery import DiscoverySummary, FurtherRecord, PlanSummary
from fibrefit.workflow.design.doubts import doubts_of_fit, few_by_name
from fibrefit.workflow.design.rivals import rivals_at_hand
from fibrefit.workflow.discovery.candidates import candidates_of, is_lasting
from fibrefit.workflow.prepare import is_planned, task_of, task_to_fit
from fibrefit.workflow.saved import FoundResult

RECORD = "record"
"""What a record costs by itself, among the costs."""
MINUTES = {RECORD: 2.0, "lift": 1.0, "added_mass": 5.0, "inclination": 15.0, "preload": 5.0}
"""Usual costs in minutes: of a record, and of a condition that none of those at hand has."""
OTHERWISE = 5.0


@dataclass(frozen=True)
class Aim:
    """What a plan is made for.

    Parameters
    ----------
    purpose : {"errors", "rivals", "power"}, optional
        What records are ranked by; rivals where there are some, else error bars.
    rivals : tuple of str
        Two effects of which one is missing; those that an earlier search could not tell apart where empty.
    minutes : mapping of str to float
        Costs that differ from the usual ones, by condition; ``record`` is that of a record.
    only, exclude : tuple of str
        Effects whose detection limits count.
    """

    purpose: Purpose | None = None
    rivals: tuple[str, ...] = ()
    minutes: Mapping[str, float] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a purpose that nobody knows."""
        if self.purpose is not None:
            refuse_unknown("purpose", self.purpose, get_args(Purpose))


@dataclass(frozen=True, repr=False)
class RecordPlan(FoundResult):
    """The next records, the most useful first.

    Parameters
    ----------
    study : Study
        Of the records at hand, without the rivals.
    rig : Rig
    purpose : str
    rivals : tuple of str
        Two, or none.
    standing : Standing
        Of the rivals in the records at hand.
    further : tuple of (Worth, float)
        Each with its cost in minutes.
    seconds : float
    remarks : tuple of str
        What a reader should know besides.
    status : {"ok", "suspect", "failed"}
        Of the fit it rests on.
    settings : mapping of str to str
        What it was asked for besides, by option.
    reach : mapping of str to (float, float)
        Least and most of each condition that the further records have, in SI units.
    """

    study: Study
    rig: Rig
    purpose: Purpose
    rivals: tuple[str, ...]
    standing: Standing
    further: tuple[tuple[Worth, float], ...]
    seconds: float
    remarks: tuple[str, ...] = ()
    status: Status = "ok"
    settings: Mapping[str, str] = field(default_factory=dict)
    reach: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def best(self) -> Choice:
        """The record to take next."""
        return self.further[0][0].choice

    def summary(self) -> PlanSummary:
        """Content of ``summary.json``."""
        records = tuple(record.label for record in self.study.records)
        return PlanSummary(
            status=self.status,
            study=self.study.name,
            rig=self.rig.kind,
            records=records,
            purpose=self.purpose,
            rivals=(self.rivals[0], self.rivals[1]) if self.rivals else None,
            probability_distinguished_now=self.standing.now if self.rivals else None,
            ahead=self.standing.ahead if self.rivals else None,
            further=tuple(self._record(worth, minutes, records) for worth, minutes in self.further),
            reach=dict(self.reach),
            limits_stated=tuple(name for name in self.reach if name in self.rig.possible),
            remarks=self.remarks,
            provenance=provenance(
                self.study, self.study.input_files(), seconds=self.seconds, settings=dict(self.settings)
            ),
        )

    def _record(self, worth: Worth, minutes: float, records: Sequence[str]) -> FurtherRecord:
        choice, rivals = worth.choice, bool(self.rivals)
        return FurtherRecord(
            like=records[choice.record],
            conditions=dict(choice.conditions),
            pace=choice.pace,
            size=choice.size,
            minutes=minutes,
            errors=worth.errors,
            newly_determined=worth.determined,
            limits=worth.limits,
            newly_shown=worth.shown,
            probability_distinguished=worth.distinguished if rivals else None,
            nats=worth.nats if rivals else None,
            looked_into=worth.refitted if rivals else None,
            says=_sentence(worth, minutes, records[choice.record], self.rivals),
        )


FROM_SLOPES = "Predicted from slopes about the values found,"
AS_MEASURED = f"{FROM_SLOPES} in the noise that the measured records leave; records may differ as these do."
ALONE = (
    f"{FROM_SLOPES} in the noise that the measured record leaves; by how much records differ one alone does not say, "
    "and what is usual counts."
)
AS_PLANNED = f"{FROM_SLOPES} in white noise, and records are alike: nothing is measured yet."
BY_SLOPES = (
    "The rivals were fitted to {} of {} further records, those that would come first by slopes; for the others slopes "
    "speak alone, and they mostly promise too much."
)


@one_blas_thread
def plan_study(study: Study | str | Path, aim: Aim | None = None, *, progress: Progress | None = None) -> RecordPlan:
    """Rank the records that could be taken next by what they would add to those of a study, measured or planned.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        Or its file, or a folder with one: that of a discovery brings the effects it could not tell apart.
    aim : Aim, optional
        What it is made for; the error bars of the parameters, or what tells rivals apart where there are some.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    RecordPlan
        With ``further`` (records with what they add and cost), ``best``, ``report()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    UsageError
        If the rivals or effects are not known, or the purpose lacks rivals.
    StudyError
        If the rig leaves no choice of further records.

    Examples
    --------
    >>> from fibrefit.workflow.design.plan import Aim
    >>> planned = fibrefit.plan(fibrefit.example("drop_series"), Aim(only=("guide.*",)))
    >>> sorted(planned.further[0][0].errors)
    ['damping', 'friction', 'stiffness']
    """
    began, study, aim, tell = time.perf_counter(), as_study(study), aim or Aim(), progress or quiet
    # A plan for anything else leaves the model as it is, the effects that a search named in it.
    rivals = aim.rivals or (_of_discovery(study) if aim.purpose in (None, "rivals") else ())
    purpose = aim.purpose or ("rivals" if rivals else "errors")
    _refuse(rivals, purpose, aim.minutes)
    study = _without(study, rivals)
    task = task_of(study)
    choices, rig = options_of(task), task.problem.model.rig
    if len(choices) == len(study.records):
        do = "Widen its [limits]." if rig.possible else "Plan its inputs by hand."
        raise StudyError(str(study.source), f"a rig {rig.kind}", "one whose further records could differ", do)
    # What happened in records at hand is no part of a further one, unless it is asked for by its very name.
    sought = candidates_of(study, aim.only, aim.exclude)
    effects = {name: effect for name, effect in sought.items() if name in aim.only or is_lasting(effect)}
    named = _named(study, rivals)
    _refuse_costs(aim.minutes, {RECORD, *(name for choice in choices for name in choice.conditions)})
    fit = None if is_planned(study) else identify(task_to_fit(study, task), FEW_STARTS, progress=progress)
    search = set_up(task, fit, tuple(effects.values()), tell)
    found, remarks, beside, ahead = rivals_at_hand(task, named, fit, tell)
    tell("weighing the records that could be taken", None)
    cost = {**MINUTES, **aim.minutes}
    priced = [(choice, _minutes(choice, task.problem.observations.experiment, cost)) for choice in choices]
    ranked, standing = worths(search, found, priced, beside, ahead)
    # Where rivals stand beside the model, it is known to lack something.
    remarks += (*_left_out(study, len(choices) - len(ranked), len(choices)), *doubts_of_fit(None if named else fit))
    remarks += (*_beyond(study, task), *_predicted(study, fit is None, ranked))
    further = tuple((worth, worth.minutes) for worth in by_worth(purpose, ranked))
    return RecordPlan(
        study, rig, purpose, tuple(rivals), standing, further, time.perf_counter() - began, remarks,
        "ok" if fit is None or named else fit.status, _settings(aim), reach_of(task),
    )  # fmt: skip


def _beyond(study: Study, task: Task) -> tuple[str, ...]:
    """Remark on a motion that went beyond what the study says the rig can do."""
    said = []
    for name, known in motions_of(task).items():
        least, most = study.possible.get(name, (0.0, math.inf))
        farthest = max(known, key=lambda at: max(least - at, at - most))
        if not least <= farthest <= most:
            said.append(f"{name} {shown_condition(name, float(farthest))}")
    if not said:
        return ()
    return (f"Records at hand are beyond the [limits] of the study: {few_by_name(said)}.",)


def _predicted(study: Study, planned: bool, ranked: Sequence[Worth]) -> tuple[str, ...]:
    """Remarks on how it is known what records would add."""
    said = [AS_PLANNED if planned else AS_MEASURED if len(study.records) > 1 else ALONE]
    if refitted := sum(worth.refitted for worth in ranked):
        said.append(BY_SLOPES.format(refitted, len(ranked)))
    return tuple(said)


def _settings(aim: Aim) -> dict[str, str]:
    costs = ", ".join(f"{name}={minutes:g}" for name, minutes in aim.minutes.items())
    lists = {"only": aim.only, "exclude": aim.exclude, "rivals": aim.rivals}
    given = {"for": aim.purpose or "", "cost": costs, **{name: ", ".join(names) for name, names in lists.items()}}
    return {name: value for name, value in given.items() if value}


def _left_out(study: Study, number: int, offered: int) -> tuple[str, ...]:
    """Remark on further records that cannot be simulated; refused where none can."""
    if number == offered:
        do = "Fit the study first, and look at the values of its parameters."
        raise StudyError(str(study.source), f"{number} further records, none of which can be simulated", "one", do)
    if not number:
        return ()
    return (f"{number} of {offered} records that could be taken cannot be simulated, and are left out.",)


def _refuse(rivals: Sequence[str], purpose: str, minutes: Mapping[str, float]) -> None:
    for name, cost in minutes.items():
        if not 0.0 <= cost < math.inf:
            raise UsageError(f'cost of "{name}"', f"{cost:g} minutes", "a number of minutes, 0 or more", "")
    if rivals and not len(rivals) == len(set(rivals)) == 2:
        raise UsageError("rivals", ", ".join(rivals), "two effects", "")
    if purpose == "rivals" and not rivals:
        do = "Name two with --rivals A,B, or give the folder of a discovery that could not tell two apart."
        raise UsageError("purpose", "rivals, and none are known", "two effects", do)


def _named(study: Study, rivals: Sequence[str]) -> list[type[Effect]]:
    """Rivals by their names, refused before any fit."""
    known = candidates_of(study, only=tuple(rivals)) if rivals else {}
    for name in rivals:
        if name not in known:
            raise UsageError("rivals", name, "an effect", did_you_mean(name, known) or "")
    return [known[name] for name in rivals]


def _refuse_costs(minutes: Mapping[str, float], known: set[str]) -> None:
    for name in minutes:
        if name not in known:
            expected = f"one of {', '.join(sorted(known))}"
            raise UsageError(f'cost of "{name}"', "no condition of a record", expected, did_you_mean(name, known) or "")


def _is_foreign(file: Path) -> bool:
    """Whether a summary is one of another program, whose file is called alike."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return not (isinstance(found, dict) and str(found.get("schema", "")).startswith("fibrefit/"))


def _of_discovery(study: Study) -> tuple[str, ...]:
    """The first two effects that a search could not tell apart, where the study is its result."""
    folder = study.source.parent
    if not (folder / "summary.json").is_file() or _is_foreign(folder / "summary.json"):
        return ()
    summary = read_summary(folder)
    pairs = summary.cannot_tell_apart if isinstance(summary, DiscoverySummary) else ()
    return pairs[0][:2] if pairs else ()


def _without(study: Study, effects: Sequence[str]) -> Study:
    """A study without some effects in its model."""
    kept = tuple(name for name in study.model.effects if name not in effects)
    parameters = {n: table for n, table in study.parameters.items() if n.rpartition(".")[0] not in effects}
    model = study.model.model_copy(update={"effects": kept})
    return study.model_copy(update={"model": model, "parameters": parameters})


def _minutes(choice: Choice, experiment: Experiment, cost: Mapping[str, float]) -> float:
    """Cost of a record: its own, that of each condition that none at hand has, and what it lasts longer."""
    minutes = (
        cost[RECORD] + (duration_of(experiment, choice) - duration_of(experiment, Choice(choice.record, {}))) / 60.0
    )
    for name, value in choice.conditions.items():
        if not np.isclose(np.asarray(experiment.conditions[name], dtype=float), value).any():
            minutes += cost.get(name, OTHERWISE)
    return minutes


def _sentence(worth: Worth, minutes: float, record: str, rivals: Sequence[str]) -> str:
    said = []
    if rivals:
        said.append(
            f"it tells {rivals[0]} from {rivals[1]} with a probability of {shown_probability(worth.distinguished)} % "
            f"(expected log likelihood ratio {worth.nats:.3g}{'' if worth.refitted else ', by slopes alone'})"
        )
    if worth.determined:
        said.append(f"it determines {few_by_name(worth.determined)}, which the records at hand do not")
    if worth.shown:
        said.append(f"it shows {few_by_name(worth.shown)}, which the records at hand do not")
    if worth.errors:
        name = min(worth.errors, key=lambda name: worth.errors[name])
        said.append(f"the standard error of {name} falls by {100.0 * (1.0 - worth.errors[name]):.0f} %")
    if worth.limits:
        said.append(f"detection limits fall by {100.0 * (1.0 - worth.limit):.0f} % on average")
    return f"{further_record(record, worth.choice)} ({minutes:.3g} min): {', '.join(said)}."
