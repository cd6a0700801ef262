"""Files of many exporters give the same samples; no value may move by more than the last bit of a unit conversion."""

from __future__ import annotations

import numpy as np
import pytest
from layouts import LAYOUTS, RATE, Layout, N, f, u

from fibrefit.records import ReadOptions, read_record, read_table

#: One rounding of the conversion to SI.
LAST_BITS = 1e-15
#: Times of day hold ten digits before the one that counts.
CLOCK_BITS = 1e-6


def test_names_are_distinct() -> None:
    assert len({layout.name for layout in LAYOUTS}) == len(LAYOUTS) >= 90


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_layout(layout: Layout, write) -> None:
    options = dict(layout.options)
    slower, epoch = options.pop("scale", 1.0), options.pop("epoch", False)
    path = write(layout.content, f"file{layout.suffix}")

    record = read_record(path, **options)

    assert set(record.channels) == set(layout.holds)
    np.testing.assert_allclose(record.time, np.arange(N) / RATE * slower, rtol=0, atol=CLOCK_BITS if epoch else 1e-9)
    assert record.rate == pytest.approx(RATE / slower, rel=1e-9)
    assert record.uniform
    assert not record.gaps
    np.testing.assert_allclose(record.channels["force"], [float(f(i)) for i in range(N)], rtol=LAST_BITS)
    np.testing.assert_allclose(record.channels["position"], [float(u(i)) / 1e3 for i in range(N)], rtol=LAST_BITS)
    for role in layout.holds:
        assert record.valid[role].all()
    assert read_table(path, ReadOptions(**options)).understood["layout"]["format"] in ("text", "LVM")
