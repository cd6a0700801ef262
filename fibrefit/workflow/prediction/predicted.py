"""Records beside what was predicted of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fibrefit.fitting.residuals import Evaluation
from fibrefit.fitting.uncertainty import Freedom
from fibrefit.problem import ForceBalance, Problem, Task
from fibrefit.records import Record
from fibrefit.study import Study
from fibrefit.workflow.prediction.held import Held
from fibrefit.workflow.prediction.known import Known


@dataclass(frozen=True, repr=False)
class Predicted:
    """Records beside what was predicted of them.

    Parameters
    ----------
    study : Study
        Of the records, with the model and the values of the result.
    known : Known
        What the result says.
    seen : Evaluation
        The simulated motion, and how far it is from what was measured.
    force : ForceBalance or None
        What inverse dynamics leaves of a force that drives the rig.
    parts : mapping of str to (n_record, n_channel, n_time)
        Variance of each cause, in units of that of each reading's noise: ``noise``, ``model``, ``values``.
    freedom : mapping of channel to Freedom
        Of what the error bars of the values bring to its mean square.
    """

    study: Study
    records: tuple[Record, ...]
    known: Known
    held: Held
    seen: Evaluation
    force: ForceBalance | None
    parts: Mapping[str, np.ndarray]
    freedom: Mapping[str, Freedom]
    seconds: float

    @property
    def task(self) -> Task:
        """What was compared."""
        return self.held.task

    @cached_property
    def noise(self) -> np.ndarray:
        """Noise rms of each reading, ``(n_record, n_channel, n_time)`` in SI units, see `noise_of_readings`."""
        return noise_of_readings(self.task.problem)

    def sigma(self, *causes: str) -> np.ndarray:
        """Standard deviation of a new reading for some causes.

        Parameters
        ----------
        *causes : str
            Some of `parts`: what is known to make a new reading uncertain.

        Returns
        -------
        numpy.ndarray
            ``(n_record, n_channel, n_time)`` in SI units.

        Examples
        --------
        >>> prediction = result.predict(fibrefit.example("drop_series") / "holdout")
        >>> sorted(prediction.parts), prediction.sigma("noise", "model").shape[:2]
        (['model', 'noise', 'values'], (1, 2))
        """
        return np.sqrt(np.sum([self.parts[cause] for cause in causes], axis=0)) * self.noise


def noise_of_readings(problem: Problem) -> np.ndarray:
    """Noise rms of each reading, ``(n_record, n_channel, n_time)`` in SI units; it may grow with the load.

    Where nothing was measured it is that of the quietest reading of the record.
    """
    weight = np.stack([np.asarray(problem.observations.weight[c]) for c in problem.model.rig.channels], axis=1)
    return 1.0 / np.where(weight > 0.0, weight, weight.max(axis=-1, keepdims=True))
