"""From the words of a command line to the identifications of a batch."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal, NamedTuple, get_args

from fibrefit.core.errors import NO_FILES, DataError, FibrefitError, UsageError, refuse_unknown
from fibrefit.core.limits import refuse_seed, refuse_starts
from fibrefit.core.paths import nearest_file, sha256_of
from fibrefit.records.copies import Fingerprint, copies_by_fingerprint
from fibrefit.store import Run
from fibrefit.store.directory import COMMAND
from fibrefit.study import Study
from fibrefit.study.records import RecordTable
from fibrefit.workflow.batches.item import Job, Origin, loaded, refuse_places_of_series, said_of

Each = Literal["record", "study"]


class RecordConditions(NamedTuple):
    """Conditions of one record, in SI units.

    Parameters
    ----------
    values, errors : mapping of str to float
        Errors only of those that are not known exactly.
    units : mapping of str to str
    """

    values: dict[str, float]
    errors: dict[str, float]
    units: dict[str, str]

    def headed(self) -> tuple[dict[str, float], dict[str, float]]:
        """Values and errors by names with their units: ``lift [m]``."""
        heads = {name: name if unit == "-" else f"{name} [{unit}]" for name, unit in self.units.items()}
        values, errors = ({heads[name]: one for name, one in of.items()} for of in (self.values, self.errors))
        return values, errors


def origins_of(words: Sequence[str], rig: str | None, overrides: Sequence[str]) -> list[Origin]:
    """Studies that the words of a command line name.

    Parameters
    ----------
    words : sequence of str
        Study files, folders with one, folders of such folders; or bare records of one rig.
    rig : str or None
        Kind of the rig of bare records.
    overrides : sequence of str

    Raises
    ------
    UsageError
        If a folder holds no study, studies and records are mixed, a rig is named for studies, or there are no words.
    """
    if not words:
        raise UsageError("series", *NO_FILES)
    if rig is not None:
        if any(Path(word).is_dir() or Path(word).suffix.lower() == ".toml" for word in words):
            raise UsageError("--rig", rig, "bare records", "Override the study with --set rig.kind instead.")
        return [Origin(tuple(words), rig, tuple(overrides))]
    return [Origin((study,), None, tuple(overrides)) for word in words for study in _studies(word)]


def _studies(word: str) -> list[str]:
    path = Path(word)
    if path.suffix.lower() == ".toml" or (path / "study.toml").is_file():
        return [word]
    if not path.exists():
        do = nearest_file(path) or "Check the path."
        raise UsageError(word, "no such file or folder", "a study, or records", do)
    if not path.is_dir():
        raise UsageError(word, "a record, and no --rig", "studies, or records and their rig", "Add --rig fibre_mass.")
    found = sorted(file.parent.as_posix() for file in path.glob("*/study.toml"))
    if not found:
        raise UsageError(word, "a folder without studies", "a study.toml in it, or in the folders in it", "")
    return found


def jobs_of(origins: Sequence[Origin], each: Each | None, starts: int, seed: int, robust: bool = False) -> list[Job]:
    """One job a record or a study.

    Parameters
    ----------
    origins : sequence of Origin
    each : {"record", "study"} or None
        What is identified by itself; None: the records of a single study, or else each study.
    starts, seed, robust
        As for a fit.

    Returns
    -------
    list of Job
        With names of which no two are alike. A study that cannot be read is one job, which will say why.

    Raises
    ------
    FibrefitError
        If the only study there is cannot be read or goes by the places of its records, starts are more than memory
        holds, or an argument makes no sense.
    """
    if each is not None:
        refuse_unknown("each", each, get_args(Each))
    refuse_starts(starts)
    refuse_seed(seed)
    each = each or ("record" if len(origins) == 1 else "study")
    named: list[tuple[str, Origin, int | None]] = []
    for origin in origins:
        named += _named(origin, each, len(origins) > 1)
    taken: dict[str, int] = {}
    jobs = []
    for name, origin, record in named:
        unique, number = name, taken.get(name, 1)
        while unique in taken:
            number += 1
            unique = f"{name} ({number})"
        taken |= {name: number, unique: 1}
        says = "" if record is None else said_of(loaded(origin), record)
        jobs.append(Job(unique, origin, record, starts, seed, robust, says))
    return jobs


def _named(origin: Origin, each: Each, several: bool) -> list[tuple[str, Origin, int | None]]:
    where = Path(origin.files[0])
    name = where.name if where.is_dir() else where.parent.name if where.name == "study.toml" else where.stem
    if each == "study" and origin.rig is None:
        return [(name, origin, None)]
    try:
        study = loaded(origin)
        study.refuse_without_records()
    except FibrefitError:
        if not several:
            raise
        return [(name, origin, None)]
    if each == "study":
        return [(study.name, origin, None)]
    if not several:  # or else it is the error of these items
        refuse_places_of_series(study)
    return [
        (f"{name}/{record.label}" if several else record.label, origin, number)
        for number, record in enumerate(study.records)
    ]


def copies_of(jobs: Sequence[Job]) -> dict[str, str]:
    """Why records are not identified that hold the same bytes as one before them, read alike: copies are no evidence.

    Returns
    -------
    dict of str to str
        By the names of their jobs.
    """
    first: dict[tuple[str, ...], str] = {}
    copies = {}
    for job in jobs:
        if job.record is None:
            continue
        with suppress(FibrefitError, OSError):  # what cannot be read says so as an item
            study = job.study
            (record,) = study.records
            held = tuple(sha256_of(study.path_of(file)) for file in record.files)
            # Two gauges of one file are two measurements.
            other = first.setdefault((*held, repr(study.reading(record))), job.name)
            if held and other != job.name:
                copies[job.name] = _copy_of(job.name, other)
    return copies


def copies_seen(names: Sequence[str], fingerprints: Mapping[str, Fingerprint]) -> dict[str, str]:
    """The same of records that hold the data of one before them in other bytes, such as with other digits.

    Parameters
    ----------
    names : sequence of str
        Of the jobs, in their order.
    fingerprints : mapping of str to Fingerprint
        Of the records of those that were carried out.
    """
    known = [name for name in names if name in fingerprints]
    found = copies_by_fingerprint([fingerprints[name] for name in known])
    return {known[copy]: _copy_of(known[copy], known[first]) for copy, first in sorted(found.items())}


def _copy_of(name: str, other: str) -> str:
    do = "Take one of the two off the list: a copy is no further evidence."
    return str(DataError(name, f'the same data as "{other}"', "each measurement once", do))


def run_of(jobs: Sequence[Job]) -> Run:
    """What a batch rests on. It may grow and change: each item that is taken up tells by its digest what it is of."""
    origins = list(dict.fromkeys(job.origin for job in jobs))
    named = [Path(file) for origin in origins for file in origin.files]
    read = [file for study in studies_of(origins) for file in study.input_files()]
    return Run(tuple(dict.fromkeys([*named, *read])), {COMMAND: "batch"})


def studies_of(origins: Sequence[Origin]) -> Iterator[Study]:
    """The studies that can be read."""
    for origin in origins:
        with suppress(FibrefitError):
            yield loaded(origin)


def record_conditions(jobs: Sequence[Job]) -> dict[str, RecordConditions]:
    """What is known of the records that were identified by themselves; nothing of those that cannot be read."""
    from fibrefit.workflow.together.conditions import stated_conditions, units_of_conditions

    records: dict[str, RecordTable] = {}
    units: dict[str, str] = {}
    for job in jobs:
        if job.record is None:
            continue
        with suppress(FibrefitError):
            study = job.study
            records[job.name] = study.records[0]
            units |= units_of_conditions(study)
    found = {name: RecordConditions({}, {}, {}) for name in records}
    for one in stated_conditions(units, list(records.values())):
        for name, value, error in zip(records, one.values.tolist(), one.errors.tolist(), strict=True):
            if math.isfinite(value):
                found[name].values[one.name], found[name].units[one.name] = value, one.unit
                found[name].errors.update({one.name: error} if error else {})
    return found
