"""Whitened residuals and their changes as rows, and their products with the errors of inputs eliminated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.problem.inputs.sensitivities import InputSensitivities


class Slopes(NamedTuple):
    """Whitened residuals and their changes, one row each, and how errors of inputs take part in them.

    Parameters
    ----------
    rows : (n_record, 1 + n_column, n_row)
        Residuals first.
    pulled : (n_record, 1 + n_column, n_wave) or None
        Products with the sensitivities to errors of inputs.
    """

    rows: np.ndarray
    pulled: np.ndarray | None

    def grams(self, sensitivities: InputSensitivities | None) -> np.ndarray:
        """Products ``(n_record, n_column + 1, n_column + 1)``, errors of inputs eliminated; residuals come last."""
        grams = self.rows @ np.swapaxes(self.rows, 1, 2)
        if self.pulled is not None and sensitivities is not None:
            grams = grams - self.pulled @ np.asarray(sensitivities.inverse) @ np.swapaxes(self.pulled, 1, 2)
        keep = np.r_[1 : grams.shape[1], 0]
        return grams[:, keep][:, :, keep]

    def columns(self, places: np.ndarray) -> Slopes:
        """Some of the rows."""
        return Slopes(self.rows[:, places], None if self.pulled is None else self.pulled[:, places])

    def beside(self, further: Slopes) -> Slopes:
        """With further rows after them."""
        both = None
        if self.pulled is not None and further.pulled is not None:
            both = np.concatenate([self.pulled, further.pulled], axis=1)
        return Slopes(np.concatenate([self.rows, further.rows], axis=1), both)

    def scaled(self, factor: np.ndarray) -> Slopes:
        """Changes ``(n_record, n_column)`` times as large; the residuals stay."""
        whole = np.concatenate([np.ones((len(factor), 1)), factor], axis=1)[:, :, None]
        return Slopes(self.rows * whole, None if self.pulled is None else self.pulled * whole)

    def led_to(self, residuals: Slopes, way: np.ndarray) -> Slopes:
        """Slopes that predict the residuals to which a step led.

        Parameters
        ----------
        residuals : Slopes
            With no column.
        way : (n_record, n_column)
            The step, in units of the changes that the columns stand for.
        """
        along = way / np.maximum(np.sum(way**2, axis=1), TINY)[:, None]
        corrected = [
            None if old is None or new is None else _broyden(old, new[:, 0], way, along)
            for old, new in zip(self, residuals, strict=True)
        ]
        assert corrected[0] is not None
        return Slopes(corrected[0], corrected[1])


TINY = 1e-300
"""In place of the square of a step of nothing, along which nothing is corrected."""


def _broyden(old: np.ndarray, new: np.ndarray, way: np.ndarray, along: np.ndarray) -> np.ndarray:
    missed = new - old[:, 0] - np.einsum("rj,rjk->rk", way, old[:, 1:])
    return np.concatenate([new[:, None], old[:, 1:] + along[:, :, None] * missed[:, None]], axis=1)
