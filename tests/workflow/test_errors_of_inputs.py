"""Errors that a prediction finds in measured inputs: beside the noise of the input in all of the records."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from fibrefit.problem.noise.spectrum import Noise
from fibrefit.workflow.prediction.files import _input_errors


def test_the_noise_of_an_input_is_that_of_all_records() -> None:
    traces = [SimpleNamespace(duration=1.0, rate=rate) for rate in (200.0, 600.0)]
    task = SimpleNamespace(traces=traces, input_noise={"drive": Noise(1e-2, 0.0, 0.0, 100)})
    found: Any = SimpleNamespace(task=task, held=SimpleNamespace(input_rms={"drive": 0.5}), records=())
    told = _input_errors(found)["drive"]
    # White noise of 0.01 m²/Hz up to half the rate: 1 and 3 m², whose mean is 2.
    assert told.noise == pytest.approx(2.0**0.5)
    assert (told.rms, told.unit) == (0.5, "m")
