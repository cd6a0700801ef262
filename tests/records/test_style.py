"""Digits that are missing or there twice are masked; numbers that are merely short are not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fibrefit.records import Column, read_table

RNG = np.random.default_rng(7)
FORCE = 20 + 8 * np.sin(np.arange(400) / 15) + 0.05 * RNG.standard_normal(400)


@pytest.fixture
def read(write: Callable) -> Callable[[list[str]], Column]:
    def _read(texts: list[str]) -> Column:
        rows = "".join(f"{i / 2000:.4f};{text}\n" for i, text in enumerate(texts))
        return read_table(write("t [s];F [N]\n" + rows)).column("F [N]")

    return _read


def test_fixed_decimals_mask_nothing(read: Callable) -> None:
    assert read([f"{f:.3f}" for f in FORCE]).valid.all()


@pytest.mark.parametrize("pattern", ["{:g}", "{:.9g}", "{!r}", "{:.4g}"])
@pytest.mark.parametrize("scale", [1.0, 5.0, 1e-3, 1e4])
def test_significant_digits_mask_nothing(pattern: str, scale: float, read: Callable) -> None:
    """Crossing a decade changes the decimals, and zeros at the end are dropped."""
    assert read([pattern.format(float(f)) for f in FORCE * scale]).valid.all()


@pytest.mark.parametrize("decimals", [1, 2, 3])
@pytest.mark.parametrize("less", [0.0, 15.0])
def test_rounded_numbers_as_python_prints_them_mask_nothing(decimals: int, less: float, read: Callable) -> None:
    """0.5 where others have two decimals, and yet 2.0: the last zero of a whole number is printed, others are not."""
    texts = [repr(float(np.round(f - less, decimals))) for f in FORCE]
    assert any(text.endswith(".0") for text in texts) or decimals == 3
    assert read(texts).valid.all()


def test_dropped_zeros_and_a_held_weight_mask_nothing(read: Callable) -> None:
    texts = ["30.3712345"] * 300 + [f"{f:.9g}" for f in FORCE[300:]]
    assert "digit lost or doubled" not in read(texts).masked


def test_means_of_a_few_whole_readings_mask_nothing(read: Callable) -> None:
    """1036266.6666666666 is a third, and no digit of it is there twice; most means of two end after one decimal."""
    sums = (1e6 + 1000 * FORCE).astype(int)
    assert read([repr(total / (3 if i % 15 == 0 else 2)) for i, total in enumerate(sums.tolist())]).valid.all()


def test_an_instrument_that_changes_its_range_masks_nothing(read: Callable) -> None:
    assert read([f"{f:.3f}" if f < 100 else f"{f:.2f}" for f in FORCE * 5]).valid.all()


@pytest.mark.parametrize(
    ("damage", "place"),
    [
        (lambda text: text[:-1], 11),
        (lambda text: text + text[-1], 12),
        (lambda text: text.replace(".", ""), 13),
        (lambda text: text[1:], 14),
        (lambda text: text[0] + text, 15),
        (lambda text: text + "0", 0),
        (lambda text: text[:-1], 399),
        (lambda text: "." + text.split(".")[1], 20),
    ],
    ids=[
        "lost",
        "doubled",
        "mark lost",
        "first lost",
        "first doubled",
        "at the start",
        "at the end",
        "whole part lost",
    ],
)
def test_a_digit_lost_or_doubled_is_masked(damage: Callable, place: int, read: Callable) -> None:
    texts = [f"{f:.3f}" for f in FORCE]
    texts[place] = damage(texts[place])
    column = read(texts)
    assert dict(column.masked) == {"digit lost or doubled": 1}
    assert not column.valid[place]


def test_steps_of_five_that_never_end_in_zero(read: Callable) -> None:
    """A zero offset can keep every last digit from being zero: then few short numbers are still too few to be round."""
    texts = [f"{round(f / 0.005) * 0.005 + 0.002:.3f}" for f in FORCE]
    assert not any(text.endswith("0") for text in texts)
    assert read(texts).valid.all()
    texts[30] = texts[30][:-1]
    assert dict(read(texts).masked) == {"digit lost or doubled": 1}


@pytest.mark.parametrize("step", [0.05, 1.0, 0.2])
def test_going_over_to_the_next_step_is_no_lost_digit(step: float, read: Callable) -> None:
    """A logger with coarse steps that prints more digits than it reads; the weight rests where noise seldom reaches."""
    rests = np.concatenate([np.full(150, -10.0), 10.0 * np.sin(np.arange(100) / 15), np.full(400, 1.12)])
    readings = np.round(rests + 0.25 * step * np.random.default_rng(3).standard_normal(rests.size) / step) * step
    assert read([f"{reading:.3f}" for reading in readings]).valid.all()


def test_the_other_decimal_mark_is_masked(read: Callable) -> None:
    texts = [f"{f:.3f}" for f in FORCE]
    texts[9] = texts[9].replace(".", ",")
    assert dict(read(texts).masked) == {"other decimal mark": 1}


@pytest.mark.parametrize(("end", "reasons"), [("", {"cut short": 1}), ("\n", {})])
def test_a_file_that_ends_within_a_number(end: str, reasons: dict, write: Callable) -> None:
    text = "t [s];F [N]\n" + "".join(f"{i / 2000:.4f};{f!r}\n" for i, f in enumerate(FORCE.tolist()))
    text = text.rstrip("\n") + end
    if not end:
        text = text[:-6]
    table = read_table(write(text))
    assert dict(table.column("F [N]").masked) == reasons
    assert any("ends without an end of line" in note for note in table.notes) == (not end)
