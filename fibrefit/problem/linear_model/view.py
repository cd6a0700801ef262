"""Records as a Gauss-Newton search sees them: through a whitening, with errors of inputs eliminated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.limits import check_time
from fibrefit.core.programs import kept_program
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients
from fibrefit.problem.inputs.sensitivities import InputSensitivities
from fibrefit.problem.linear_model.normal_equations import PosteriorMode
from fibrefit.problem.linear_model.unknowns import Gram, Unknowns
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.noise.whitening import Levelled, innovations
from fibrefit.problem.statement.problem import Problem

DRAWS_OF_ERRORS = 4
"""Of the errors of inputs, so that the noise they take with them when they are fitted is put back."""


@dataclass(frozen=True)
class View:
    """A task seen through a whitening.

    Parameters
    ----------
    problem : Problem
        Errors found before taken off its inputs.
    whitening : Coloured, Levelled or None
        None: each sample by itself.
    sensitivities : InputSensitivities or None
        To errors of measured inputs, whitened.
    raw : InputSensitivities or None
        The same, not whitened.
    beforehand : View, optional
        The same, linearised with what is known of these errors beforehand, where the readings were made to tell more.
    """

    problem: Problem
    whitening: Coloured | Levelled | None = None
    sensitivities: InputSensitivities | None = None
    raw: InputSensitivities | None = None
    beforehand: View | None = None

    def through(self, whitening: Coloured | Levelled) -> View:
        """The same through another whitening."""
        sensitivities = None if self.raw is None else self.raw.through(whitening)
        return replace(self, whitening=whitening, sensitivities=sensitivities)

    def gram(self, unknowns: Unknowns) -> Gram:
        """What a Gauss-Newton search asks of the records, as long as there is time, see `time_limit`."""
        free = np.asarray(self.problem.layout.local_free)
        places = np.searchsorted(free, unknowns.columns)

        def of(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
            check_time()
            steps = targets - local[:, columns]
            linear, known = self.problem.evaluate(local)[0], self.sensitivities
            residuals = np.asarray(linear.residuals)
            if known is not None:
                offset = np.asarray(known.offset).reshape(residuals.shape)
                residuals = np.where(residuals != 0.0, residuals + offset, 0.0)
            moved = np.asarray(linear.slopes)[..., places] * steps[:, None, None, :]
            rows = np.moveaxis(np.concatenate([moved, residuals[..., None]], axis=-1), -1, 1)
            rows = rows if self.whitening is None else np.asarray(_whitened(self.whitening, rows))
            rows = rows.reshape(*rows.shape[:2], -1)
            grams = rows @ np.swapaxes(rows, 1, 2)
            return grams if known is None else known.eliminated(grams, known.products(rows))

        return of

    def residuals(self, local: np.ndarray, draws: int = 1) -> tuple[np.ndarray, InputCoefficients]:
        """Residuals ``(n_draw, n_record, n_channel, n_time)`` in units of the noise, and errors of the inputs.

        The first draw is at the best errors of the inputs, the others where these may be as well; where no input is
        noisy there is one, whatever `draws` is.
        """
        rows = np.asarray(self.problem.evaluate(local)[0].residuals)
        if self.sensitivities is None or self.raw is None:
            return rows[None], {}
        rows = self.without_errors(rows)
        white = rows if self.whitening is None else np.asarray(innovations(self.whitening, rows))
        random, found, best = np.random.default_rng(0), [], []
        for row, own, seen, raw in zip(rows, white, self.sensitivities.records, self.raw.records, strict=True):
            best.append(-seen.best(own.reshape(1, -1))[0])
            errors = gaussian_draws(best[-1], np.linalg.cholesky(seen.inverse), draws, random)
            found.append(row + raw.imitated(errors, row.size).reshape(draws, *row.shape))
        return np.stack(found, axis=1), self.raw.named(best)

    def without_errors(self, residuals: np.ndarray) -> np.ndarray:
        """Residuals ``(n_record, n_channel, n_time)`` with inputs without errors, linearly."""
        if self.raw is None:
            return residuals
        return np.where(residuals != 0.0, residuals + np.asarray(self.raw.offset).reshape(residuals.shape), 0.0)

    def residuals_with_noise_power(self, mode: PosteriorMode, roots: np.ndarray, draws: int = 1) -> np.ndarray:
        """Residuals that have the power of the noise, ``(n_draw, n_record, n_channel, n_time)`` in its units.

        What is fitted takes noise along, most of it where the noise is slow. Values that are off by what is not known
        of them put it back: the mean power over these residuals is what is expected of the noise itself, given the
        records (the expectation step of EM; for linear models, restricted maximum likelihood). Errors of inputs follow
        them: what those make good of a change of the values is in no reading.

        Parameters
        ----------
        mode : PosteriorMode
        roots : (n_record, n_column, n_root) in SI units
            Of the covariance of each record's values there, see `MarginalLikelihood.posterior_roots`.

        Source
        ------
        Dempster, Laird and Rubin, J. R. Stat. Soc. B 39 (1977); Patterson and Thompson, Biometrika 58 (1971).
        """
        local = mode.local
        best = self.residuals(local, draws)[0]
        places = np.searchsorted(np.asarray(self.problem.layout.local_free), mode.unknowns.columns)
        slopes = np.asarray(self.problem.evaluate(local)[0].slopes)[..., places]
        moved = np.einsum("rcti,rik->krct", slopes, roots)
        if self.sensitivities is not None and self.raw is not None:
            white = moved if self.whitening is None else np.asarray(self.whitening.whiten_rows(jnp.asarray(moved)))
            moved = with_best_input_errors(moved, white, self.sensitivities, self.raw)
        return antithetic_draws(best, moved)


def gaussian_draws(best: np.ndarray, root: np.ndarray, draws: int, random: np.random.Generator) -> np.ndarray:
    """The best errors of inputs ``(n_wave,)``, and draws of what is not known of them, ``(n_draw, n_wave)``.

    Parameters
    ----------
    best : (n_wave,)
    root : (n_wave, n_wave)
        Of their covariance.
    draws : int
        Rows, the best among them.
    """
    return np.stack([best + (i > 0) * root @ random.standard_normal(len(root)) for i in range(draws)])


@kept_program
def _whitened(whitening: Coloured | Levelled, rows: jax.Array) -> jax.Array:
    """Innovations of ``(n_record, n_row, n_channel, n_time)``."""
    return jnp.moveaxis(whitening.whiten_rows(jnp.moveaxis(rows, 1, 0)), 0, 1)


def with_best_input_errors(
    moved: np.ndarray, white: np.ndarray, known: InputSensitivities, raw: InputSensitivities
) -> np.ndarray:
    """Changes of the residuals that are left once errors of inputs, at their best, follow them.

    Parameters
    ----------
    moved, white : (n_change, n_record, n_channel, n_time)
        In units of the noise, and their innovations.
    known, raw : InputSensitivities
        Whitened, and not.
    """
    left = moved.copy()
    for r, (seen, of) in enumerate(zip(known.records, raw.records, strict=True)):
        change = left[:, r]
        best = seen.best(white[:, r].reshape(len(moved), -1))
        change -= of.imitated(best, change[0].size).reshape(change.shape)
    return left


def antithetic_draws(best: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Residuals and, in both directions, each of some independent changes of them, whose mean power is that of all.

    Parameters
    ----------
    best : (n_draw, n_record, n_channel, n_time)
        Taken in turn; the first one is left out where there are others.
    moved : (n_change, n_record, n_channel, n_time)
        A standard deviation each.
    """
    number = len(moved)
    if not number:
        return best
    middle = best[1:] if len(best) > 1 else best
    middle = middle[np.arange(2 * number) % len(middle)]
    return middle + np.sqrt(number) * np.concatenate([moved, -moved])
