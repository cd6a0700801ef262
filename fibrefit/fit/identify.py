"""Least-squares identification from start to verdict."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from fibrefit.core.check import Check
from fibrefit.core.errors import DataError
from fibrefit.fit import judge, uncertainty
from fibrefit.fit.advice import advice
from fibrefit.fit.identifiability import weaknesses
from fibrefit.fit.multistart import scattered, search, table
from fibrefit.fit.optimum import optimum
from fibrefit.fit.profile import profile_interval
from fibrefit.fit.result import ChannelGap, Estimate, Gap, Identification, Starts
from fibrefit.fit.second_opinion import second_opinion
from fibrefit.fit.solve import descend, gram_at, widths
from fibrefit.fit.structure import Residuals, structure_checks
from fibrefit.problem.input_error import Waves, corrected, input_errors
from fibrefit.problem.phases import Motion, motion
from fibrefit.problem.problem import Problem, gram_root
from fibrefit.problem.task import Task

Progress = Callable[[str, float | None], None]
Stop = Callable[[], bool]
Z_95 = 1.959964


def identify(
    task: Task,
    starts: int = 32,
    seed: int = 0,
    *,
    robust: bool = False,
    profile: bool = False,
    waves: Waves | None = None,
    progress: Progress | None = None,
    stop: Stop = lambda: False,
) -> Identification:
    """Fit from many starts, measure the uncertainty, and put the result to its checks.

    Parameters
    ----------
    task : Task
    starts : int
        Number of starts, the one from the data included.
    seed : int
        Of the scatter of starts.
    robust : bool
        Let residuals beyond `SOFT_BEYOND` times the noise count less than quadratically.
    profile : bool
        Give shared parameters profile-likelihood intervals.
    waves : mapping of input to (n_record, n_wave), optional
        Errors of measured inputs from an earlier identification, to begin with.
    progress : callable, optional
        Told what is being done and the share that is finished.
    stop : callable
        Asked now and then whether to conclude with what there is; the result then fails a check that says so.

    Returns
    -------
    Identification

    Raises
    ------
    DataError
        If the model cannot be simulated from any start.
    KeyboardInterrupt
        If it is stopped before anything is known.
    """
    began, tell = time.perf_counter(), progress or (lambda what, share: None)
    task = _softened(task) if robust else task
    searched = replace(task, problem=corrected(task.problem, input_errors(task), waves)) if waves else task
    problem = searched.problem
    tell("compiling", 0.0)
    width = widths(problem, problem.layout.free(task.start))
    found = _search(searched, width, starts, seed, tell, stop)
    _refuse_if_lost(found, problem.layout.records)
    tell("second solver", 0.87)
    values, agreed = _settled(searched, width, found, stop)
    tell("uncertainty", 0.9)
    found_all = _concluded(task, found, values, agreed, waves)
    if profile:
        tell("profiles", 0.95)
        found_all = _profiled(found_all, width, task.counts[-1:], stop)
    if stop():
        found_all = replace(found_all, checks=(judge.interrupted(found), *found_all.checks))
    return replace(found_all, seconds=time.perf_counter() - began)


SOFT_BEYOND = 3.0


def _refuse_if_lost(found: Starts, records: tuple[str, ...]) -> None:
    if not np.isfinite(found.cost).any():
        do = "Check lift, mass and noise, and the initial values and bounds of the parameters."
        names = ", ".join(records[:3])
        raise DataError(names, "no start of the search can be simulated", "values that a motion follows from", do)


def _softened(task: Task) -> Task:
    problem = task.problem
    return replace(task, problem=Problem(problem.model, problem.layout, problem.observations, SOFT_BEYOND))


def _profiled(found: Identification, width: np.ndarray, whole: np.ndarray, stop: Stop) -> Identification:
    estimates = list(found.estimates)
    for i, (_, record) in enumerate(found.problem.layout.entries):
        errors = estimates[i].std_errors
        if record is None and np.isfinite(estimates[i].std_error) and not stop():
            interval = profile_interval(
                found.problem, found.values, i, errors["white"], estimates[i].std_error, width, whole
            )
            estimates[i] = replace(estimates[i], interval_95=interval, interval_kind="profile likelihood")
    return replace(found, estimates=tuple(estimates))


def _search(task: Task, width: np.ndarray, number: int, seed: int, tell: Progress, stop: Stop) -> Starts:
    problem = task.problem
    began = scattered(problem.layout, task.start, task.spread, number, seed)
    told = lambda share: tell("searching from many starts", 0.05 + 0.8 * share)  # noqa: E731
    return table(problem.layout, began, search(problem, problem.layout.free(began), width, task.ladders, told, stop))


def _concluded(task: Task, starts: Starts, values: np.ndarray, agreed: Check, waves: Waves | None) -> Identification:
    at = optimum(task, values, waves)
    problem, values, scores, linear = at.problem, at.values, at.scores, at.linear
    rate = 1.0 / float(np.diff(np.asarray(problem.observations.experiment.times[0])).mean())
    covariances = _covariances(scores, rate)
    # Whatever one of them sees is there: the largest is the one to be believed.
    method = max(covariances, key=lambda name: _size(problem, covariances[name]))
    covariance = covariances[method]
    errors = {name: np.sqrt(np.diag(matrix)) for name, matrix in covariances.items()}
    estimates = _estimates(problem, values, errors, method)
    moved = motion(problem, jnp.asarray(values))
    gap, record_gaps = _gaps(task, moved.readings)
    residuals = _residuals(task, linear.residuals, moved)
    weak = weaknesses(problem.layout, values, covariance, scores.normal_matrix())
    checks = (
        judge.finite(linear.residuals, moved.trouble, problem.layout.records),
        judge.converged(
            at.promised([not estimate.at_bound for estimate in estimates]), bool(np.isfinite(starts.cost.min()))
        ),
        agreed,
        judge.starts_agree(starts),
        judge.inside_bounds([estimate.name for estimate in estimates if estimate.at_bound]),
        judge.determined(weak),
        judge.noise_seen(dict(task.noise), task.noise_given),
        judge.gap_is_noise(gap, at.expected_gap),
        *judge.inputs_within_noise(at.input_errors),
        *structure_checks(residuals),
    )
    return Identification(
        problem=problem,
        values=values,
        covariance=covariance,
        method=method,
        inflation=_inflation(problem, errors, method),
        estimates=estimates,
        gap=gap,
        expected_gap=at.expected_gap,
        input_errors=at.input_errors,
        waves=at.waves,
        record_gaps=record_gaps,
        noise=task.noise,
        readings=moved.readings,
        residuals=linear.residuals,
        motion=moved,
        starts=starts,
        checks=checks,
        advice=advice(problem, values, scores.normal_matrix(), covariance, weak, checks),
        seconds=0.0,
    )


def _covariances(scores: uncertainty.Scores, rate: float) -> dict[str, np.ndarray]:
    normal, prior = scores.normal_matrix(), scores.prior_matrix()
    middles = {
        "white": uncertainty.white(scores),
        "spectrum": uncertainty.stationary(scores, rate) + prior,
        "newey_west": uncertainty.newey_west(scores) + prior,
        "block_bootstrap": uncertainty.block_bootstrap(scores) + prior,
    }
    return {name: uncertainty.sandwich(normal, middle) for name, middle in middles.items()}


def _shared(problem: Problem) -> list[int]:
    return [i for i, (_, record) in enumerate(problem.layout.entries) if record is None]


def _size(problem: Problem, covariance: np.ndarray) -> float:
    variance = np.diag(covariance)[_shared(problem)]
    # What the data do not see is infinite by every method, and would make them all alike.
    variance = variance[np.isfinite(variance)]
    return float(np.sum(np.log(np.maximum(variance, 1e-300)))) if len(variance) else 0.0


def _inflation(problem: Problem, errors: Mapping[str, np.ndarray], method: str) -> float:
    shared = _shared(problem) or list(range(problem.layout.size))
    white, honest = errors["white"][shared], errors[method][shared]
    seen = np.isfinite(honest) & (white > 0.0)
    return float(np.median(honest[seen] / white[seen])) if seen.any() else float("nan")


def _estimates(
    problem: Problem, values: np.ndarray, errors: Mapping[str, np.ndarray], method: str
) -> tuple[Estimate, ...]:
    found = []
    layout = problem.layout
    for i, (slot, record) in enumerate(layout.entries):
        value, error, limits = float(values[i]), float(errors[method][i]), slot.range
        low, high = max(value - Z_95 * error, limits.lower), min(value + Z_95 * error, limits.upper)
        found.append(
            Estimate(
                name=slot.name,
                unit=slot.unit,
                record=None if record is None else layout.records[record],
                value=value,
                std_error=error,
                interval_95=(low, high),
                at_bound=judge.at_bound(value, error, limits),
                std_errors={name: float(column[i]) for name, column in errors.items()},
            )
        )
    return tuple(found + _held(problem))


def _held(problem: Problem) -> list[Estimate]:
    found = []
    for slot in problem.layout.slots:
        names = (None,) if len(slot.fixed) == 1 else problem.layout.records
        for name, value in zip(names, slot.fixed, strict=False):
            if value is not None:
                found.append(Estimate(slot.name, slot.unit, name, value, float("nan"), (value, value), free=False))
    return found


def _gaps(task: Task, readings: Mapping[str, np.ndarray]) -> tuple[Gap, Mapping[str, Gap]]:
    data, names = task.problem.observations, task.problem.layout.records
    gaps: dict[str, dict[str, ChannelGap]] = {name: {} for name in names}
    whole: dict[str, ChannelGap] = {}
    for channel, reading in readings.items():
        weight = np.asarray(data.weight[channel])
        counted = weight > 0.0
        error = np.where(counted, np.asarray(data.measured[channel]) - reading, 0.0)
        sigma = 1.0 / weight.max(axis=1)
        for r, name in enumerate(names):
            rms = float(np.sqrt(np.sum(error[r] ** 2) / max(counted[r].sum(), 1)))
            gaps[name][channel] = ChannelGap(rms, float(sigma[r]), task.units[channel])
        number = counted.sum(axis=1)
        rms, noise = (float(np.sqrt(np.sum(part) / number.sum())) for part in (error**2, sigma**2 * number))
        whole[channel] = ChannelGap(rms, noise, task.units[channel])
    return whole, gaps


def _residuals(task: Task, scaled: np.ndarray, moved: Motion) -> Residuals:
    data, channels = task.problem.observations, task.problem.model.rig.channels
    weight = np.stack([np.asarray(data.weight[c]) for c in channels], axis=1)
    times = np.asarray(data.experiment.times)
    return Residuals(
        scaled=scaled,
        counted=weight > 0.0,
        counts=np.asarray(data.experiment.count),
        rate=float(1.0 / np.diff(times[0]).mean()),
        channels=channels,
        sigma=1.0 / weight.max(axis=2),
        noise=task.noise,
        motion=moved,
    )


def _settled(task: Task, width: np.ndarray, starts: Starts, stop: Stop) -> tuple[np.ndarray, Check]:
    """Best values, and whether another solver ends there too; if it ends lower, the search goes on from its place."""
    problem, whole = task.problem, task.counts[-1:]
    values, cost = starts.values[int(np.argmin(starts.cost))], float(starts.cost.min())
    if stop():
        return values, judge.no_second_solver()
    for _ in range(SECOND_CHANCES):
        errors = _rough_errors(problem, values, cost)
        other = second_opinion(problem, values + 3.0 * errors * (-1.0) ** np.arange(len(values)), errors)
        gain = cost - other.cost
        if not gain > judge.SETTLED:
            break
        found = descend(problem, problem.layout.free(other.values), width, whole)
        values, cost = problem.layout.values(np.asarray(found.free)), float(found.cost)
    return values, judge.second_solver(float(np.max(np.abs(other.values - values) / errors)), gain)


SECOND_CHANCES = 3


def _rough_errors(problem: Problem, values: np.ndarray, cost: float) -> np.ndarray:
    """Standard errors ``(n_free,)`` under white noise of the residuals' size; a small step where data see nothing."""
    root = gram_root(gram_at(problem, values))[:, :-1]
    scale = np.linalg.norm(root, axis=0)
    seen = scale > 0.0
    inverse = np.linalg.pinv(root / np.where(seen, scale, 1.0), rcond=1e-8) / np.where(seen, scale, 1.0)[:, None]
    errors = np.linalg.norm(inverse, axis=1) * np.sqrt(cost / problem.n_measured)
    return np.where(seen & (errors > 0.0), errors, np.maximum(1e-3 * np.abs(values), 1e-9))
