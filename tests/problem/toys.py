"""Models that take no simulation: records whose residuals are linear in all coordinates, or curved a little."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from fibrefit.problem.linear_model.normal_equations import PosteriorMode
from fibrefit.problem.linear_model.unknowns import Gram, Place, Unknowns

SIZE = 40
"""Samples of a record."""
NAMES = ("stiffness", "damping", "strength", "zero", "start")
REFERENCE, SCALE = np.array([20.0, 3.0, 1.0]), np.array([1.0, 1.0, 3.0])
OWN_SIZE = np.array([2.0, 0.5])


class BareMode(SimpleNamespace):
    """What a test says of a mode; what each record leaves follows from it as from any."""

    record_costs = PosteriorMode.record_costs


def unknowns(scattering: tuple[int, ...] = (0,), records: int = 4) -> Unknowns:
    """Two logarithmic values and a linear one that records share, and two of each record's own."""
    return Unknowns(
        names=NAMES,
        shared=np.arange(3),
        each=np.array([3, 4]),
        free=np.ones((records, 2), dtype=bool),
        scattering=np.array(scattering, dtype=int),
        log=np.array([True, True, False]),
        reference=REFERENCE,
        scale=SCALE,
        mean=np.array([0.1, 0.0, -0.2]),
        precision=np.array([[1.0, 0.3, 0.0], [0.3, 2.0, 0.0], [0.0, 0.0, 4.0]]),
        lower=np.full(3, -50.0),
        upper=np.full(3, 50.0),
        size=OWN_SIZE,
    )


def gram_of(residuals: Callable[[np.ndarray], np.ndarray]) -> Gram:
    """Products of differences of residuals ``(n_record, n_sample)``, which are a function of the local values."""

    def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        here, rows = residuals(local), []
        for i, column in enumerate(columns):
            moved = local.copy()
            moved[:, column] = targets[:, i]
            rows.append(residuals(moved) - here)
        kept = np.stack([*rows, here], axis=1)
        return np.einsum("rit,rjt->rij", kept, kept)

    return gram


@dataclass(frozen=True)
class Linear:
    """Records of unit white noise whose readings are linear in all coordinates.

    Parameters
    ----------
    slopes : (n_record, n_sample, 5)
        With respect to the coordinates of `NAMES`.
    measured : (n_record, n_sample)
    """

    slopes: np.ndarray
    measured: np.ndarray

    @classmethod
    def drawn(cls, seed: int, z: np.ndarray, scatter: float = 0.0, records: int = 4, loud: float = 1.0) -> Linear:
        """Records of a truth; `scatter` is that of the first coordinate, `loud` the size of the slopes."""
        random = np.random.default_rng(seed)
        slopes = loud * random.standard_normal((records, SIZE, 5))
        x = np.concatenate([np.repeat(z[None], records, axis=0), random.standard_normal((records, 2))], axis=1)
        x[:, 0] += scatter * random.standard_normal(records)
        return cls(slopes, np.einsum("rti,ri->rt", slopes, x) + random.standard_normal((records, SIZE)))

    def residuals(self, local: np.ndarray) -> np.ndarray:
        """What is left at local values."""
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.concatenate(
                [
                    np.log(local[:, :2] / REFERENCE[:2]),
                    (local[:, 2:3] - REFERENCE[2]) / SCALE[2],
                    local[:, 3:] / OWN_SIZE,
                ],
                axis=1,
            )
        return np.einsum("rti,ri->rt", self.slopes, z) - self.measured

    @property
    def gram(self) -> Gram:
        """See `gram_of`."""
        return gram_of(self.residuals)

    def design(self, of: Unknowns) -> np.ndarray:
        """Columns ``(n_record * n_sample, 3 + n_record * n_own)`` of all unknowns: shared, then record by record."""
        records, own = len(self.slopes), 2 + len(of.scattering)
        whole = np.zeros((records, SIZE, 3 + records * own))
        whole[:, :, :3] = self.slopes[:, :, :3]
        for r in range(records):
            mine = np.concatenate([self.slopes[r, :, 3:] * of.free[r], self.slopes[r][:, of.scattering]], axis=1)
            whole[r, :, 3 + r * own : 3 + (r + 1) * own] = mine
        return whole.reshape(records * SIZE, -1)


def begun(of: Unknowns, z: np.ndarray | None = None, records: int = 4) -> Place:
    """A place far from where anything is, with the records' own values at zero."""
    z = np.zeros(3) if z is None else z
    local = np.tile(np.concatenate([of.value(z), np.zeros(2)]), (records, 1))
    return Place(z, np.zeros((records, 2)), np.zeros((records, len(of.scattering))), local)


def dense(linear: Linear, of: Unknowns, sigma: np.ndarray, held: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Best unknowns as `Linear.design` orders them, and Q there, from one dense solve.

    Parameters
    ----------
    linear : Linear
    of : Unknowns
    sigma : (n_scattering,)
    held : (n_record, 2), optional
        Own values that are not free.
    """
    design, records, own = linear.design(of), len(linear.slopes), 2 + len(of.scattering)
    target = linear.measured.copy()
    if held is not None:
        target -= np.einsum("rti,ri->rt", linear.slopes[:, :, 3:], held)
    prior = np.zeros((design.shape[1],) * 2)
    prior[:3, :3] = of.precision
    for r in range(records):
        index = 3 + r * own + np.arange(own)
        idle = np.where(of.free[r], 0.0, 1.0)
        prior[index, index] = np.concatenate([idle, sigma**-2.0])
    mean = np.concatenate([of.mean, np.zeros(design.shape[1] - 3)])
    matrix = design.T @ design + prior
    best = np.linalg.solve(matrix, design.T @ target.ravel() + prior @ mean)
    left = design @ best - target.ravel()
    return best, float(left @ left + (best - mean) @ prior @ (best - mean))


def bounded(of: Unknowns, **ends: tuple[int, float]) -> Unknowns:
    """With a bound: ``lower=(0, 0.5)`` is one of the first coordinate."""
    for side, (index, value) in ends.items():
        limits = getattr(of, side).copy()
        limits[index] = value
        of = replace(of, **{side: limits})
    return of
