"""One identification of a batch: what is sent to a worker, and what comes back."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from fibrefit.core.environment import versions
from fibrefit.core.errors import DataError, FibrefitError, StudyError
from fibrefit.core.paths import sha256_of
from fibrefit.core.threads import one_blas_thread
from fibrefit.records.copies import Fingerprint, fingerprint_of
from fibrefit.report.checks import quantity_of
from fibrefit.study import Study, load_study, study_from_files
from fibrefit.study.summaries.check import Status, failed_model_checks
from fibrefit.study.summaries.results import FitSummary
from fibrefit.study.summaries.series import BatchItem


@dataclass(frozen=True)
class Origin:
    """Where a study comes from, as the command line said it.

    Parameters
    ----------
    files : tuple of str
        One study, or bare records.
    rig : str or None
        Kind of the rig of bare records.
    overrides : tuple of str
    """

    files: tuple[str, ...]
    rig: str | None
    overrides: tuple[str, ...]

    def load(self) -> Study:
        """The study."""
        if self.rig is None:
            return load_study(self.files[0], self.overrides, some_missing=True)
        return study_from_files(self.files, self.rig, self.overrides)


@dataclass(frozen=True)
class Job:
    """One identification.

    Parameters
    ----------
    name : str
        In the results.
    origin : Origin
    record : int or None
        Place of the record in its study; None for the whole study.
    starts : int
    seed : int
    robust : bool
    says : str
        Digest of all that the study says of the record; empty where the whole study is identified.
    """

    name: str
    origin: Origin
    record: int | None
    starts: int
    seed: int
    robust: bool = False
    says: str = ""

    @property
    def study(self) -> Study:
        """What is identified.

        Raises
        ------
        StudyError
            If it says something else of the record by now, such as of another one in its place.
        """
        study = loaded(self.origin)
        if self.record is None:
            return study
        if self.says and self.says != said_of(study, self.record):
            got = f'says something else of "{self.name}" than when the batch began, or has it in another place'
            do = "Run the same again with --resume: what it says now is identified."
            raise StudyError(str(study.source), got, "a study that stays as it is", do)
        record = study.records[self.record]
        return study.model_copy(update={"name": f"{study.name}, {record.label}", "records": (record,)})

    def digest(self) -> str:
        """Of all the result depends on: study, files, settings, versions.

        Raises
        ------
        DataError
            If a file cannot be read.
        """
        study = self.study
        parts = [study.resolved_toml(), repr((self.starts, self.seed, self.robust)), _versions()]
        # The study's own file may hold a thousand other records: what of it counts is in the resolved study.
        parts += [sha256_of(file) for file in study.data_files()]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def said_of(study: Study, record: int) -> str:
    """Digest of what a study says of one of its records and of all of them; empty where it has no such record.

    A batch takes hours, in which records may be added to its study: those that stay in their places are the same.
    """
    if record >= len(study.records):
        return ""
    said = study.model_dump_json(exclude={"records"}), study.records[record].model_dump_json()
    return hashlib.sha256("\0".join(said).encode()).hexdigest()


@lru_cache(maxsize=1)
def _versions() -> str:
    """All packages a result depends on; they do not change while a process runs."""
    return repr(sorted(versions().items()))


def loaded(origin: Origin) -> Study:
    """Study of an origin: a series of a thousand records is read once a process, and again once its files change."""
    known = _read.get(origin)
    if known is None or known[0] != _stamps(known[1]):
        study = origin.load()
        _read[origin] = known = (_stamps(study), study)
        while len(_read) > MOST_READ:
            _read.pop(next(iter(_read)))
    return known[1]


_read: dict[Origin, tuple[tuple[tuple[int, int], ...], Study]] = {}
MOST_READ = 8
"""Studies that a process keeps at hand."""


def _stamps(study: Study) -> tuple[tuple[int, int], ...]:
    """Size and time of the files that state a study."""
    return tuple((stat.st_size, stat.st_mtime_ns) for stat in (file.stat() for file in study.stated_in()))


FEW = 4
"""Starts of a first search; all of them follow where a check of its numbers does not pass."""


class Outcome(NamedTuple):
    """What a worker sends back: all that is kept of an item, as it is written.

    Parameters
    ----------
    summary : str
        Content of ``summary.json`` of the fit.
    item : str
        Content of ``item.json``: what the table has of it, what it rests on and the SHA-256 of each file as it was
        read, by what copies of its record are known.
    status : {"ok", "suspect", "failed"}
    """

    summary: str
    item: str
    status: Status


@one_blas_thread
def identified(job: Job) -> Outcome:
    """Carry out one identification.

    Raises
    ------
    FibrefitError
        If its study or its records are not understood.
    """
    from fibrefit.fitting.identify import How, identify
    from fibrefit.workflow.fit import Fit, prepared

    # Before anything is read: of a record that changes meanwhile the result is then none.
    digest = _digest_of(job)
    if job.record is not None:
        refuse_places_of_series(loaded(job.origin))
    study = job.study
    records, task = prepared(study)
    how = How(job.robust, often=True)
    found = identify(task, min(job.starts, FEW), job.seed, how)
    if found.status != "ok" and job.starts > FEW:
        found = identify(task, job.starts, job.seed, how)
    fingerprint = None if job.record is None else fingerprint_of(records[0])
    return outcome_of(job, Fit(study, records, found, job.seed).summary(), digest, fingerprint)


def refuse_places_of_series(study: Study) -> None:
    """Refuse effects that go by the place of a record in its series, which one that is identified by itself has not.

    Raises
    ------
    StudyError
        Naming the first of them; none where the model is not understood: identifying a record says so.
    """
    from fibrefit.workflow.prepare import model_of, refuse_places

    if len(study.records) < 2:
        return
    try:
        effects = model_of(study).effects
    except FibrefitError:
        return
    do = "Take it out of the model; or identify the series as a whole: fibrefit fit, or batch --each study."
    refuse_places(effects, str(study.source), do)


def _digest_of(job: Job) -> str:
    """Digest of a job; of one whose files cannot be read none, so that reading them says which."""
    try:
        return job.digest()
    except DataError:
        return ""


def outcome_of(job: Job, summary: FitSummary, digest: str, fingerprint: Fingerprint | None = None) -> Outcome:
    """What is kept of an identification.

    Parameters
    ----------
    job : Job
    summary : FitSummary
    digest : str
        Of all it rests on, as it was before it was read; see `Job.digest`.
    fingerprint : Fingerprint, optional
        Of the record, by which copies are known; none where a whole study was identified.
    """
    item = BatchItem(
        status=summary.status,
        parameters=summary.parameters,
        gap=summary.gap.total,
        lacks=tuple(quantity_of(check) for check in failed_model_checks(summary.checks)),
        speeds=_speeds(summary) if job.record is not None else {},
    )
    seen = None if fingerprint is None else fingerprint._asdict()
    inputs = {} if summary.provenance is None else summary.provenance.inputs
    content = {"digest": digest, "item": item.model_dump(mode="json"), "fingerprint": seen, "inputs": inputs}
    whole = summary.model_dump_json(by_alias=True, indent=1) + "\n"
    return Outcome(whole, json.dumps(content, indent=1) + "\n", summary.status)


def _speeds(summary: FitSummary) -> dict[str, float]:
    """Root mean square of the speeds at which the one record of a fit tells of each parameter."""
    return {name: middle for one in summary.records.values() for name, (_, middle, _) in one.speeds.items()}
