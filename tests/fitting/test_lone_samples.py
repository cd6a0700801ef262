"""Readings that stand alone and carry most of what is left are named; what a model lacks, and noise, are none."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.fitting.advice import with_lone_samples
from fibrefit.fitting.residuals import LoneSamples, lone_samples
from fibrefit.fitting.result import Advice
from fibrefit.report.sentences.fit import advice_sentence

LENGTH, RATE = 2000, 2000.0


def noise(seed: int = 0) -> np.ndarray:
    """Residuals of two records with two channels."""
    return np.random.default_rng(seed).standard_normal((2, 2, LENGTH))


def found_in(residuals: np.ndarray, masked: Any = None) -> LoneSamples | None:
    counted = np.ones(residuals.shape, dtype=bool)
    if masked is not None:
        counted[masked] = False
    problem = SimpleNamespace(layout=SimpleNamespace(records=("a", "b")))
    times = np.broadcast_to(np.arange(LENGTH) / RATE, (2, LENGTH))
    made = {"residuals": residuals, "counted": counted, "problem": problem, "channels": ("force", "position")}
    return lone_samples(cast(Any, SimpleNamespace(**made, times=times)))


@pytest.mark.parametrize("places", [[400], [400, 401], [0], [LENGTH - 1], [100, 700, 1500]])
def test_samples_that_stand_alone_are_found(places: list[int]) -> None:
    residuals = noise()
    residuals[1, 0, places] = 300.0
    found = found_in(residuals)
    assert found is not None
    assert sorted((one.record, one.channel, one.time) for one in found.samples) == [
        ("b", "force", place / RATE) for place in places
    ]
    assert found.share > 0.95


@pytest.mark.parametrize("seed", range(20))
def test_noise_with_what_a_model_lacks_has_none(seed: int) -> None:
    """The negative control: noise by itself, heavier noise, and a contact that comes some samples late."""
    random = np.random.default_rng(seed)
    assert found_in(noise(seed)) is None
    assert found_in(random.standard_t(3, size=(2, 2, LENGTH))) is None
    late, width = noise(seed), random.uniform(2.0, 30.0)
    late[0, 0] += random.uniform(20.0, 400.0) * np.exp(-(((np.arange(LENGTH) - 700.3) / width) ** 2))
    assert found_in(late) is None


def test_one_that_is_masked_is_none_and_one_beside_masked_ones_is() -> None:
    residuals = noise()
    residuals[0, 1, 500] = 300.0
    assert found_in(residuals, (0, 1, 500)) is None
    assert found_in(residuals, (0, 1, slice(501, 700))) is not None


def test_they_come_first_and_nothing_is_sought_for_their_sake() -> None:
    residuals = noise()
    residuals[1, 0, [400, 600, 800, 1000]] = 300.0
    found = found_in(residuals)
    first, rest = with_lone_samples((Advice("search"), Advice("rest")), found, robust=False)
    assert rest.identifier == "rest"
    said = advice_sentence(first)
    assert said.startswith("4 samples, far from their neighbours, carry 100 % of what is left beyond the noise: force")
    assert "force of b at 200 ms (300 times the noise)" in said
    assert said.endswith(
        " and 1 more. No law explains them: look at them, and fit again with --robust: such count less then."
    )
    again, _ = with_lone_samples((Advice("rest"),), found, robust=True)
    assert advice_sentence(again).endswith("No law explains them: mask them in the file.")
    assert with_lone_samples((Advice("search"),), None, robust=False) == (Advice("search"),)
