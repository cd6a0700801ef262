"""What the walkers begin around: a fit, kept beside the chains so that they go on from the same numbers."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fibrefit.core.errors import UsageError
from fibrefit.core.limits import Progress
from fibrefit.core.paths import write_whole
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.problem import InputCoefficients, Task
from fibrefit.records import Record
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
    rests_on : str
        Digest of the study and its records, see `digest_of`.
    """

    names: tuple[str, ...]
    values: np.ndarray
    plain: np.ndarray
    basins: tuple[np.ndarray, ...]
    status: str
    coefficients: InputCoefficients = field(default_factory=dict)
    rests_on: str = ""

    def save(self, folder: Path) -> None:
        """Keep it in a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        basins = [basin.tolist() for basin in self.basins]
        ends = {"values": self.values.tolist(), "plain": self.plain.tolist(), "basins": basins}
        coefficients = {name: np.asarray(rows).tolist() for name, rows in self.coefficients.items()}
        content = {"names": self.names, **ends, "status": self.status, "waves": coefficients, "rests_on": self.rests_on}
        write_whole(folder / START, json.dumps(content, indent=1) + "\n")

    def checks(self) -> tuple[Check, ...]:
        """Whether the fit came to an end that can be built on."""
        usable = Check(
            name="the initial fit is usable",
            passed=self.status != "failed",
            identifier="initial_fit",
            quantity="status of the initial fit",
            facts={"status": self.status},
        )
        return (usable,)


def digest_of(study: Study, records: Sequence[Record]) -> str:
    """Digest of rig, model with its laws, and conditions, and of the records as they were read, wherever they lie.

    Walkers may begin around a fit with other priors or limits; which values are free is compared by their names.
    """
    told = tomllib.loads(study.resolved_toml(relative_to=study.data_files()[0].parent))
    told = {key: said for key, said in told.items() if key not in ("name", "parameters")}
    found = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
    for record in records:
        for values in (record.time, *(record.channels[role] for role in sorted(record.channels))):
            found.update(np.ascontiguousarray(values).tobytes())
    return found.hexdigest()


def begin(
    rests_on: str,
    task: Task,
    fit: Fit | None,
    seed: int,
    folder: Path | None,
    progress: Progress,
) -> SamplingStart:
    """Where the walkers begin: where they began before, around the fit that is given, or around one made now; kept.

    Parameters
    ----------
    rests_on : str
        Digest of the study and its records, see `digest_of`.
    folder : pathlib.Path or None
        Where it is kept, and where an earlier run may have kept it.

    Raises
    ------
    UsageError
        If the fit is none, or rests on another model or other records; if what was kept does, was kept of another fit,
        or cannot be read.
    """
    names = task.problem.layout.free_names
    start = None if fit is None else _agreeing(_given(fit), names, rests_on, "start")
    if folder is not None and (folder / START).exists():
        kept = _agreeing(_read(folder / START), names, rests_on, str(folder / START))
        if start is not None and not (_equal(start.values, kept.values) and _equal(start.plain, kept.plain)):
            do = "Leave the start out to go on with what is there, or name another folder."
            raise UsageError(str(folder / START), "kept of a run around another fit", "the fit it began around", do)
        return kept
    if start is None:
        start = start_of(identify(task, starts=FIT_STARTS, seed=seed, progress=progress), rests_on)
    if folder is not None:
        start.save(folder)
    return start


def _given(fit: Fit) -> SamplingStart:
    if not isinstance(fit, Fit):
        do = "Fit the study and give that, or leave the start out."
        raise UsageError("start", f"a {type(fit).__name__}", "a fit, as fibrefit.fit returns it", do)
    return start_of(fit.identification, digest_of(fit.study, fit.records))


def _equal(one: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(one, other, equal_nan=True)


def start_of(found: Identification, rests_on: str) -> SamplingStart:
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
        rests_on,
    )


def _read(path: Path) -> SamplingStart:
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        basins = tuple(np.array(basin, dtype=float) for basin in kept["basins"])
        values, plain = (np.array(kept[name], dtype=float) for name in ("values", "plain"))
        coefficients = {name: np.array(rows, dtype=float) for name, rows in kept["waves"].items()}
        names, status, rests_on = tuple(kept["names"]), str(kept["status"]), str(kept["rests_on"])
        return SamplingStart(names, values, plain, basins, status, coefficients, rests_on)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise UsageError(
            str(path), f"cannot be read: {error}", "what this program kept", "Start anew, with --force."
        ) from None


def _agreeing(start: SamplingStart, names: tuple[str, ...], rests_on: str, where: str) -> SamplingStart:
    if start.names == names and start.rests_on == rests_on:
        return start
    other = sorted(set(start.names) ^ set(names))
    got = "a fit of another rig, another model or other data"
    if other:
        got = f"a fit of other parameters ({', '.join(other[:4])})"
    do = "Fit this study, or leave the start out." if where == "start" else "Start anew in another folder."
    raise UsageError(where, got, "a fit of the same study, model and data", do)
