"""``fit``: a study in, an identification out, and its files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fibrefit.core.errors import UsageError
from fibrefit.core.limits import Progress
from fibrefit.core.threads import one_blas_thread
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification
from fibrefit.problem import Task
from fibrefit.records import Record
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.results import FitSummary, ParameterSummary
from fibrefit.workflow.fit_files import fit_groups, fit_summary
from fibrefit.workflow.prediction.predicts import Predicts
from fibrefit.workflow.prepare import read_records, task_of, task_to_fit

if TYPE_CHECKING:
    from fibrefit.plots.figures import Figures
    from fibrefit.study.summaries.part import Variable

FIT_STARTS = 32


@dataclass(frozen=True, repr=False)
class Fit(Predicts):
    """An identified study.

    Parameters
    ----------
    study : Study
    records : tuple of Record
    identification : Identification
    seed : int
    """

    study: Study
    records: tuple[Record, ...]
    identification: Identification
    seed: int

    @property
    def status(self) -> str:
        """``ok``, ``suspect`` or ``failed``."""
        return self.identification.status

    @property
    def parameters(self) -> dict[str, ParameterSummary]:
        """Parameters that all records share, by name, in SI units."""
        return self.identification.parameters

    @property
    def values(self) -> np.ndarray:
        """All free values, ``(n_free,)`` in SI units, in the order of `covariance`."""
        return self.identification.values

    def summary(self) -> FitSummary:
        """Content of ``summary.json``."""
        inputs = self.study.input_files()
        origin = provenance(self.study, inputs, seed=self.seed, seconds=self.identification.seconds)
        return fit_summary(self.study, self.records, self.identification, origin)

    def groups(self) -> dict[str, dict[str, Variable]]:
        """Arrays of ``result.h5``."""
        return self._arrays

    @cached_property
    def _arrays(self) -> dict[str, dict[str, Variable]]:
        return fit_groups(self.identification)

    def first_figures(self) -> Figures:
        """The overview: all eleven pictures of five records take as long as their fit."""
        from fibrefit.plots.fit import fit_overview

        return fit_overview(self.summary(), self.groups())


@one_blas_thread
def fit_study(
    study: Study | str | Path, *, starts: int = FIT_STARTS, seed: int = 0, robust: bool = False, profile: bool = False,
    progress: Progress | None = None, stop: Callable[[], bool] = lambda: False,
) -> Fit:  # fmt: skip
    """Identify the model of a study from its records by least squares.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        A path is that of a study file, or of a folder with a ``study.toml``.
    starts : int
        Starts of the multistart.
    seed : int
        Of the scatter of starts; the same seed gives the same result.
    robust, profile : bool
        Soft-L1 loss for residuals beyond three times the noise; profile-likelihood intervals of shared parameters
        in which records do not differ.
    progress : callable, optional
        Called with what is being done and the share that is finished.
    stop : callable
        Called now and then: whether to conclude with what there is; the result then fails a check that says so.

    Returns
    -------
    Fit
        With ``parameters``, ``status``, ``report()``, ``summary()``, ``to_dataframe()``, ``covariance``,
        ``correlation``, ``residuals``, ``to_datatree()``, ``plot()``, ``predict(study)`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood, or does not show what the rig's motion should.
    StudyError
        If the study and the model do not fit together, or nothing is free.
    UsageError
        If a profile is asked for of a rig that is led by a measured drive.
    KeyboardInterrupt
        If it is stopped before anything is known.

    Examples
    --------
    >>> result = fibrefit.fit(fibrefit.example("drop_series"), starts=4)
    >>> result.status
    'ok'
    >>> low, high = result.parameters["stiffness"].interval_95
    >>> bool(low < 11150.6 < high)
    True
    """
    study = as_study(study)
    if progress:
        progress("reading records", None)
    records, task = prepared(study)
    if profile:
        _refuse_measured_drive(task)
    if stop():
        stopped = KeyboardInterrupt()
        stopped.add_note("Nothing is known yet; nothing was written.")
        raise stopped
    found = identify(task, starts, seed, How(robust, profile), progress=progress, stop=stop)
    return Fit(study, records, found, seed)


def _refuse_measured_drive(task: Task) -> None:
    """Refuse a profile where inputs have errors: it takes them for exact."""
    if task.noisy_inputs:
        raise UsageError(
            "--profile", f"the {', '.join(task.noisy_inputs)} that leads the simulation is measured with noise",
            "inputs that are exact", "Leave it out: intervals of the fit allow for that noise, a profile takes none.",
        )  # fmt: skip


def prepared(study: Study) -> tuple[tuple[Record, ...], Task]:
    """Records of a study, and the task they are identified by.

    Raises
    ------
    DataError, StudyError
        As `fit_study`.
    """
    records = read_records(study)
    return records, task_to_fit(study, task_of(study, records))
