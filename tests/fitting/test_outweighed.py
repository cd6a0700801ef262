"""Whether what is left is more than what a value does: told in words, whatever the noise and the number of samples."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import checks as judge
from fibrefit.fitting import values as judged
from fibrefit.fitting.uncertainty import Scores
from fibrefit.problem.statement.layout import Range, Slot
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.study.summaries.check import status_by
from fibrefit.study.summaries.results import ChannelGap

TRUTH = 2.0
POSITIVE = Range(0.0, np.inf, 1.0)


def said(share: float, limits: Range = POSITIVE, noise: float = 1e-3, samples: int = 2400, value: float = TRUTH) -> Any:
    """What outweighs of a model ``c v`` that leaves `share` of what it does, in a shape that it cannot imitate."""
    turn = np.linspace(0.0, 24.0 * np.pi, samples)
    speed, other = np.sin(turn) / noise, np.cos(turn) / noise
    left = share * TRUTH * other + np.random.default_rng(0).standard_normal(samples)
    scores = Scores(left[None, None], speed[None, None, :, None], np.array([samples]), np.array([[0]]), 1)
    layout: Any = SimpleNamespace(entries=((Slot("damping", "N s/m", limits, True), None),))
    return judged.outweighed(layout, np.array([value]), scores)


def test_a_value_that_does_less_than_what_is_left_is_named() -> None:
    found = said(1.5)
    assert (found.name, found.value, found.ratio) == ("damping", TRUTH, pytest.approx(1.5, rel=0.05))


@pytest.mark.parametrize(("noise", "samples"), [(1e-3, 2400), (1e-2, 2400), (1e-3, 24_000), (1e-1, 240)])
def test_neither_noise_nor_samples_matter(noise: float, samples: int) -> None:
    assert said(1.3, noise=noise, samples=samples)
    assert not said(0.8, noise=noise, samples=samples)


@pytest.mark.parametrize("noise", [0.1, 1.0, 5.0])
def test_noise_outweighs_nothing(noise: float) -> None:
    """The value is not determined at all then, and error bars say so."""
    assert said(0.0, noise=noise) is None


def test_what_may_have_either_sign_has_no_factor() -> None:
    assert said(3.0, limits=Range(-np.inf, np.inf, 1.0)) is None


def test_a_value_that_was_driven_to_nothing_is_held_against_its_typical_size() -> None:
    assert said(0.2, value=0.0)
    assert not said(0.02, value=0.0)


def test_it_fails_a_fit_that_does_not_explain_the_signal() -> None:
    explained, left = (
        judge.check(
            "explained_share", judge.signal_explained({"force": ChannelGap.against_noise(1e-6, 1.0, "N", share)})
        )
        for share in (0.999, 0.98)
    )
    of = {"force": ChannelGap.against_noise(1e-6, 1.0, "N", 0.98)}
    told = judge.check("explained_share", judge.signal_explained(of, lambda: said(1.5)))
    assert status_by([told]) == "failed"
    assert fit_sentence(told).startswith(fit_sentence(left))
    words = "What is left is 1.5 times what the damping of 2 N s/m does in the readings, at most 1 passes"
    assert f"{words}: this value may be off by a factor" in fit_sentence(told)
    assert status_by([left]) == "suspect"
    # Of a signal that is explained nobody asks.
    judge.signal_explained(
        {"force": ChannelGap.against_noise(1e-6, 1.0, "N", 0.999)}, lambda: pytest.fail("it was asked")
    )
    assert explained.passed
