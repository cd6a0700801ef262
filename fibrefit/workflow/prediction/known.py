"""What a result says that a prediction needs: the model, its values, how sure they are, and what it left over."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from scipy.special import stdtrit

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import sha256_of
from fibrefit.problem import parameter_slots
from fibrefit.simulation.model import Model
from fibrefit.store.hdf5 import read_result
from fibrefit.store.summary import files_of_result, folder_of_result, read_summary
from fibrefit.study import Study, load_study
from fibrefit.study.summaries.part import Z_95, Groups, Part, Variable
from fibrefit.study.summaries.results import (
    BetweenRecordsSummary,
    ChannelGap,
    FitResultSummary,
    ParameterSummary,
    PosteriorParameter,
    PosteriorSummary,
)
from fibrefit.workflow.prepare import model_of


@runtime_checkable
class HasValues(Protocol):
    """A result whose values can be held against other records, see `Predicts`."""

    def predicting(self) -> Study:
        """The study with the model that the values belong to."""

    def summary(self) -> Any:
        """What was found."""

    def groups(self) -> Groups:
        """Arrays of it."""


class Difference(NamedTuple):
    """What a new record may differ by from the mean of a value.

    Parameters
    ----------
    variance : float, in SI units squared
        It is part of the covariance of the values.
    freedom : float
        Degrees of freedom with which that is known; infinite where a posterior of it is integrated over.
    """

    variance: float
    freedom: float = np.inf


@dataclass(frozen=True)
class Known:
    """A model with values.

    Parameters
    ----------
    name : str
        What the result is called.
    study : Study
        With the model of the result; files it names are found from there.
    parameters : mapping of str to ParameterSummary
        Those all records share, and the mean of those each record has its own of.
    names : tuple of str
        Parameters whose error bars are known.
    covariance : (n_name, n_name)
        Differences between records included.
    gaps : mapping of channel to ChannelGap
        What the result left over of its own records; empty where it does not say.
    digests : frozenset of str
        SHA-256 of the files the result rests on.
    differences : mapping of str to Difference
        Of the parameters that differ from record to record.
    files : mapping of str to str
        SHA-256 of the files it was read from, by path; empty where it was on no disk.
    """

    name: str
    study: Study
    parameters: Mapping[str, ParameterSummary]
    names: tuple[str, ...]
    covariance: np.ndarray
    gaps: Mapping[str, ChannelGap]
    digests: frozenset[str]
    differences: Mapping[str, Difference] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


def as_known(result: HasValues | PathLike[str] | str | Known) -> Known:
    """What a result says, from wherever it is.

    Raises
    ------
    UsageError
        If it is no result with values.
    """
    if isinstance(result, Known):
        return result
    if isinstance(result, HasValues):
        model = result.predicting()
        return known_of(result.summary(), result.groups(), model, f"the result of {model.name}")
    if isinstance(result, str | PathLike):
        return known_from(Path(result))
    raise UsageError("predict", f"a {type(result).__name__}", "a fit, a discovery, a posterior or its folder", "")


HOLD_VALUES = (FitResultSummary, PosteriorSummary)
"""Summaries of results that hold values of one model."""


def known_from(folder: Path) -> Known:
    """What a result on disk says.

    Parameters
    ----------
    folder : pathlib.Path
        Of a fit, a discovery or a posterior.

    Raises
    ------
    UsageError
        If it is a result of another kind.
    DataError
        If it is none.
    """
    folder = folder_of_result(folder)
    files = {file.as_posix(): sha256_of(file) for file in files_of_result(folder)}
    summary, name = read_summary(folder), folder.as_posix()
    if not isinstance(summary, HOLD_VALUES):
        raise _without_values(name)
    if not (folder / "result.h5").is_file():
        got = "a result of which only the summary was kept, as batch keeps it"
        raise UsageError(name, got, "one with its result.h5", "Fit its record by itself: fibrefit fit.")
    groups, _ = read_result(folder / "result.h5")
    # Its own records have been seen: a result that was handed on is predicted from without them.
    study = load_study(folder, all_missing=True)
    return replace(known_of(summary, groups, study, name), files=files)


def _without_values(name: str) -> UsageError:
    expected = "the result of fibrefit fit, discover or sample"
    return UsageError(name, "a result without values of a model", expected, "Name another folder.")


def known_of(summary: Part, groups: Groups | Mapping[str, Mapping[str, Variable]], study: Study, name: str) -> Known:
    """What a result says, from its parts.

    Parameters
    ----------
    summary : Part
        Its summary.
    groups : mapping of group to mapping of name to Variable
        Of its ``result.h5``.
    study : Study
        With its model.

    Raises
    ------
    UsageError
        If it is of a kind that holds no values of a model, failed its checks, or lacks the value of a parameter.
    """
    if not isinstance(summary, HOLD_VALUES):
        raise _without_values(name)
    if summary.status == "failed":
        do = "Mend it first: fibrefit show tells which check failed."
        raise UsageError(name, "a result that failed its checks", "values that can be relied on", do)
    model = model_of(study)
    if isinstance(summary, FitResultSummary):
        found = summary.parameters
        each = [one.parameters for one in summary.records.values()]
        listed, whole = _of_estimate(groups["estimate"])
    else:
        found = _marginals(summary.parameters)
        each = [_marginals(one) for one in summary.records.values()]
        listed, whole = _of_draws(groups["posterior"], tuple(found))
        found |= _held(study, model)  # a posterior tells of what was free
    declared = [parameter.name for parameter in model.parameters]
    # A constant of the rig that was found is one of its conditions still, and no record's own.
    of_records = {own.name for own in (*model.rig.nuisances, *model.rig.conditions)} - set(declared)
    own, differences = _means(each, declared)
    parameters = {key: one for key, one in found.items() if key not in of_records} | own
    _refuse_others(name, parameters.keys(), declared)
    names, covariance = _errors(listed, whole, parameters)
    unsure = [name for name, size in zip(names, np.diag(covariance), strict=True) if size > 0.0]
    told = summary.between_records
    between = {n: _between(told[n], parameters[n]) for n in unsure if n in told}
    covariance = covariance + np.diag([between[n].variance if n in between else 0.0 for n in names])
    origin = summary.provenance
    digests = frozenset() if origin is None else frozenset(origin.inputs.values())
    return Known(name, study, parameters, names, covariance, summary.gap.channels, digests, differences | between)


def _between(found: BetweenRecordsSummary, parameter: ParameterSummary) -> Difference:
    """Of a value that is shared, from all that its records leave open: results of before had the median alone."""
    return Difference(((found.sd if found.rms is None else found.rms) * parameter.value) ** 2)


def _refuse_others(name: str, found: Collection[str], declared: Collection[str]) -> None:
    """Refuse values of other parameters than a model declares."""
    lacking, beyond = (sorted(set(these) - set(those)) for these, those in ((declared, found), (found, declared)))
    told = (("no value of", lacking), ("a value of what the model does not have:", beyond))
    if got := "; ".join(f"{what} {', '.join(names)}" for what, names in told if names):
        raise UsageError(name, got, "one of every parameter of its model", "Fit its study anew: fibrefit fit.")


def _means(
    each: Sequence[Mapping[str, ParameterSummary]], declared: Sequence[str]
) -> tuple[dict[str, ParameterSummary], dict[str, Difference]]:
    """Mean of parameters that each record has its own of, with the error of a new record's, and their scatter."""
    own: dict[str, list[ParameterSummary]] = {}
    for record in each:
        for name in declared:
            if name in record:
                own.setdefault(name, []).append(record[name])
    # A single one tells nothing of how others scatter: how well it is known itself is the least.
    several = {name: of for name, of in own.items() if len(of) > 1}
    differences = {name: _scatter([one.value for one in of]) for name, of in several.items()}
    means = {name: _mean(of, differences[name]) for name, of in several.items()}
    return {name: of[0] for name, of in own.items()} | means, differences


def _scatter(values: Sequence[float]) -> Difference:
    freedom = len(values) - 1
    return Difference(float(np.var(values, ddof=1)) * widened(freedom) ** 2, float(freedom))


def _mean(of: Sequence[ParameterSummary], scatter: Difference) -> ParameterSummary:
    """The mean, with the error of a new record's value: that differs from it, which itself is known from a few."""
    error = float(np.sqrt(scatter.variance * (1.0 + 1.0 / len(of))))
    update = {"value": float(np.mean([one.value for one in of])), "std_error": error, "interval_95": None}
    return of[0].model_copy(update=update)


def widened(freedom: float) -> float:
    """Half of the 95 % interval of Student's law over that of the normal law: error bars are those of the latter."""
    return float(stdtrit(freedom, 0.975)) / Z_95


def _errors(
    listed: tuple[str, ...], whole: np.ndarray, parameters: Mapping[str, ParameterSummary]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and covariance of the parameters whose error bars are known, out of that of all free values."""
    shared = [i for i, name in enumerate(listed) if name in parameters and np.isfinite(whole[i, i])]
    # Values each record has its own of: the next record has another one.
    own = [n for n, one in parameters.items() if n not in listed and one.free and one.std_error]
    covariance = np.zeros((len(shared) + len(own),) * 2)
    covariance[: len(shared), : len(shared)] = whole[np.ix_(shared, shared)]
    for i, name in enumerate(own, len(shared)):
        covariance[i, i] = float(parameters[name].std_error or 0.0) ** 2
    return (*(listed[i] for i in shared), *own), covariance


def _of_estimate(group: Mapping[str, Variable]) -> tuple[tuple[str, ...], np.ndarray]:
    names = tuple(str(name) for name in group["parameter"].values)
    return names, np.asarray(group["covariance"].values, dtype=float)


def _of_draws(group: Mapping[str, Variable], names: tuple[str, ...]) -> tuple[tuple[str, ...], np.ndarray]:
    if not names:  # each record has its own of all values
        return names, np.zeros((0, 0))
    drawn = np.array([np.ravel(group[name].values) for name in names])
    return names, np.atleast_2d(np.cov(drawn))


def _marginals(found: Mapping[str, PosteriorParameter]) -> dict[str, ParameterSummary]:
    return {
        name: ParameterSummary(value=one.mean, std_error=one.sd, unit=one.unit, interval_kind="posterior")
        for name, one in found.items()
        if "noise." not in name
    }


def _held(study: Study, model: Model) -> dict[str, ParameterSummary]:
    """Values at which a study holds parameters of its model."""
    slots = parameter_slots(model, study.settings({parameter.name: parameter for parameter in model.parameters}))
    held = {slot.name: (slot, slot.fixed_in(0)) for slot in slots}
    return {
        name: ParameterSummary(value=value, interval_95=(value, value), unit=slot.unit, free=False)
        for name, (slot, value) in held.items()
        if value is not None
    }
