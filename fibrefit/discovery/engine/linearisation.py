"""Where readings were linearised in the errors of measured inputs: little, and what they react by follows from it.

What readings react by is tens of megabytes, and takes a second or so for each record to be found.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.problem import InputCoefficients, InputSensitivities, Task, sensitivities_of


class Reactions(NamedTuple):
    """What the reactions of readings to errors of inputs follow from.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Values of a model.
    coefficients : mapping of input to (n_record, n_wave)
        The errors.
    far : bool
        Whether readings count up to the first bounces alone, see `sensitivities_of`.
    counts : (n_record,) int, optional
        Samples of each record that count; all by default.
    """

    local: np.ndarray
    coefficients: InputCoefficients
    far: bool = False
    counts: np.ndarray | None = None

    def sensitivities(self, task: Task) -> InputSensitivities:
        """The reactions themselves, in the task of the model."""
        # What does not count is not simulated either.
        seen = task if self.counts is None else replace(task, problem=task.problem.until(self.counts))
        found = sensitivities_of(seen, self.local, self.coefficients, self.far)
        assert found is not None
        return found if self.counts is None else found.until(self.counts.tolist())


class Linearisation(NamedTuple):
    """How readings came to be linearised where they are.

    Parameters
    ----------
    local : (n_record, n_local) in SI units, optional
        Values of the model there; None where a search begins.
    reactions : Reactions, optional
        Those that were found anew; by default those that a search began with.
    later : tuple of mapping of input to (n_record, n_wave)
        Errors about which the same reactions were taken since then, one after the other.
    """

    local: np.ndarray | None = None
    reactions: Reactions | None = None
    later: tuple[InputCoefficients, ...] = ()

    def about(self, local: np.ndarray, coefficients: InputCoefficients) -> Linearisation:
        """The same reactions about other errors, at other values."""
        return self._replace(local=local, later=(*self.later, coefficients))

    def sensitivities(self, task: Task, begun: InputSensitivities) -> InputSensitivities:
        """The reactions themselves, to the last bit.

        Parameters
        ----------
        task : Task
            Of the model.
        begun : InputSensitivities
            Those that the search began with.
        """
        found = begun if self.reactions is None else self.reactions.sensitivities(task)
        for coefficients in self.later:
            found = found.about(coefficients)
        return found


AS_BEGUN = Linearisation()
"""As readings are linearised where a search begins."""


def linearised_at(reactions: Reactions) -> Linearisation:
    """Readings that were just linearised there."""
    return Linearisation(reactions.local, reactions)
