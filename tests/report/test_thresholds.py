"""Thresholds of the words decide: with twice or half of one a finding would be told otherwise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from fibrefit.report import batch, confusion, text
from fibrefit.report import posterior as posterior_report
from fibrefit.report.sentences import alike, discovery, posterior, thresholds
from fibrefit.study.summaries.discovery import Separation, Weight
from fibrefit.study.summaries.part import Measure
from fibrefit.study.summaries.results import BetweenRecordsSummary, ComparedModel, ParameterSummary
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in


def of_weight(errors: float, share: float) -> str:
    """What is said of an effect of such a size."""
    one = Weight(effect="a", share_of_signal=share, signal="force", share_of_gap=0.5, standard_errors=errors)
    return discovery.worded_weight(one).says


def helps(nats: float) -> bool:
    """Whether a record helps that is expected to add so many nats to those at hand."""
    conditions = {"record": "a.csv", "conditions": {}, "pace": 1.0, "size": 1.0}
    found = Separation(pair=("a", "b"), **conditions, nats_before=3.0, nats_after=3.0 + nats)
    return discovery.NO_HELP not in discovery.worded_separation(found).says


def listed(cosine: float) -> bool:
    """Whether two effects are listed as confounded."""
    pair = SimpleNamespace(
        effects=[SimpleNamespace(effect=name) for name in "ab"], cosine=[[1.0, cosine], [cosine, 1.0]]
    )
    return bool(confusion._pairs(cast(Any, pair)))


def one_value(ratio: float) -> bool:
    """Whether items agree that scatter by so many of their errors, by the median of their distances."""
    scatter = ratio / batch.SPREAD
    values = [ParameterSummary(value=v, std_error=1.0, interval_95=(v, v), unit="N") for v in (-scatter, 0.0, scatter)]
    found = {str(n): SimpleNamespace(status="ok", parameters={"force": one}) for n, one in enumerate(values)}
    return not batch.scatter_sentences(cast(Any, SimpleNamespace(items=found)))


def normal(kurtosis: float) -> bool:
    """Whether single samples stray no further than those of a normal law."""
    return not posterior._tails(cast(Any, SimpleNamespace(likelihood=SimpleNamespace(heavy=False), kurtosis=kurtosis)))


def of_prior(share: float) -> str:
    """What is said of a prior of whose width such a share is left."""
    known = {"prior_centre": 1.9, "prior_error": 0.05}
    one = ParameterSummary(value=1.9, std_error=0.05 * share, interval_95=(1.8, 2.0), unit="kg", **known)
    return text.prior_sentences({"mass": one})[0]


def told_to_agree(most: float) -> bool:
    """Whether records are told to agree of whose differences so much is not excluded."""
    one = BetweenRecordsSummary(sd=0.0, interval_95=(0.0, most), agree=0.9)
    return "no difference beyond the errors" in alike.between_sentence({"stiffness": one})


def models_alike(difference: float) -> bool:
    """Whether two models count as alike, so many standard errors apart."""
    rival = ComparedModel(
        result="results/other", study="drops", effects=(), elpd=Measure(value=difference, error=1.0)
    )  # fmt: skip
    return "alike" in "".join(posterior_report._rivals([rival]))


CASES = (
    Bracket("SMALL_DIFFERENCE", alike, told_to_agree, 0.005, 0.01),
    Bracket("SURE", discovery, lambda x: "only" not in of_weight(x, 0.1), 6.0, 4.0),
    Bracket("SMALL_SHARE", discovery, lambda x: "small" in of_weight(9.0, x), 0.04, 0.07),
    Bracket("LITTLE_HELP", discovery, helps, 6.0, 4.0),
    Bracket("CONFOUNDED", confusion, listed, 0.95, 0.85),
    Bracket("SCATTERS_MORE", batch, one_value, 1.5, 2.5),
    Bracket("HEAVY_TAILS", posterior, normal, 0.8, 1.3),
)

OF_OTHER_FLOORS = (
    Bracket("SIGNIFICANT", posterior_report, models_alike, 1.8, 2.1),
    Bracket("SAME_WIDTH", text, lambda x: "is held by" not in of_prior(x), 0.7, 0.9),
    Bracket("PRIOR_MATTERS", text, lambda x: "hardly" in of_prior(x), 0.25, 0.35),
)


@pytest.mark.parametrize("case", [*CASES, *OF_OTHER_FLOORS], ids=lambda case: case.name)
def test_the_words_turn_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
