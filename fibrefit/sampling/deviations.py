"""How records differ, before the first draw: by the Gauss-Newton search and the grid that a fit uses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.estimate.evidence import MarginalLikelihood, laplace_evidence
from fibrefit.problem.estimate.gauss_newton import record_wise_start
from fibrefit.problem.estimate.gls import HausmanTest
from fibrefit.problem.linear_model.unknowns import Unknowns
from fibrefit.problem.linear_model.view import View
from fibrefit.problem.noise.choose import after_step, least_squares_step
from fibrefit.problem.noise.whitening import Whitening, innovations
from fibrefit.problem.posterior.log_posterior import Conditional, InputEffects, LogPosterior, Mixture, RandomEffects
from fibrefit.problem.statement.layout import Layout, assembled
from fibrefit.problem.statement.matrices import pseudo_inverse
from fibrefit.problem.task import Task
from fibrefit.study.summaries.results import BetweenRecordsSummary

LIGHT = 1e-6
"""Weight of a point of the grid, as a share of the largest, below which it is left out of the density."""
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
    slopes = np.asarray(seen.problem.followed(local)[0].slopes)
    rows = np.moveaxis(slopes, -1, 1).reshape(len(slopes), slopes.shape[-1], -1)
    left = rows if seen.raw is None else seen.raw.left(rows)
    normal = assembled(np.einsum("rin,rjn->rij", rows, left), layout.local_columns, layout.size)
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
    layout, place = seen.problem.layout, evidence.mode.place
    columns = unknowns.shared[unknowns.scattering]
    free = np.searchsorted(np.asarray(layout.local_free), columns)
    slopes = np.asarray(
        innovations(seen.whitening, np.asarray(seen.problem.followed(where.local)[0].slopes)[..., free])
    )
    slopes = slopes * level[:, None, None]
    bend = np.zeros((len(slopes), len(columns), len(columns)))
    if inputs is not None:
        slopes, bend = slopes + np.asarray(inputs.slopes)[..., free], np.asarray(inputs.bend(columns))
    slopes = slopes * where.local[:, None, None, columns]
    products = np.einsum("rcti,rctj->rcij", slopes, slopes)
    names = [layout.names[column] for column in columns]
    kept = _kept(evidence)
    curvature = np.einsum("rcij,c->rij", products, level**-2.0) + bend
    return RandomEffects(
        slopes=jnp.asarray(slopes),
        products=jnp.asarray(products),
        middle=jnp.log(jnp.asarray(unknowns.value(place.z)[unknowns.scattering])),
        eta=jnp.asarray(place.eta),
        follow=jnp.asarray(_follow(curvature, evidence.grid[kept])),
        where=_mixture(evidence, kept),
        sigma=jnp.asarray(evidence.grid[kept]),
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
    layout, linear = seen.problem.layout, seen.problem.followed(local)[0]
    names = set(where.names) if where is not None and where.found else set()
    slots = tuple(replace(slot, shared=slot.shared and slot.name not in names) for slot in layout.slots)
    apart = Layout(slots, layout.records)
    values = np.array([local[record or 0, layout.names.index(slot.name)] for slot, record in apart.entries])
    if seen.raw is None:
        step = least_squares_step(apart, linear, apart.prior_gram(values))
        found = HausmanTest.at(apart, after_step(apart, linear, step), *noise, apart.prior_gram(values + step))
    else:
        without = linear._replace(residuals=seen.without_errors(np.asarray(linear.residuals)))
        found = HausmanTest.with_input_errors(apart, without, seen.raw, noise, apart.prior_gram(values))
    scores, efficiency = np.full(layout.size, np.nan), np.empty(layout.size)
    for i, (slot, record) in enumerate(layout.entries):
        own = [k for k, (s, r) in enumerate(apart.entries) if s.name == slot.name and record in (None, r)]
        scores[i] = max(found.scores[own], key=lambda score: np.nan_to_num(abs(score)))
        efficiency[i] = found.efficiency[own].mean()
    return HausmanTest(scores, found.chance, efficiency)


def _kept(evidence: MarginalLikelihood) -> np.ndarray:
    """Places in the grid of what weighs anything, in its order; the next heaviest fill up a multiple of `ROWS`."""
    order = np.argsort(-evidence.weight, kind="stable")
    used = int(np.count_nonzero(evidence.weight > LIGHT * evidence.weight.max()))
    return np.sort(order[: -(-used // ROWS) * ROWS])


def _follow(curvature: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """How a record's best deviations fall as the shared values rise, under each standard deviation."""
    matrix = sigma[:, None, :, None] * curvature * sigma[:, None, None, :] + np.eye(sigma.shape[1])
    return np.asarray(sigma[:, None, :, None] * np.linalg.solve(matrix, sigma[:, None, :, None] * curvature))


def _mixture(evidence: MarginalLikelihood, kept: np.ndarray) -> Mixture:
    """What is known of the logarithms of the values that may deviate, under each standard deviation."""
    scattering, mode = evidence.mode.unknowns.scattering, evidence.mode.place.z
    covariance = evidence.covariance[kept][:, scattering[:, None], scattering]
    size = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), np.finfo(float).tiny))
    inside = covariance / (size[:, :, None] * size[:, None, :]) + 1e-12 * np.eye(len(scattering))
    root = np.swapaxes(np.linalg.cholesky(np.linalg.inv(inside)), 1, 2) / size[:, None, :]
    with np.errstate(divide="ignore"):
        logs = np.log(evidence.weight[kept])
    logs = logs + np.sum(np.log(np.diagonal(root, axis1=1, axis2=2)), axis=1)
    return Mixture(jnp.asarray(logs), jnp.asarray((evidence.z[kept] - mode)[:, scattering]), jnp.asarray(root))


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
