"""What the walkers begin around: a fit, kept beside the chains so that they go on from the same numbers."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.core.progress import Progress
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients
from fibrefit.problem.task import Task
from fibrefit.store.files import write_whole
from fibrefit.study import Study
from fibrefit.study.summaries.check import Check
from fibrefit.workflow.fit import FIT_STARTS, Fit

CHAINS = "chains.npz"
START = "start.json"
KEPT = (START, "chains-*.npz", CHAINS)
"""What a run goes on from."""
MOST_BASINS = 8
"""Other minima of the search that are looked into, the deepest first."""


@dataclass(frozen=True)
class SamplingStart:
    """A fit, as far as a posterior needs it.

    Parameters
    ----------
    values : (n_free,) in SI units
    plain : (n_free,) in SI units
        Of plain least squares: the same where the fit reports it.
    basins : tuple of (n_free,) in SI units
        Other minima of the search.
    status : str
        Of the fit.
    coefficients : mapping of input to (n_record, n_wave)
        Errors of measured inputs that it found.
    """

    names: tuple[str, ...]
    values: np.ndarray
    plain: np.ndarray
    basins: tuple[np.ndarray, ...]
    status: str
    coefficients: InputCoefficients = field(default_factory=dict)

    def save(self, folder: Path) -> None:
        """Keep it in a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        basins = [basin.tolist() for basin in self.basins]
        ends = {"values": self.values.tolist(), "plain": self.plain.tolist(), "basins": basins}
        coefficients = {name: np.asarray(rows).tolist() for name, rows in self.coefficients.items()}
        content = {"names": self.names, **ends, "status": self.status, "waves": coefficients}
        write_whole(folder / START, json.dumps(content, indent=1) + "\n")

    def check(self) -> Check:
        """Whether the fit came to an end that can be built on."""
        return Check(
            name="the initial fit is usable",
            passed=self.status != "failed",
            identifier="initial_fit",
            quantity="status of the initial fit",
            facts={"status": self.status},
        )


def begin(
    study: Study,
    task: Task,
    fit: Fit | None,
    seed: int,
    folder: Path | None,
    progress: Progress,
) -> SamplingStart:
    """Where the walkers begin: where they began before, around the fit that is given, or around one made now; kept.

    Parameters
    ----------
    folder : pathlib.Path or None
        Where it is kept, and where an earlier run may have kept it.

    Raises
    ------
    StudyError
        If every parameter is held.
    UsageError
        If the fit is that of another model, or what was kept cannot be read.
    """
    names = task.problem.layout.free_names
    if not names:
        do = "Leave out fixed = true for one of them, or ask for fibrefit simulate."
        raise StudyError(str(study.source), "every parameter is held", "at least one that is free", do)
    if folder is not None and (folder / START).exists():
        return _agreeing(_read(folder / START), names, str(folder / START))
    if fit is not None:
        start = _agreeing(start_of(fit.identification), names, "start")
    else:
        start = start_of(identify(task, starts=FIT_STARTS, seed=seed, progress=progress))
    if folder is not None:
        start.save(folder)
    return start


def start_of(found: Identification) -> SamplingStart:
    """From an identification: the best minimum, and the best start of each other one."""
    starts = found.starts
    basins = []
    for basin in range(1, min(int(starts.basin.max(initial=0)), MOST_BASINS) + 1):
        inside = np.flatnonzero(starts.basin == basin)
        if inside.size:
            basins.append(starts.values[inside[np.argmin(starts.cost[inside])]])
    return SamplingStart(
        found.problem.layout.free_names,
        found.values,
        found.plain.values,
        tuple(basins),
        found.status,
        found.coefficients,
    )


def _read(path: Path) -> SamplingStart:
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        basins = tuple(np.array(basin, dtype=float) for basin in kept["basins"])
        values, plain = (np.array(kept[name], dtype=float) for name in ("values", "plain"))
        coefficients = {name: np.array(rows, dtype=float) for name, rows in kept["waves"].items()}
        return SamplingStart(tuple(kept["names"]), values, plain, basins, str(kept["status"]), coefficients)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise UsageError(
            str(path), f"cannot be read: {error}", "what this program kept", "Start anew, with --force."
        ) from None


def _agreeing(start: SamplingStart, names: tuple[str, ...], where: str) -> SamplingStart:
    if start.names != names:
        other = sorted(set(start.names) ^ set(names))
        raise UsageError(
            where, f"a fit of other parameters ({', '.join(other[:4])})", "a fit of the same study and model",
            "Fit this study, or leave the start out.",
        )  # fmt: skip
    return start
