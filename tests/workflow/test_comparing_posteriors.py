"""Posteriors beside each other: the same records in the same order, and blocks enough to tell how sure a sum is."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.errors import UsageError
from fibrefit.sampling.compare import CrossValidation
from fibrefit.store import sha256_of
from fibrefit.store.hdf5 import Variable
from fibrefit.study import Study
from fibrefit.study.summaries.summaries import PosteriorSummary, Provenance
from fibrefit.workflow import compare
from fibrefit.workflow.compare import Rival, rival_of
from fibrefit.workflow.sampling import files
from fibrefit.workflow.sampling.files import scored_draws


def a_study(folder: Path, **contents: str) -> Study:
    """A study of files with some content, in the order in which they are named."""
    folder.mkdir()
    records = []
    for name, content in contents.items():
        (folder / name).write_text(content)
        records.append(SimpleNamespace(label=name, file=name, files=(name,)))
    return cast(Any, SimpleNamespace(records=records, path_of=lambda file: folder / file))


def asked(
    study: Study, others: Study, monkeypatch: pytest.MonkeyPatch, blocks: tuple[float, ...] = (1.0, 2.0)
) -> Rival:
    """A posterior of the records of another study, as a rival of one of this study."""
    paths = [others.path_of(record.file) for record in others.records]  # type: ignore[arg-type]
    origin = Provenance(
        created="", versions={}, inputs={p.as_posix(): sha256_of(p) for p in paths}, resolved_study=""
    )  # fmt: skip
    summary = PosteriorSummary.model_construct(provenance=origin)
    labels = np.array([record.label for record in others.records], dtype=object)
    groups = {
        "cross_validation": {"elpd": Variable(np.array(blocks), ("block",))},
        "log_likelihood": {"block_record": Variable(labels, ("block",))},
    }
    monkeypatch.setattr(compare, "read_summary", lambda folder: summary)
    monkeypatch.setattr(compare, "read_result", lambda path: (groups, ""))
    return rival_of(Path("rival"), study)


def test_records_are_known_by_their_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = a_study(tmp_path / "here", a="first", b="second")
    renamed = a_study(tmp_path / "renamed", b="first", c="second")
    np.testing.assert_array_equal(asked(study, renamed, monkeypatch).blocks, [1.0, 2.0])


def test_the_same_names_in_the_same_order_are_no_order_of_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = a_study(tmp_path / "here", a="first", b="second")
    turned = a_study(tmp_path / "turned", a="second", b="first")
    with pytest.raises(UsageError, match="a posterior with b where a is here"):
        asked(study, turned, monkeypatch)


def test_a_rival_with_a_single_block_is_refused_before_anything_is_sampled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = a_study(tmp_path / "here", a="first")
    with pytest.raises(UsageError, match="two blocks or more"):
        asked(study, study, monkeypatch, (1.0,))


def test_of_a_single_block_no_sum_with_an_error_is_told() -> None:
    assert files._cross_validation(CrossValidation(np.array([5.0]), np.array([0.1]), 2.0)) is None
    two = files._cross_validation(CrossValidation(np.array([5.0, 7.0]), np.array([0.1, 0.2]), 2.0))
    assert two is not None
    assert (two.total.value, two.total.error) == (12.0, pytest.approx(2.0))


@pytest.mark.parametrize(("ensembles", "number"), [(4, 200), (800, 1), (801, 1), (3000, 1)])
def test_the_likelihood_is_kept_of_a_draw_of_each_ensemble_at_the_least(ensembles: int, number: int) -> None:
    places = scored_draws(2000, ensembles)
    assert len(places) == number
    assert 0 <= places.min() <= places.max() < 2000
