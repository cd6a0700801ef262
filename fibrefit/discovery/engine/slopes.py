"""Whitened residuals and their changes as rows, and their products with the errors of inputs eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fibrefit.core.arrays import RAN_AWAY
from fibrefit.problem import InputSensitivities


class Slopes(NamedTuple):
    """Whitened residuals and their changes, one row each, and how errors of inputs take part in them.

    Parameters
    ----------
    rows : (n_record, 1 + n_column, n_row)
        Residuals first.
    pulled : sequence of (1 + n_column, n_direction), one for each record, or None
        Products with the sensitivities to errors of inputs.
    """

    rows: np.ndarray
    pulled: Sequence[np.ndarray] | None

    @RAN_AWAY
    def grams(self, sensitivities: InputSensitivities | None) -> np.ndarray:
        """Products ``(n_record, n_column + 1, n_column + 1)``, errors of inputs eliminated; residuals come last."""
        grams = self.rows @ np.swapaxes(self.rows, 1, 2)
        if self.pulled is not None and sensitivities is not None:
            grams = sensitivities.eliminated(grams, self.pulled)
        keep = np.r_[1 : grams.shape[1], 0]
        return grams[:, keep][:, :, keep]

    def whitened(self, sensitivities: InputSensitivities | None) -> np.ndarray:
        """The rows whitened of the errors of inputs too, ``(n_record, 1 + n_column, n_row)``: `grams` are theirs."""
        if self.pulled is None or sensitivities is None:
            return self.rows
        return sensitivities.whitened(self.rows, self.pulled)

    def columns(self, places: np.ndarray) -> Slopes:
        """Some of the rows."""
        return Slopes(self.rows[:, places], None if self.pulled is None else [part[places] for part in self.pulled])

    def beside(self, further: Slopes) -> Slopes:
        """With further rows after them."""
        both = None
        if self.pulled is not None and further.pulled is not None:
            both = [np.concatenate(parts) for parts in zip(self.pulled, further.pulled, strict=True)]
        return Slopes(np.concatenate([self.rows, further.rows], axis=1), both)

    def differences(self) -> Slopes:
        """The first row, and what it takes from there to each of the others."""
        pulled = self.pulled and [np.concatenate([part[:1], part[1:] - part[:1]]) for part in self.pulled]
        return Slopes(np.concatenate([self.rows[:, :1], self.rows[:, 1:] - self.rows[:, :1]], axis=1), pulled)

    def scaled(self, factor: np.ndarray) -> Slopes:
        """Changes ``(n_record, n_column)`` times as large; the residuals stay."""
        whole = np.concatenate([np.ones((len(factor), 1)), factor], axis=1)[:, :, None]
        pulled = self.pulled and [part * by for part, by in zip(self.pulled, whole, strict=True)]
        return Slopes(self.rows * whole, pulled)

    @RAN_AWAY
    def carried_over(self, there: Slopes, here: Slopes) -> Slopes:
        """Changes found at another place, what unknowns imitate of them there taken as these change readings here.

        An effect is told from the unknowns by what they leave of it, often a thousandth: at another place both change
        readings a little otherwise, and alike. By record, the unknowns' share is that of least squares.

        Parameters
        ----------
        there, here : Slopes
            Of the same unknowns, with no residuals.

        Source
        ------
        What unknowns leave of a column tells its coefficient: Frisch and Waugh, Econometrica 1 (1933) 387.
        """
        products = there.rows @ np.swapaxes(there.rows, 1, 2)
        size = np.sqrt(np.maximum(np.diagonal(products, axis1=1, axis2=2), TINY))
        alike = products / (size[:, :, None] * size[:, None, :]) + RIDGE * np.eye(size.shape[1])
        pull = there.rows @ np.swapaxes(self.rows, 1, 2) / size[:, :, None]
        share = np.swapaxes(np.linalg.solve(alike, pull) / size[:, :, None], 1, 2)
        pulled = None
        if self.pulled is not None and there.pulled is not None and here.pulled is not None:
            parts = zip(self.pulled, share, there.pulled, here.pulled, strict=True)
            pulled = [own + of @ (after - before) for own, of, before, after in parts]
        return Slopes(self.rows + share @ (here.rows - there.rows), pulled)

    def updated(self, residuals: Slopes, way: np.ndarray) -> Slopes:
        """Slopes that predict the residuals to which a step led.

        Parameters
        ----------
        residuals : Slopes
            With no column.
        way : (n_record, n_column)
            The step, in units of the changes that the columns stand for.
        """
        along = way / np.maximum(np.sum(way**2, axis=1), TINY)[:, None]
        rows = [_broyden(*each) for each in zip(self.rows, residuals.rows, way, along, strict=True)]
        pulled = None
        if self.pulled is not None and residuals.pulled is not None:
            pulled = [_broyden(*each) for each in zip(self.pulled, residuals.pulled, way, along, strict=True)]
        return Slopes(np.array(rows), pulled)


TINY = 1e-300
"""In place of the square of a step of nothing, along which nothing is corrected."""
RIDGE = 1e-10
"""Added to products of unknowns with themselves over their squares: what cannot move has a share of nothing."""


def _broyden(old: np.ndarray, new: np.ndarray, way: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Rows ``(1 + n_column, n)`` that predict the residuals ``(1, n)`` to which a way ``(n_column,)`` led."""
    missed = new[0] - old[0] - way @ old[1:]
    return np.concatenate([new, old[1:] + along[:, None] * missed])
