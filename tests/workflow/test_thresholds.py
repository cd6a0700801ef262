"""Thresholds of predictions, sweeps and series decide: with twice or half of one a verdict here would be another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock, patch

import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.fitting.uncertainty import Freedom
from fibrefit.study.summaries.discovery import HeldOut
from fibrefit.workflow import fit_files, sweep_summary, thresholds
from fibrefit.workflow.discovery import advice
from fibrefit.workflow.prediction import judge
from fibrefit.workflow.together import files as series
from fibrefit.workflow.together import series as together
from fibrefit.workflow.together import words
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

COUNTED = np.ones((1, 10), dtype=bool)


def within(cause: str, ratio: float) -> bool:
    """Whether residuals that come of one cause alone pass, so many times as large as expected."""
    return ratio <= judge.limit({cause: np.ones((1, 10))}, COUNTED, Freedom(3.0))


def fine(step: float) -> bool:
    """Whether a jump between frequencies so far apart is located well enough."""
    frequencies = np.array([4.0, 4.0 + step, 4.0 + 2.0 * step])
    branch = SimpleNamespace(
        time=np.zeros(3),
        trouble=np.zeros(3, dtype=bool),
        periods=np.ones(3, dtype=int),
        overturned=np.zeros(3, dtype=bool),
        amplitude=np.array([0.1, 0.1, 2.0]),
    )
    curve = SimpleNamespace(branches={"up": branch}, frequencies=frequencies)
    return sweep_summary.sweep_checks(cast(Any, [curve]))[2].passed


def verdict(nats: float, gap: float = 1.0) -> Any:
    """A series whose laws predict worse than constants, and are so much more probable."""
    elpd = lambda size: SimpleNamespace(elpd=np.array([size]))  # noqa: E731
    unknowns = SimpleNamespace(lower=np.array([0.0]), upper=np.array([9.0]), names=("a",))
    mode = SimpleNamespace(unknowns=unknowns, place=SimpleNamespace(z=np.array([1.0])))
    return SimpleNamespace(
        answer="constant",
        gaps={"constant": gap},
        logs={"speed_law": nats},
        left_out={"constant": elpd(1.0), "speed_law": elpd(0.0)},
        best=SimpleNamespace(evidence=SimpleNamespace(mode=mode)),
    )


def missed(gap: float) -> bool:
    """Whether a record left out counts as predicted."""
    held = HeldOut(record="a.csv", gap_before=3.0, gap_after=gap)
    after = SimpleNamespace(advice=())
    found = SimpleNamespace(verdict="named", after=after, cannot_tell_apart=(), separated_by=(), held_out=(held,))
    return not any("a.csv" in said for said in advice.next_steps(cast(Any, found), False))


def a_series(records: float) -> bool:
    """Whether so many records are a series."""
    study = SimpleNamespace(records=range(int(records)), source="study.toml")
    with (
        patch.object(together, "as_study", lambda _: study),
        patch.object(together, "read_records", Mock(side_effect=OSError)),
    ):
        try:
            together.series_study("study.toml")
        except StudyError:
            return False
        except OSError:
            return True
    raise AssertionError("neither refused nor read")


def correlated(size: float) -> bool:
    """Whether two parameters so correlated are told."""
    entries = tuple((SimpleNamespace(name=name), None) for name in ("mass", "stiffness"))
    problem = SimpleNamespace(layout=SimpleNamespace(entries=entries))
    found = SimpleNamespace(covariance=np.array([[1.0, size], [size, 1.0]]), problem=problem)
    return bool(fit_files.strong_correlations(cast(Any, found)))


def differ(chance: float) -> bool:
    """Whether records are told to differ whose values scatter as much with such a chance."""
    one = SimpleNamespace(sd=0.1, logarithmic=True, chance=chance)
    return bool(words._scatter(cast(Any, SimpleNamespace(populations={"damping": one}))))


CASES = (
    Bracket("SHORTEST_SERIES", together, a_series, 4, 2),
    Bracket("LACKING", judge, lambda x: within("model", x), 1.3, 1.7),
    Bracket("RARE", judge, lambda x: within("values", x), 1.90, 2.0),
    Bracket("LOCATED", sweep_summary, fine, 0.08, 0.13),
    Bracket("DECIDED", series, lambda x: series.series_checks(verdict(x))[1].passed, 4.0, 6.0),
    Bracket("PREDICTED", advice, missed, 1.1, 1.2),
    Bracket("CORRELATED", fit_files, lambda x: not correlated(x), 0.6, 0.8),
    Bracket("RECORDS_DIFFER", words, differ, 0.007, 0.013),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_residuals_of_a_series_may_be_as_large_as_those_of_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    Bracket("GAP_OF_NOISE", series, lambda gap: series.series_checks(verdict(0.0, gap))[0].passed, 1.05, 1.15).test(
        monkeypatch
    )


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
