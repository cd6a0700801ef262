"""Packed records come back to the step they were rounded to, and are small."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from fibrefit.core.declarations import HELD, LOADING, REST, SLACK, STICKING, UNLOADING
from fibrefit.report.page.moments import moments
from fibrefit.report.page.packing import LARGEST, packed


def unpacked(data: dict[str, Any]) -> dict[str, np.ndarray]:
    """The way back, as `unpack.js` goes it."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(data["deflated"])), dtype=np.uint8)
    found, at, n = {}, 0, data["length"]
    for told in data["series"]:
        whole = np.zeros(n, dtype=np.int64)
        for plane in range(told["planes"]):
            whole += planes[at : at + n].astype(np.int64) << (8 * plane)
            at += n
        values = np.where(whole % 2, -(whole + 1) // 2, whole // 2)
        for _ in range(told["order"]):
            values = np.cumsum(values)
        shown = values * told["step"]
        for first, number in told["missing"]:
            shown[first : first + number] = np.nan
        found[told["name"]] = shown
    assert at == len(planes)
    return found


numbers = st.floats(-1e9, 1e9) | st.just(np.nan)


@given(arrays.arrays(float, st.integers(1, 60), elements=numbers), st.sampled_from([1e-6, 0.01, 1.0, 250.0]))
def test_values_come_back_to_half_a_step(values: np.ndarray, step: float) -> None:
    data = packed({"a": (values, step), "b": (values[::-1], step)})
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    rounded = max(step, largest / LARGEST)
    for name, sent in (("a", values), ("b", values[::-1])):
        back = unpacked(data)[name]
        np.testing.assert_array_equal(np.isnan(back), np.isnan(sent))
        assert np.nanmax(np.abs(back - sent), initial=0.0) <= 0.5001 * rounded + 1e-9 * largest


def test_a_record_takes_two_bytes_a_sample_at_most() -> None:
    times = np.arange(20000) / 2000.0
    noise = np.random.default_rng(0).normal(size=20000)
    signal = 100.0 * np.exp(-times) * np.cos(40.0 * times)
    smooth = packed({"time": (times, 1e-7), "simulated": (signal, 0.01)})
    assert len(smooth["deflated"]) < 20000
    measured = packed({"measured": (signal + noise, 0.01)})
    assert len(measured["deflated"]) < 2 * 20000


def test_moments_of_a_drop() -> None:
    phase = np.repeat([HELD, SLACK, LOADING, UNLOADING, SLACK, LOADING, SLACK, LOADING, REST], [20] * 6 + [2, 20, 30])
    times = np.arange(len(phase)) / 1000.0
    found = [(one.kind, one.at) for one in moments(times, phase)]
    # A slackness of two samples is none.
    assert found == [
        ("let go", pytest.approx(0.02)),
        ("take-up 1", pytest.approx(0.04)),
        ("release 1", pytest.approx(0.08)),
        ("take-up 2", pytest.approx(0.1)),
        ("take-up 3", pytest.approx(0.122)),
    ]


def test_moments_of_a_guide_without_a_fibre() -> None:
    phase = np.repeat([REST, 5, STICKING, 6, REST], 10)
    found = [one.kind for one in moments(np.arange(50) / 100.0, phase)]
    assert found == ["sets off 1", "stops 1", "sets off 2", "stops 2"]
