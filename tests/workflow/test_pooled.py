"""Populations of a batch: what records share is not taken for what each of them says by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.fitting.error_bars import _due_to_priors
from fibrefit.problem.statement.layout import Belief
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.study.summaries.series import BatchItem
from fibrefit.workflow.together.pooled import pooled_batch, quantities_of

RECORDS, SCALE = 25, 0.1
"""Records, and the relative error of a scale that the study states."""


def item(value: float, own: float, common: float | None) -> BatchItem:
    error = float(np.hypot(own, common or 0.0))
    stiffness = ParameterSummary(value=value, std_error=error, unit="N/m", common_error=common)
    scale = ParameterSummary(
        value=2.0, std_error=0.2, unit="N/A", prior_centre=2.0, prior_error=0.2, common_error=0.2
    )  # fmt: skip
    return BatchItem(status="ok", parameters={"stiffness": stiffness, "force.scale": scale}, result="a")


def test_a_prior_of_the_study_is_no_error_of_each_record() -> None:
    random = np.random.default_rng(3)
    values = 2e4 * np.exp(0.02 * random.standard_normal(RECORDS))
    items = {f"{n}": item(float(v), 0.002 * v, SCALE * v) for n, v in enumerate(values)}
    found = pooled_batch(items).summaries
    # Of the scale records say nothing: it has no population.
    assert set(found) == {"stiffness"}
    low, high = found["stiffness"].mean_interval_95
    assert (high - low) / (2.0 * found["stiffness"].mean) == pytest.approx(1.96 * SCALE, rel=0.1)
    assert found["stiffness"].between_records == pytest.approx(0.02, rel=0.4)
    (stiffness, _), _ = quantities_of(items)
    np.testing.assert_allclose(stiffness.errors, 0.002 * values, rtol=1e-6)


def test_without_priors_nothing_is_shared() -> None:
    items = {f"{n}": item(v, 0.002 * v, None) for n, v in enumerate((2e4, 2.01e4, 1.99e4))}
    (stiffness, _), _ = quantities_of(items)
    assert stiffness.common == 0.0
    np.testing.assert_allclose(stiffness.errors, [40.0, 40.2, 39.8])


def test_what_centres_of_priors_do_and_what_noise_does_is_the_whole_error() -> None:
    random = np.random.default_rng(5)
    slopes, belief = random.standard_normal((30, 3)), Belief(2.0, 0.3)
    records, prior = slopes.T @ slopes, np.diag([0.0, 0.3**-2.0, 0.0])
    whole = np.linalg.inv(records + prior)
    problem: Any = SimpleNamespace(layout=SimpleNamespace(beliefs=((1, belief),)))
    common = _due_to_priors(problem, np.ones(3), whole)
    assert common is not None
    noise = np.diag(whole @ records @ whole)
    np.testing.assert_allclose(common**2 + noise, np.diag(whole))
    nothing: Any = SimpleNamespace(layout=SimpleNamespace(beliefs=()))
    assert _due_to_priors(cast(Any, nothing), np.ones(3), whole) is None
