"""What records tell beside the values of a model: their noise, and how much they differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.search.search import Search
from fibrefit.problem import BlockFilter


@dataclass(frozen=True)
class Beside:
    """What the records at hand tell of their noise, and of how much they differ.

    Parameters
    ----------
    whitening : BlockFilter or None
        Of the noise that a model leaves; None where it counts as white.
    scatter : mapping of str to float
        Relative standard deviation of a parameter between records, by its name.
    """

    whitening: BlockFilter | None = None
    scatter: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, search: Search, base: LaplaceFit) -> Beside:
        """That of a model that leaves little: what it lacks would pass for noise, and for differences of records."""
        evidence, unknowns = base.evidence, base.evidence.mode.unknowns
        levels = evidence.weight @ evidence.grid
        names = [unknowns.names[i] for i in unknowns.scattering]
        return cls(search.inference.common_noise.whitening, dict(zip(names, levels.tolist(), strict=True)))

    def deviations(self, names: Sequence[str]) -> list[int]:
        """Which of some shared values differ between records."""
        return [i for i, name in enumerate(names) if self.scatter.get(name, 0.0) > 0.0]

    def held(self, grams: np.ndarray, names: Sequence[str], own: int, sizes: np.ndarray) -> np.ndarray:
        """Gram matrices in which each record has deviations of its own (random effects), as large as is known.

        Parameters
        ----------
        grams : (n_record, n, n)
            Of shared columns, each record's own, and further ones.
        names : sequence of str
            Of the shared columns.
        own : int
            Number of each record's own.
        sizes : (n_record, n_shared)
            Relative changes of the shared values that their columns stand for, see `relative_changes`.
        """
        scattering, last = self.deviations(names), len(names) + own
        places = np.r_[:last, scattering, last : grams.shape[1]].astype(int)
        wide = grams[:, places][:, :, places]
        for j, i in enumerate(scattering):
            share = sizes[:, i] / self.scatter[names[i]]
            # Of a value that is zero a share is nothing.
            still = np.isinf(share)
            wide[still, last + j], wide[still, :, last + j] = 0.0, 0.0
            wide[:, last + j, last + j] += np.where(still, 1.0, share) ** 2
        return wide

    def held_at_hand(
        self, grams: np.ndarray, names: Sequence[str], own: int, values: np.ndarray, targets: np.ndarray
    ) -> np.ndarray:
        """The same of records at hand, and of what is believed of shared values, which counts as one more record.

        Parameters
        ----------
        grams : (n_record + 1, n, n)
            See `grams_at_hand`.
        names : sequence of str
        own : int
        values, targets : (n_record, n_column) in SI units
            That the columns lead from and to, shared ones first.
        """
        shared = len(names)
        sizes = relative_changes(values[:, :shared], targets[:, :shared])
        return self.held(grams, names, own, np.concatenate([sizes, sizes[:1]]))


def relative_changes(values: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Relative changes from values to others; infinite from zero."""
    changes = targets - values
    return np.divide(changes, values, out=np.full_like(changes, np.inf), where=values != 0.0)
