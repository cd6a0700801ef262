"""The series that ships with the program: records of another simulator, whose truth is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.fitting.result import total
from fibrefit.study import load_study
from fibrefit.workflow.fit import Fit, fit_study

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
TRUE = {"stiffness": 11150.6306, "damping": 9.437327, "friction": 2.685715}
#: Accuracy asked for, as a share of the truth.
ALLOWED = {"stiffness": 0.002, "damping": 0.02, "friction": 0.02}


@pytest.fixture(scope="module")
def demonstration() -> Fit:
    return fit_study(load_study(SERIES))


def test_the_truth_is_found(demonstration: Fit) -> None:
    for name, estimate in demonstration.parameters.items():
        assert estimate.value == pytest.approx(TRUE[name], rel=ALLOWED[name])
        assert abs(estimate.value - TRUE[name]) < 4.0 * estimate.std_error


def test_nothing_is_left_but_noise_and_every_check_passes(demonstration: Fit) -> None:
    assert demonstration.status == "ok", demonstration.report()
    assert total(demonstration.identification.gap) <= 1.05
    starts = demonstration.identification.starts
    assert (starts.tried, starts.agreeing >= 30) == (32, True)


def test_error_bars_of_correlated_noise_are_wider_and_said_to_be(demonstration: Fit) -> None:
    assert 1.5 < demonstration.identification.error_inflation < 10.0
    assert "times as wide" in " ".join(demonstration.report().split())


@pytest.mark.slow
def test_a_record_that_was_held_out_is_predicted(demonstration: Fit) -> None:
    fixed = [
        text
        for name, estimate in demonstration.parameters.items()
        for text in (f'parameters.{name}.initial="{estimate.value} {estimate.unit}"', f"parameters.{name}.fixed=true")
    ]
    predicted = fit_study(load_study(SERIES / "holdout", fixed), starts=1)
    assert total(predicted.identification.gap) <= 1.1
    assert not np.any(predicted.identification.motion.trouble)
