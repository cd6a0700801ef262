"""What each record has of its own: deviations of its values, and errors of its measured inputs.

How records differ is found before the first draw, by the Gauss-Newton search and the grid that a fit uses.

A likelihood takes the inputs for exact. Where a drive's position is measured and multiplied by a stiff fibre it is not:
its error is one more unknown of each record. As in a fit, readings are linearised in the errors at the mode, found
together with the values and with how records differ. Both are then integrated out of the density, and draws of them are
made again where something is predicted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.arrays import assembled
from fibrefit.core.matrices import pseudo_inverse
from fibrefit.problem import (
    HausmanTest,
    InputCoefficients,
    InputErrors,
    Layout,
    MarginalLikelihood,
    Problem,
    Task,
    Unknowns,
    View,
    Whitening,
    cleaned_inputs,
    corrected,
    downweighted,
    innovations,
    input_errors,
    laplace_evidence,
    no_errors,
    record_wise_start,
    sensitivities_of,
)
from fibrefit.sampling.density.filters import least_squares_step, linearised_after_step
from fibrefit.sampling.density.log_posterior import Conditional, InputEffects, LogPosterior, Mixture, RandomEffects
from fibrefit.study.summaries.results import BetweenRecordsSummary

ROWS = 32
"""Points of the grid are kept in multiples of this, for the compiler's sake."""


@dataclass(frozen=True)
class Deviations:
    """Records that may differ, at the mode.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Values of each record, its deviations in them.
    evidence : MarginalLikelihood or None
        None before the noise is known.
    """

    unknowns: Unknowns
    local: np.ndarray
    evidence: MarginalLikelihood | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that may differ."""
        return tuple(self.unknowns.names[column] for column in self.unknowns.scattering)

    @property
    def found(self) -> bool:
        """Whether records differ in any parameter more probably than not."""
        return self.evidence is not None and any(one.found for one in self.evidence.between_records().values())

    def values(self, layout: Layout) -> np.ndarray:
        """Free values ``(n_free,)`` in SI units at the mode."""
        assert self.evidence is not None
        place = self.evidence.mode.place
        return self.unknowns.free_values(layout, self.unknowns.value(place.z), place.own)


def ols_deviations(task: Task, values: np.ndarray, seen: View) -> Deviations:
    """Where records are best in plain least squares, those that may differ each with deviations of its own.

    Parameters
    ----------
    values : (n_free,) in SI units
        The plain estimate.
    seen : View
        Linearised there in errors of inputs.
    """
    layout, local = seen.problem.layout, np.asarray(seen.problem.layout.local(values))
    slopes = np.asarray(seen.problem.evaluate(local)[0].slopes)
    rows = np.moveaxis(slopes, -1, 1).reshape(len(slopes), slopes.shape[-1], -1)
    reduced = rows if seen.raw is None else seen.raw.without_errors(rows)
    normal = assembled(np.einsum("rin,rjn->rij", rows, reduced), layout.local_columns, layout.size)
    known = np.diag(pseudo_inverse(normal + layout.prior_gram(values)[:-1, :-1]))
    errors = np.sqrt(np.where(known > 0.0, known, np.inf))
    unknowns = Unknowns.of_fit(layout, values, errors)
    place = unknowns.place_of(local)
    if len(unknowns.scattering) or seen.raw is not None:
        place = record_wise_start(unknowns, [place], seen, task.horizons)
    return Deviations(unknowns, unknowns.local_of(place))


def gls_deviations(seen: View, where: Deviations) -> Deviations | None:
    """The mode, and how much records differ, under a noise; None where no mode is reached.

    Parameters
    ----------
    seen : View
        Through the whitening.
    where : Deviations
        Where the search begins.
    """
    sigma = None if where.evidence is None else where.evidence.mode.sigma
    with np.errstate(all="ignore"):
        try:
            found = laplace_evidence(
                where.unknowns, where.unknowns.place_of(where.local), seen.gram(where.unknowns), sigma
            )
        except np.linalg.LinAlgError:
            return None
    sound = np.isfinite(found.log) and np.isfinite(found.spread).all()
    return Deviations(where.unknowns, found.mode.local, found.refined()) if sound else None


def random_effects_of(
    seen: View, where: Deviations, level: np.ndarray, inputs: InputEffects | None = None
) -> RandomEffects | None:
    """What integrates the deviations out, from the mode; None where nothing deviates.

    Parameters
    ----------
    seen : View
        Through the whitening and a level.
    where : Deviations
        With its evidence.
    level : (n_channel,)
        Noise over what the whitening itself assumes.
    inputs : InputEffects, optional
        Errors of inputs, which follow deviations.
    """
    evidence, unknowns = where.evidence, where.unknowns
    assert evidence is not None
    assert seen.whitening is not None
    if not len(unknowns.scattering):
        return None
    layout, place, scattering = seen.problem.layout, evidence.mode.place, unknowns.scattering
    columns = unknowns.shared[scattering]
    free = np.searchsorted(np.asarray(layout.local_free), columns)
    linear = np.asarray(seen.problem.evaluate(where.local)[0].slopes)
    slopes = np.asarray(innovations(seen.whitening, linear[..., free])) * level[:, None, None]
    bend = np.zeros((len(slopes), len(columns), len(columns)))
    if inputs is not None:
        slopes, bend = slopes + np.asarray(inputs.slopes)[..., free], np.asarray(inputs.bend(columns))
    slopes = slopes * where.local[:, None, None, columns]
    products = np.einsum("rcti,rctj->rcij", slopes, slopes)
    names, kept = [layout.names[column] for column in columns], _kept(evidence)

    # How a record's best deviations fall as the shared values rise, under each standard deviation.
    curvature, sigma = np.einsum("rcij,c->rij", products, level**-2.0) + bend, evidence.grid[kept]
    matrix = sigma[:, None, :, None] * curvature * sigma[:, None, None, :] + np.eye(sigma.shape[1])
    follow = np.asarray(sigma[:, None, :, None] * np.linalg.solve(matrix, sigma[:, None, :, None] * curvature))

    # What is known of the logarithms of the values that may deviate, under each standard deviation.
    covariance = evidence.covariance[kept][:, scattering[:, None], scattering]
    size = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), np.finfo(float).tiny))
    inside = covariance / (size[:, :, None] * size[:, None, :]) + 1e-12 * np.eye(len(scattering))
    root = np.swapaxes(np.linalg.cholesky(np.linalg.inv(inside)), 1, 2) / size[:, None, :]
    with np.errstate(divide="ignore"):
        logs = np.log(evidence.weight[kept])
    logs = logs + np.sum(np.log(np.diagonal(root, axis1=1, axis2=2)), axis=1)
    away = (evidence.z[kept] - place.z)[:, scattering]

    return RandomEffects(
        slopes=jnp.asarray(slopes),
        products=jnp.asarray(products),
        middle=jnp.log(jnp.asarray(unknowns.value(place.z)[scattering])),
        eta=jnp.asarray(place.eta),
        follow=jnp.asarray(follow),
        where=Mixture(jnp.asarray(logs), jnp.asarray(away), jnp.asarray(root)),
        sigma=jnp.asarray(sigma),
        log_prior=jnp.asarray(evidence.prior[kept]),
        places=tuple(layout.free_names.index(name) for name in names),
        columns=tuple(int(column) for column in columns),
        bend=jnp.asarray(bend),
    )


def hausman_of_records(
    seen: View, where: Deviations | None, local: np.ndarray, noise: tuple[Whitening, np.ndarray]
) -> HausmanTest:
    """Compare plain and whitened estimates; where records differ, each has values of its own in what may do so.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Near the plain estimate, of each record where they differ.
    noise : (Whitening, (n_channel,))
        And its level over what the whitening assumes.

    Returns
    -------
    HausmanTest
        A value that may differ has the largest of its records' scores, and their mean efficiency.
    """
    layout, linear = seen.problem.layout, seen.problem.evaluate(local)[0]
    names = set(where.names) if where is not None and where.found else set()
    slots = tuple(replace(slot, shared=slot.shared and slot.name not in names) for slot in layout.slots)
    separate = Layout(slots, layout.records)
    values = np.array([local[record or 0, layout.names.index(slot.name)] for slot, record in separate.entries])
    if seen.raw is None:
        step = least_squares_step(separate, linear, separate.prior_gram(values))
        found = HausmanTest.at(
            separate, linearised_after_step(separate, linear, step), *noise, separate.prior_gram(values + step)
        )
    else:
        without = linear._replace(residuals=seen.without_errors(np.asarray(linear.residuals)))
        found = HausmanTest.with_input_errors(separate, without, seen.raw, noise, separate.prior_gram(values))
    scores, efficiency = np.full(layout.size, np.nan), np.empty(layout.size)
    for i, (slot, record) in enumerate(layout.entries):
        own = [k for k, (s, r) in enumerate(separate.entries) if s.name == slot.name and record in (None, r)]
        scores[i] = max(found.scores[own], key=lambda score: np.nan_to_num(abs(score)))
        efficiency[i] = found.efficiency[own].mean()
    return HausmanTest(scores, found.chance, efficiency)


def _kept(evidence: MarginalLikelihood) -> np.ndarray:
    """Places in the grid of what weighs anything, in its order; the next heaviest fill up a multiple of `ROWS`."""
    order = np.argsort(-evidence.weight, kind="stable")
    # Ten thousand points of less than a millionth would change an evidence by a hundredth.
    used = int(np.count_nonzero(evidence.weight > 1e-6 * evidence.weight.max()))
    return np.sort(order[: -(-used // ROWS) * ROWS])


def between_of(density: LogPosterior, where: Deviations, points: np.ndarray) -> dict[str, BetweenRecordsSummary]:
    """Standard deviations between records, by name, the mean over draws ``(n_point, n)``."""
    evidence, random_effects = where.evidence, density.random_effects
    assert evidence is not None
    assert random_effects is not None
    logs = np.asarray(_known(density, jnp.asarray(points)).logs)
    weight = np.exp(logs - logs.max(axis=1, keepdims=True))
    whole = np.zeros(len(evidence.grid))
    whole[_kept(evidence)] = np.mean(weight / weight.sum(axis=1, keepdims=True), axis=0)
    return replace(evidence, weight=whole).between_records()


def records_at(density: LogPosterior, points: np.ndarray, seed: int = 0) -> np.ndarray:
    """Values of each record ``(n_point, n_record, n_local)`` in SI units, its deviations drawn.

    Parameters
    ----------
    points : (n_point, n)
    """
    layout = density.problem.layout
    values = np.asarray(jax.vmap(density.values)(jnp.asarray(points)))[:, : layout.size]
    local = np.stack([layout.local(one) for one in values])
    if density.random_effects is None:
        return local
    known = _known(density, jnp.asarray(points))
    random = np.random.default_rng(seed)
    eta = np.stack([density.random_effects.drawn(Conditional(*one), random) for one in zip(*known, strict=True)])
    local[:, :, list(density.random_effects.columns)] *= np.exp(eta)
    return local


@eqx.filter_jit
def _known(density: LogPosterior, points: jax.Array) -> Conditional:
    return jax.lax.map(density.known_of_deviations, points)


def seen_at(task: Task, values: np.ndarray, coefficients: InputCoefficients | None = None) -> View:
    """Records with the errors of their inputs eliminated, linearised at given ones; as they are where inputs are exact.

    Parameters
    ----------
    task : Task
        With its inputs as measured.
    values : (n_free,) or (n_record, n_local) in SI units
    coefficients : mapping of input to (n_record, n_wave), optional
        None by default.
    """
    known = input_errors(task)
    if not known:
        return View(task.problem)
    coefficients = coefficients or no_errors(known)
    seen = sensitivities_of(task, values, coefficients)
    assert seen is not None
    problem = downweighted(corrected(task.problem, known, coefficients), seen.downweight)
    return View(problem, None, seen, seen)


def input_effects_of(seen: View, local: np.ndarray, spread: np.ndarray) -> InputEffects | None:
    """What integrates the errors of inputs out; None where inputs are exact.

    Parameters
    ----------
    seen : View
        Through a whitening and these levels.
    local : (n_record, n_local) in SI units
        Values of each record at the mode.
    spread : (n_channel,)
        Noise over what the whitening itself assumes.
    """
    if seen.sensitivities is None or seen.whitening is None:
        return None
    columns = seen.problem.layout.local_free
    linear = seen.problem.evaluate(local)[0]
    residuals = np.asarray(linear.residuals)
    zero = seen.without_errors(residuals)
    offset = zero - residuals
    rows = np.concatenate([np.asarray(linear.slopes), zero[..., None], offset[..., None]], axis=-1)
    white = np.moveaxis(np.asarray(innovations(seen.whitening, rows)), -1, 1)
    shape, records = white.shape[2:], seen.sensitivities.records
    found = []
    for record, own in zip(records, white.reshape(*white.shape[:2], -1), strict=True):
        best = -record.best(own[:-1])
        moved = record.imitated(best, own.shape[1])
        moved[-1] += own[-1]
        parts = np.moveaxis(record.rows, 1, 0).astype(float)
        number = [float(np.sum((record.inverse @ part) * part)) for part in parts]
        found.append((moved.reshape(-1, *shape), best @ best.T, -np.linalg.slogdet(record.inverse)[1], number))
    moves, squares, log_dets, numbers = (np.array(part) for part in zip(*found, strict=True))
    moves = np.moveaxis(moves, 1, -1) * spread[:, None, None]
    return InputEffects(
        local=jnp.asarray(local[:, list(columns)]),
        offset=jnp.asarray(moves[..., -1]),
        slopes=jnp.asarray(moves[..., :-1]),
        squares=jnp.asarray(squares),
        log_det=jnp.asarray(log_dets.sum()),
        told=jnp.asarray(numbers.sum(axis=0)),
        curvature=jnp.asarray(spread**-2.0),
        columns=tuple(int(column) for column in columns),
    )


class BlockPredictor(NamedTuple):
    """Blocks of readings predicted from all others, errors of inputs integrated out.

    Parameters
    ----------
    factors : tuple of (int, (n_time,) int, (n, n))
        Record and instants of a block, and the lower root of the covariance of its innovations, channel by channel.
    log_det : (n_block,)
        Logarithm of the determinant of that root.
    spread : (n_channel,)
        Noise over what the whitening assumes.
    """

    factors: tuple[tuple[int, np.ndarray, np.ndarray], ...]
    log_det: np.ndarray
    spread: np.ndarray

    def predicted(self, innovations: np.ndarray) -> np.ndarray:
        """What is not expected of innovations ``(n_point, n_record, n_channel, n_time)`` at the best errors."""
        innovations = innovations / self.spread[:, None]
        found = innovations.copy()
        for r, where, factor in self.factors:
            own = innovations[:, r][:, :, where]
            found[:, r, :, where] = np.moveaxis((own.reshape(len(own), -1) @ factor).reshape(own.shape), -1, 0)
        return np.asarray(found * self.spread[:, None])


@dataclass(frozen=True)
class DrawnInputs:
    """Errors of measured inputs, drawn from what is known of them at given values.

    Parameters
    ----------
    problem : Problem
        With the inputs as the density takes them, every sample counted in full.
    known : mapping of input to InputErrors
    seen : View
        Through a whitening and the noise at the mode.
    spread : (n_channel,)
        That noise over what the whitening itself assumes.
    """

    problem: Problem
    known: Mapping[str, InputErrors]
    seen: View
    spread: np.ndarray

    def drawn(self, white: np.ndarray, random: np.random.Generator) -> InputCoefficients:
        """Errors beside those that are taken off already, a mapping of input to ``(n_point, n_record, n_wave)``.

        Parameters
        ----------
        white : (n_point, n_record, n_channel, n_time)
            Innovations with the inputs as the density takes them.
        """
        raw, sensitivities = self.seen.raw, self.seen.sensitivities
        assert raw is not None
        assert sensitivities is not None
        assert self.seen.whitening is not None
        # What takes readings back to inputs without errors, linearly.
        offset = np.asarray(raw.offset).reshape(raw.downweight.shape)
        rows = white / self.spread[:, None] + np.asarray(innovations(self.seen.whitening, offset))
        here = np.concatenate(list(sensitivities.coefficients.values()), axis=1)
        waves = []
        for r, record in enumerate(sensitivities.records):
            wave = random.standard_normal((len(rows), len(record.inverse))) @ np.linalg.cholesky(record.inverse).T
            wave -= record.best(rows[:, r].reshape(len(rows), -1))
            waves.append(wave @ record.basis.T - here[r])
        ends = np.cumsum([of.size.shape[1] for of in self.known.values()])[:-1]
        return dict(zip(self.known, np.split(np.stack(waves, axis=1), ends, axis=-1), strict=True))

    def left_out(self, blocks: np.ndarray, n_block: int) -> BlockPredictor:
        """What predicts blocks from the others.

        Law
        ---
        With the errors integrated out innovations have the precision ``P = 1 - W (1 + W'W)^-1 W'``. Those of a block b
        given all others have the covariance ``P_bb^-1 = L L'``, and are ``P_bb^-1 (P m)_b`` off what is expected of
        them; divided by L that is ``L' (P m)_b``, and ``P m`` are the innovations at the best errors.

        Source
        ------
        Buerkner, Gabry and Vehtari, Computational Statistics 36 (2021).

        Parameters
        ----------
        blocks : (n_record, n_time) int
            Block of each instant; the last one is that of what is masked.
        """
        assert self.seen.sensitivities is not None
        factors, log_det = [], np.zeros(n_block)
        for r, record in enumerate(self.seen.sensitivities.records):
            seen = blocks[r, : record.rows.shape[-1]]
            for block in np.setdiff1d(seen, [n_block - 1]):
                where = np.flatnonzero(seen == block)
                rows = record.rows[:, :, where].reshape(len(record.rows), -1).astype(float)
                inside = np.eye(rows.shape[1]) - rows.T @ record.inverse @ rows
                factor = np.linalg.cholesky(np.linalg.inv(inside))
                factors.append((r, where, factor))
                log_det[block] += np.sum(np.log(np.diag(factor)))
        return BlockPredictor(tuple(factors), log_det, self.spread)

    def readings(self, local: np.ndarray, errors: InputCoefficients) -> dict[str, jax.Array]:
        """The model's readings by channel, ``(n_point, n_record, n_time)`` in SI units, such errors taken off as well.

        Parameters
        ----------
        local : (n_point, n_record, n_local) in SI units
        errors : mapping of input to (n_point, n_record, n_wave)
        """
        return _readings(self.problem, dict(self.known), jnp.asarray(local), jax.tree.map(jnp.asarray, dict(errors)))


@eqx.filter_jit
def _readings(problem: Problem, known: Any, local: jax.Array, errors: Any) -> dict[str, jax.Array]:
    experiment = problem.observations.experiment

    def one(row: tuple[jax.Array, Any]) -> dict[str, jax.Array]:
        inputs = jax.vmap(cleaned_inputs)(experiment.inputs, experiment.times, known, row[1])
        return problem.predict(row[0], experiment._replace(inputs=inputs))

    return jax.lax.map(one, (local, errors))


def drawn_inputs_of(task: Task, seen: View, spread: np.ndarray) -> DrawnInputs | None:
    """What draws the errors of a task's inputs; None where these are exact.

    Parameters
    ----------
    seen, spread
        As in `input_effects_of`.
    """
    if seen.raw is None:
        return None
    known = input_errors(task)
    return DrawnInputs(corrected(task.problem, known, seen.raw.coefficients), known, seen, spread)


@eqx.filter_jit
def whitened_residuals(problem: Problem, whitening: Whitening, local: jax.Array) -> jax.Array:
    """Innovations ``(n_point, n_record, n_channel, n_time)`` at values ``(n_point, n_record, n_local)``."""
    return jax.lax.map(lambda own: whitening.whiten(problem.residuals_at(own)), local)
