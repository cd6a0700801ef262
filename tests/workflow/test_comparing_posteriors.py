"""Posteriors beside each other: the same records in the same order, and blocks enough to tell how sure a sum is."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import sha256_of
from fibrefit.report.posterior import better_model, posterior_report
from fibrefit.sampling.evidence import Evidence
from fibrefit.sampling.predict import CrossValidation
from fibrefit.series.thresholds import SIGNIFICANT
from fibrefit.study import Study
from fibrefit.study.summaries.part import Measure, Variable
from fibrefit.study.summaries.results import ComparedModel, PosteriorSummary, Provenance
from fibrefit.workflow import compare
from fibrefit.workflow.compare import Rival, compared, rival_of
from fibrefit.workflow.sampling import files
from fibrefit.workflow.sampling.files import scored_draws
from tests.report.test_posterior import PLAIN


def a_study(folder: Path, **contents: str) -> Study:
    """A study of files with some content, in the order in which they are named."""
    folder.mkdir()
    records = []
    for name, content in contents.items():
        (folder / name).write_text(content)
        records.append(SimpleNamespace(label=name, file=name, files=(name,)))
    return cast(Any, SimpleNamespace(records=records, path_of=lambda file: folder / file))


def asked(
    study: Study,
    others: Study,
    monkeypatch: pytest.MonkeyPatch,
    blocks: tuple[float, ...] = (1.0, 2.0),
    status: str = "ok",
) -> Rival:
    """A posterior of the records of another study, as a rival of one of this study."""
    paths = [others.path_of(record.file) for record in others.records]  # type: ignore[arg-type]
    origin = Provenance(
        created="", versions={}, inputs={p.as_posix(): sha256_of(p) for p in paths}, resolved_study=""
    )  # fmt: skip
    known: dict = {record.label: {} for record in others.records}
    summary = PosteriorSummary.model_construct(provenance=origin, status=status, records=known)  # type: ignore[arg-type]
    labels = np.array([record.label for record in others.records], dtype=object)
    groups = {
        "cross_validation": {
            "elpd": Variable(np.array(blocks), ("block",)),
            "pareto_k": Variable(np.zeros(len(blocks)), ("block",)),
        },
        "log_likelihood": {"block_record": Variable(labels, ("block",))},
        "observed_data": {"force": Variable(np.zeros((len(labels), 4)), ("record", "time"))},
    }
    monkeypatch.setattr(compare, "read_summary", lambda folder: summary)
    monkeypatch.setattr(compare, "read_result", lambda path: (groups, ""))
    return rival_of(Path("rival"), study)


def test_records_are_known_by_their_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = a_study(tmp_path / "here", a="first", b="second")
    renamed = a_study(tmp_path / "renamed", b="first", c="second")
    np.testing.assert_array_equal(asked(study, renamed, monkeypatch).blocks, [1.0, 2.0])


def test_a_posterior_of_further_records_is_refused_before_anything_is_sampled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = a_study(tmp_path / "here", a="first", b="second")
    more = a_study(tmp_path / "more", a="first", b="second", c="third")
    with pytest.raises(UsageError, match="a posterior of 3 records; expected one of 2, as here"):
        asked(study, more, monkeypatch)


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


def test_a_posterior_that_failed_is_no_rival(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is suspect is: most wrong models are, and they are what others are held against."""
    study = a_study(tmp_path / "here", a="first")
    with pytest.raises(UsageError, match="a posterior that failed its checks; expected one that can be relied on"):
        asked(study, study, monkeypatch, status="failed")
    assert len(asked(study, study, monkeypatch, status="suspect").blocks) == 2


def against(own: np.ndarray, own_k: np.ndarray, their_k: np.ndarray, likelihood: str = "coloured") -> ComparedModel:
    """A model against one of which every block is as probable as the next."""
    told = PosteriorSummary.model_construct(
        study="made", effects=(), likelihood=likelihood, log_evidence=Measure(value=1.0, error=0.1)
    )  # fmt: skip
    rival = Rival(Path("rival"), told, np.zeros(len(own)), their_k, {})
    return compared(CrossValidation(own, own_k, 2.0), Evidence(5.0, 0.1), rival, "coloured")


def test_blocks_that_either_model_cannot_tell_decide_nothing() -> None:
    """Ten blocks say little; an eleventh, whose figure is not to be relied on, would decide alone or turn them."""
    even = np.tile([1.0, -0.9], 5)
    none, last = np.zeros(11), np.where(np.arange(11) == 10, 0.9, 0.0)
    for own_k, their_k in ((none, last), (last, none)):
        clear = against(np.append(np.full(10, 2.0) + 0.1 * even, 2.0), own_k, their_k)
        assert (clear.blocks, clear.unsure) == (11, 1)
        assert clear.elpd_sure is not None
        assert clear.elpd_sure.value == pytest.approx(clear.elpd.value - 2.0)
        assert better_model(clear) == "this one"
        assert better_model(against(np.append(np.full(10, 2.0) + 0.1 * even, -40.0), own_k, their_k)) == "unreliable"
    # The negative control: blocks that are sure count whatever they say.
    assert better_model(against(np.append(np.full(10, 2.0) + 0.1 * even, -40.0), none, none)) == "alike"
    assert better_model(against(np.append([1.0], [5.0]), none[:2], np.array([0.0, 0.9]))) == "unreliable"
    text = " ".join(posterior_report(PLAIN.model_copy(update={"compared": (clear,)})).split())
    assert "Against base model, rival: Pareto k > 0.7 under one of both in 1 of 11 blocks; the others: +20" in text


@pytest.mark.parametrize("number", [2, 3, 40])
def test_models_that_predict_alike_are_told_apart_once_in_twenty_times(number: int) -> None:
    """The negative control is the normal law, which two blocks make much too sure."""
    random, rounds, nothing = np.random.default_rng(5), 2000, np.zeros(number)
    found = [against(random.standard_normal(number), nothing, nothing) for _ in range(rounds)]
    apart = np.mean([better_model(one) != "alike" for one in found])
    assert apart == pytest.approx(SIGNIFICANT, abs=0.02)
    normal = np.mean([abs(one.elpd.value) > 2.0 * one.elpd.error for one in found])
    assert normal > 0.2 if number == 2 else normal >= apart - 0.01


@pytest.mark.parametrize(
    ("likelihood", "same"), [("coloured", True), ("coloured, Student's t", True), ("autoregressive", False)]
)
def test_marginal_likelihoods_in_noise_of_two_kinds_are_not_compared(likelihood: str, same: bool) -> None:
    found = against(np.arange(4.0), np.zeros(4), np.zeros(4), likelihood)
    assert found.same_noise is same
    assert (found.log_evidence is not None) is same
    text = " ".join(posterior_report(PLAIN.model_copy(update={"compared": (found,)})).split())
    assert ("noise is of another kind there" in text) is not same


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
