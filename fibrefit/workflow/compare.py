"""Posteriors of the same data beside each other: which model predicts better what was left out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import sha256_of
from fibrefit.problem import Problem
from fibrefit.sampling.evidence import Evidence
from fibrefit.sampling.predict import CrossValidation
from fibrefit.sampling.thresholds import PARETO_K
from fibrefit.store import read_result, read_summary
from fibrefit.study import Study
from fibrefit.study.summaries.part import Measure
from fibrefit.study.summaries.results import ComparedModel, PosteriorSummary
from fibrefit.workflow.groups_in_common import observed_group

FEWEST_BLOCKS = 2
"""Of which a scatter can be told."""


@dataclass(frozen=True)
class Rival:
    """An earlier posterior of the same records.

    Parameters
    ----------
    blocks, pareto_k : (n_block,)
        Expected log density of each block left out, and how reliable that is.
    observed : mapping of channel to (n_record, n_time) in SI units
        Readings that it counts; NaN where it does not.
    """

    folder: Path
    summary: PosteriorSummary
    blocks: np.ndarray
    pareto_k: np.ndarray
    observed: Mapping[str, np.ndarray]


def rival_of(folder: Path, study: Study) -> Rival:
    """An earlier posterior, if it is one of the same records.

    Parameters
    ----------
    folder : pathlib.Path
        Folder of its result.
    study : Study
        The one it is compared with.

    Raises
    ------
    UsageError
        If it is no posterior, one that failed, one of other records or of another order of them, or one without blocks
        to compare by.
    """
    summary = read_summary(folder)
    if not isinstance(summary, PosteriorSummary) or summary.provenance is None:
        raise UsageError(str(folder), "not a posterior", "the result of fibrefit sample", "Name another folder.")
    if summary.status == "failed":
        do = "Mend it first: fibrefit show tells which check failed; chains go on with --resume."
        raise UsageError(str(folder), "a posterior that failed its checks", "one that can be relied on", do)
    mine = {sha256_of(study.path_of(file)): record.label for record in study.records for file in record.files}
    # Inputs are listed in the order of the records.
    theirs = list(dict.fromkeys(digest for digest in summary.provenance.inputs.values() if digest in mine))
    other = [label for digest, label in mine.items() if digest not in theirs]
    if other:
        raise UsageError(
            str(folder), f"a posterior of other records: {other[0]} is not among them", "the same records",
            "Sample both models on the same study.",
        )  # fmt: skip
    if theirs != list(mine):
        first, here = next((mine[their], mine[my]) for their, my in zip(theirs, mine, strict=True) if their != my)
        raise UsageError(
            str(folder), f"a posterior with {first} where {here} is here", "the same order of records",
            "Blocks of time are compared one by one: list the records of both studies alike.",
        )  # fmt: skip
    if len(summary.records) != len(study.records):
        raise UsageError(
            str(folder), f"a posterior of {len(summary.records)} records", f"one of {len(study.records)}, as here",
            "Sample both models on the same study.",
        )  # fmt: skip
    groups, _ = read_result(folder / "result.h5" if folder.is_dir() else folder.with_name("result.h5"))
    left_out = groups["cross_validation"]
    blocks, pareto_k = (np.asarray(left_out[name].values, dtype=float) for name in ("elpd", "pareto_k"))
    if len(blocks) < FEWEST_BLOCKS:
        raise UsageError(
            str(folder), "a posterior of a single block of time", "two blocks or more",
            "How sure a difference is comes of how it scatters between blocks: sample longer records.",
        )  # fmt: skip
    observed = groups["observed_data"]
    seen = {n: np.asarray(one.values, dtype=float) for n, one in observed.items() if n != "record"}
    return Rival(folder, summary, blocks, pareto_k, seen)


def refuse_other_readings(rival: Rival, problem: Problem) -> None:
    """Refuse a rival of which the same files were read otherwise: its density is one of other data.

    Parameters
    ----------
    rival : Rival
    problem : Problem
        Of the posterior that it is compared with.

    Raises
    ------
    UsageError
        If it has other channels, or other readings in one of them, or counts others.
    """
    mine = {name: one.values for name, one in observed_group(problem, defaultdict(str)).items()}
    for name in ("time", *problem.model.rig.channels):
        theirs, own = rival.observed.get(name), np.asarray(mine[name], dtype=float)
        if theirs is None or theirs.shape != own.shape or not np.allclose(theirs, own, rtol=1e-9, equal_nan=True):
            what = "other times" if name == "time" else f"other readings of {name}"
            raise UsageError(
                str(rival.folder), f"a posterior of {what}", "the same readings of the records",
                "Columns, units, scales, clocks and masks of both studies must be alike.",
            )  # fmt: skip


def compared(own: CrossValidation, evidence: Evidence | None, rival: Rival, noise: str) -> ComparedModel:
    """One model against another: block by block, so that what both find hard cancels.

    Parameters
    ----------
    noise : str
        Kind of the noise of this one. A spectrum is found before the first draw and has no prior: of two kinds one has
        more numbers than the other, and a marginal likelihood does not pay for them.

    Raises
    ------
    UsageError
        If the other one counts other samples of the records.
    """
    if len(own.blocks) != len(rival.blocks):
        raise UsageError(
            str(rival.folder), f"{len(rival.blocks)} blocks of time", f"{len(own.blocks)}, as here",
            "Both must use the same samples of the records.",
        )  # fmt: skip
    difference = own.blocks - rival.blocks
    sure = np.maximum(own.pareto_k, rival.pareto_k) <= PARETO_K
    # Heavy tails are a value with a prior, behind the kind of the noise.
    same_noise = rival.summary.likelihood.partition(",")[0] == noise
    theirs, both = rival.summary.log_evidence, None
    if evidence is not None and theirs is not None and same_noise:
        error = float(np.hypot(evidence.error, theirs.error))
        both = Measure(value=evidence.log_value - theirs.value, error=error)
    return ComparedModel(
        result=rival.folder.as_posix(),
        study=rival.summary.study,
        effects=rival.summary.effects,
        elpd=_summed(difference),
        blocks=len(difference),
        unsure=int(np.sum(~sure)),
        elpd_sure=_summed(difference[sure]) if np.sum(sure) >= FEWEST_BLOCKS else None,
        log_evidence=both,
        same_noise=same_noise,
    )


def _summed(blocks: np.ndarray) -> Measure:
    """Sum over blocks, with the error that their scatter tells."""
    return Measure(value=float(blocks.sum()), error=float(np.sqrt(len(blocks) * np.var(blocks, ddof=1))))
