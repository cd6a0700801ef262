"""The noise a hypothesis leaves: its residuals, and what was fitted takes along put back.

Errors of inputs that are eliminated, and values that are fitted, take noise along: most of it where the noise is slow
and the records have few periods of it. What is left would be estimated too small, and with it every error bar. What is
there but is no noise, a jump that no spectrum holds, is left out: taken for slow noise, it would hide itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import numpy as np

from fibrefit.discovery.engine.common_noise import CommonNoise
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import ALARM
from fibrefit.discovery.level_shifts import LevelShift, level_shifts, without_shifts
from fibrefit.problem import (
    DRAWS_OF_ERRORS,
    BlockFilter,
    Noise,
    antithetic_draws,
    gaussian_draws,
    in_blocks,
    noise_of_residuals,
    whitening_of,
    with_best_input_errors,
    with_steps,
)


@jax.jit
def innovations_of(whitening: BlockFilter, rows: jax.Array) -> jax.Array:
    """Innovations of many residuals, ``(n_row, n_record, n_channel, n_time)``."""
    return whitening.whiten_rows(rows)


def remaining_noise(common_noise: CommonNoise, fitted: LaplaceFit, counts: np.ndarray) -> tuple[Noise, ...]:
    """Noise a hypothesis leaves, in SI units.

    Parameters
    ----------
    common_noise : CommonNoise
        It was fitted in.
    fitted : LaplaceFit
    counts : (n_record,) int
    """
    problem = with_steps(fitted.supermodel.problem, common_noise.steps)
    best = residuals_of(common_noise, fitted, counts, DRAWS_OF_ERRORS)
    changes = changes_of(common_noise, fitted, counts)

    def noise(shifts: Sequence[LevelShift] = ()) -> tuple[Noise, ...]:
        return noise_of_residuals(problem, antithetic_draws(without_shifts(best, shifts, counts), changes))

    def shifts(whitening: BlockFilter) -> list[LevelShift]:
        channels = enumerate(problem.model.rig.channels)
        fine = {c for c, channel in channels if channel not in common_noise.steps}
        return [one for one in level_shifts(whitening, best[0], counts) if one.channel in fine]

    # Noise that takes jumps for its own hides them: they are looked for again in that which they are no part of.
    free = in_blocks(whitening_of(problem, noise(shifts(common_noise.whitening))))
    return noise([one for one in shifts(free) if one.probability < ALARM])


def residuals_of(common_noise: CommonNoise, fitted: LaplaceFit, counts: np.ndarray, draws: int = 1) -> np.ndarray:
    """Residuals at the mode ``(n_draw, n_record, n_channel, n_time)``, in units of the noise.

    Where errors of inputs are eliminated, there are as many as `draws`: the first is at their best, the others are
    draws of what is not known of them. Elsewhere there is one, whatever `draws` is.
    """
    supermodel, number = common_noise.unwhitened(fitted.supermodel), len(common_noise.noise)
    rows = supermodel.residuals(fitted.local, counts)
    shape = (len(rows), number, -1)
    sensitivities = common_noise.sensitivities
    if sensitivities is None or supermodel.sensitivities is None:
        return np.asarray(rows).reshape(1, *shape)
    white = innovations_of(common_noise.whitening, rows.reshape(1, *shape)).reshape(rows.shape)
    random, found = np.random.default_rng(0), []
    pairs = zip(sensitivities.records, supermodel.sensitivities.records, strict=True)
    for row, own, (seen, raw) in zip(np.asarray(rows), np.asarray(white), pairs, strict=True):
        drawn = gaussian_draws(seen.best(own[None])[0], np.linalg.cholesky(seen.inverse), draws, random)
        found.append(row - raw.imitated(drawn, len(row)))
    return np.stack(found, axis=1).reshape(draws, *shape)


def changes_of(common_noise: CommonNoise, fitted: LaplaceFit, counts: np.ndarray) -> np.ndarray:
    """What residuals change by along each direction in which values may be off, a standard deviation each.

    Returns
    -------
    (n_direction, n_record, n_channel, n_time)
        In units of the noise, errors of inputs at their best for each; none where no mode was found.
    """
    found, supermodel = fitted.evidence.mode, common_noise.unwhitened(fitted.supermodel)
    times = supermodel.problem.observations.experiment.times
    if not found.steps:
        return np.zeros((0, len(times), len(common_noise.noise), times.shape[1]))
    roots = fitted.evidence.posterior_roots()
    local, columns, targets, _ = found.unknowns.differences(found.place)
    rows = np.asarray(supermodel.rows(local, columns, targets, counts))[:, 1 : 1 + len(columns)]
    change = targets - local[:, columns]
    along = np.einsum("rit,rik->rkt", rows / np.where(change != 0.0, change, 1.0)[:, :, None], roots)
    moved = np.swapaxes(along.reshape(*along.shape[:2], len(common_noise.noise), -1), 0, 1)
    known, raw = common_noise.sensitivities, supermodel.sensitivities
    if known is None or raw is None:
        return moved
    return with_best_input_errors(moved, np.asarray(innovations_of(common_noise.whitening, moved)), known, raw)
