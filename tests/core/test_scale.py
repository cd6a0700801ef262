"""What one unit of a column is worth, and how well it is known: every way in which people write it."""

from __future__ import annotations

import pytest

from fibrefit.core.errors import StudyError
from fibrefit.core.units import Scale, in_percent, uncertain


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("3.1 +/- 0.05 kg", ("3.1 kg", "0.05 kg")),
        ("3.1±0.05kg", ("3.1 kg", "0.05 kg")),
        ("1 +/- 0.05", ("1", "0.05")),
        ("3.1 kg +/- 0.05 kg", ("3.1 kg", "0.05 kg")),
        ("3.1 kg +/- 50 g", ("3.1 kg", "50 g")),
        ("9.81 m/s^2 +/- 0.01", ("9.81 m/s^2", "0.01 m/s^2")),
        ("-200 N/V +/- 2 %", ("-200 N/V", "4 N/V")),
        ("45° +/- 1°", ("45 °", "1 °")),
        ("20 1/m +/- 2 1/m", ("20 1/m", "2 1/m")),
        ("3.1 kg", None),
        ("-200 N/V", None),
        ("2.07 +/- 2 % N/A", None),
        (3.1, None),
    ],
)
def test_value_and_uncertainty(text: object, parts: tuple[str, str] | None) -> None:
    assert uncertain(text) == parts


@pytest.mark.parametrize(
    ("text", "value", "error", "unit"),
    [
        ("2.07 +/- 0.29 N/A", 2.07, 0.29, "N/A"),
        ("2.07 N/A +/- 0.29 N/A", 2.07, 0.29, "N/A"),
        ("-200 N/V +/- 2 %", -200.0, 4.0, "N/V"),
        ("17.857 um", 17.857, 0.0, "um"),
        (2, 2.0, 0.0, "-"),
    ],
)
def test_a_scale(text: str | float, value: float, error: float, unit: str) -> None:
    scale = Scale.parse(text, "here")
    assert (scale.value, scale.error, scale.unit) == (value, error, unit)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("2.07 +/- 2 % N/A", "an uncertainty in %, of which the value may be a percentage too"),
        ("1 +/- 5 %", 'the share behind the unit, as in "2.07 N/A'),
        ("3.1 kg +/- 50 g", "expected a number with a unit"),
        ("2,07 N/A", "Write a decimal point"),
        (True, "expected a number with a unit"),
        ("0 N/A", "neither zero nor infinite"),
    ],
)
def test_what_is_no_scale(text: object, says: str) -> None:
    with pytest.raises(StudyError) as refused:
        Scale.parse(text, "here")  # type: ignore[arg-type]
    assert says in str(refused.value)


def test_an_uncertainty_in_percent_behind_the_number_is_not_the_percentage_that_it_may_be() -> None:
    """Read so, 2.07 would be a hundredth of it."""
    assert in_percent("2.07 +/- 2 % N/A")
    assert not in_percent("2.07 N/A +/- 2 %")
    assert not in_percent("80 %")
