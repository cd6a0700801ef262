"""``sweep``: frequency sweep of a pendulum, and the files of the result."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import StudyError, UsageError
from fibrefit.core.limits import Progress
from fibrefit.core.paths import write_whole
from fibrefit.laws.law import FibreLaw, RigLaw, extends
from fibrefit.series.sweep import Branch, Conditions, Plan, SweptCurve, sweep
from fibrefit.simulation.model import Model
from fibrefit.store import ResultDirectory
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.check import status_by
from fibrefit.study.summaries.part import Variable
from fibrefit.study.summaries.results import SweepSummary
from fibrefit.workflow.prepare import model_of, refuse_places
from fibrefit.workflow.saved import FoundResult
from fibrefit.workflow.sweep_summary import curve_summary, sweep_checks

KIND = "inverted_pendulum"
CHANNELS = tuple((name, ROLES[name]) for name in ("angle", "force_1", "force_2"))


@dataclass(frozen=True, repr=False)
class Sweep(FoundResult):
    """A sweep that was carried out.

    Parameters
    ----------
    study : Study
    values : mapping of str to float in SI units
        Of the model's parameters.
    curves : tuple of SweptCurve
    seconds : float
        Wall time.
    """

    study: Study
    values: Mapping[str, float]
    curves: tuple[SweptCurve, ...]
    seconds: float

    def summary(self) -> SweepSummary:
        """Content of ``summary.json``."""
        frequencies, checks = self.curves[0].frequencies, sweep_checks(self.curves)
        runs = sum(len(frequencies) * len(curve.branches) for curve in self.curves)
        return SweepSummary(
            status=status_by(checks),
            study=self.study.name,
            rig=self.study.kind,
            effects=self.study.model.effects,
            parameters=dict(self.values),
            lowest_hz=float(frequencies[0]),
            highest_hz=float(frequencies[-1]),
            frequencies=len(frequencies),
            runs=runs,
            curves={curve.conditions.name: curve_summary(curve) for curve in self.curves},
            checks=checks,
            provenance=provenance(self.study, self.study.input_files(), seconds=self.seconds),
        )

    def groups(self) -> dict[str, dict[str, Variable]]:
        """Arrays of ``result.h5``."""
        return _groups(self.curves)

    def write_data(self, directory: ResultDirectory) -> None:
        """Write ``summary.json``, ``result.h5``, ``curves/<name>.csv`` and the study."""
        super().write_data(directory)
        folder = directory.path / "curves"
        folder.mkdir(parents=True, exist_ok=True)
        for curve, stem in zip(self.curves, _stems(self.curves), strict=True):
            write_whole(folder / f"{stem}.csv", _table(curve))


def sweep_study(study: Study | str | Path, *, progress: Progress | None = None) -> Sweep:
    """Frequency sweep (forward, backward, from rest) of the inverted pendulum of a study, as its ``[sweep]`` says.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        Of an inverted pendulum whose base parameters have initial values.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    Sweep
        With ``curves``, ``summary()``, ``report()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    UsageError
        If the study is of another rig.
    StudyError
        If a parameter has no initial value, or a curve no amplitude; if an effect is none that a sweep can follow.

    Examples
    --------
    >>> said = ["sweep.lowest=4.4 Hz", "sweep.highest=4.5 Hz"]
    >>> found = fibrefit.sweep(fibrefit.load_study(fibrefit.example("pendulum"), said))
    >>> float(found.curves[0].frequencies.max())
    4.5
    >>> found.to_dataframe()["unit"].tolist()
    ['N/m', 'N s/m']
    """
    study = as_study(study)
    if study.kind != KIND:
        raise UsageError(str(study.source), f"a study of the rig {study.kind}", f"one of {KIND}", "")
    began, model = time.perf_counter(), model_of(study)
    _refuse_what_changes(study, model)
    values = _values(study, model)
    curves = _conditions(study, model, values)
    on_progress = (lambda share: progress("sweeping", share)) if progress else None
    if progress:
        progress("sweeping", 0.0)
    found = sweep(model, values, curves, _plan(study), on_progress)
    return Sweep(study, values, found, time.perf_counter() - began)


def _refuse_what_changes(study: Study, model: Model) -> None:
    """Refuse effects without a part in a steady motion: of single records, over time, of gauges and of drives."""
    where, do = study.place_of("model.effects"), "Take it out of the model."
    refuse_places(model.effects, where, do)
    for effect in model.effects:
        if extends(effect) or not issubclass(effect, FibreLaw | RigLaw):
            got = f'the effect "{effect.name}", which changes with time, or is of a gauge or of the drive'
            raise StudyError(where, got, "effects of the fibres that are alike at every instant", do)


def _plan(study: Study) -> Plan:
    said: Any = study.sweep  # type: ignore[attr-defined]
    number = round((said.highest - said.lowest) / said.step + 1e-9)
    frequencies = said.lowest + said.step * np.arange(number + 1)
    return Plan(np.round(frequencies[frequencies <= said.highest * (1.0 + 1e-9)], 9), said.settle, said.sampling_rate)


def _values(study: Study, model: Model) -> dict[str, float]:
    declared = {parameter.name: parameter for parameter in model.parameters}
    values = {}
    for name, setting in study.settings(declared).items():
        if setting.initial is None:
            unit = "" if declared[name].unit == "-" else f" {declared[name].unit}"
            raise StudyError(
                f"{study.source}, parameters.{name}",
                "no initial",
                "a value: a sweep has no data to find it from",
                f'For example [parameters.{name}] initial = "{declared[name].typical:g}{unit}".',
            )
        values[name] = setting.initial
    return values


def _conditions(study: Study, model: Model, values: Mapping[str, float]) -> list[Conditions]:
    rig = study.rig
    curves = study.sweep.curves or (None,)  # type: ignore[attr-defined]
    found = []
    for curve in curves:
        name = study.name if curve is None else curve.name
        said = {key: getattr(curve, key, None) for key in type(rig).model_fields}
        for key, stated in study.found_constants.items():
            if said[key] not in (None, stated):
                got = f"another {key} than under [rig], where it is a parameter"
                do = f"Leave it out here, or state {key} without an uncertainty."
                raise StudyError(f'{study.source}, curve "{name}"', got, "one value for all curves", do)
        known = {key: getattr(rig, key) if value is None else value for key, value in said.items()}
        known |= {key: values[key] for key in study.found_constants}
        for key in ("amplitude", *type(rig).needed()):
            if known[key] is None:
                where = f"{study.source}, rig" if curve is None else f'{study.source}, curve "{name}"'
                raise StudyError(where, f"no {key}", "it under [rig] or in each curve of [sweep]", "")
        conditions = {c.name: c.typical if known[c.name] is None else known[c.name] for c in model.rig.conditions}
        found.append(Conditions(name, known["amplitude"], conditions))
    return found


def _stems(curves: tuple[SweptCurve, ...]) -> list[str]:
    from fibrefit.plots.save import file_names

    return file_names([curve.conditions.name for curve in curves])


def _columns(branch: Branch) -> dict[str, tuple[np.ndarray, str]]:
    """Arrays over frequency by the name of their column, with their units."""
    columns = {}
    for when, lowest, highest in (
        ("", branch.lowest, branch.highest),
        (" from the start", branch.first_lowest, branch.first_highest),
    ):
        for i, (channel, unit) in enumerate(CHANNELS):
            columns[f"{channel} min{when}"] = lowest[:, i], unit
            columns[f"{channel} max{when}"] = highest[:, i], unit
    return columns | {
        "periods": (branch.periods, "-"),
        "multiplier": (branch.multiplier, "-"),
        "overturned": (branch.overturned.astype(int), "-"),
        "simulated for": (branch.time, "s"),
    }


def _table(curve: SweptCurve) -> str:
    """CSV with a row for each frequency of each branch; empty where there is no value."""
    head = [f"{name} [{unit}]" for name, (_, unit) in _columns(curve.branches["rest"]).items()]
    lines = [",".join(["begun from", "frequency [Hz]", *head])]
    for name, branch in curve.branches.items():
        columns = [values for values, _ in _columns(branch).values()]
        for frequency, *row in zip(curve.frequencies, *columns, strict=True):
            cells = ["" if np.isnan(value) else f"{value:.9g}" for value in row]
            lines.append(",".join([name, f"{frequency:.9g}", *cells]))
    return "\n".join(lines) + "\n"


def _groups(curves: tuple[SweptCurve, ...]) -> dict[str, dict[str, Variable]]:
    """A group for each branch of each curve."""
    groups = {}
    for curve, stem in zip(curves, _stems(curves), strict=True):
        for name, branch in curve.branches.items():
            variables = {"frequency": Variable(curve.frequencies, ("frequency",), "Hz", "Of the drive.")}
            for column, (values, unit) in _columns(branch).items():
                variables[column.replace(" ", "_")] = Variable(values, ("frequency",), unit, column)
            groups[f"{stem}_{name}"] = variables
    return groups
