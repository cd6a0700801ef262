"""Names to vector and back, for any mixture of shared, own, held and partly held values."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fibrefit.core.arrays import assembled, gathered
from fibrefit.core.matrices import least_squares
from fibrefit.core.programs import fingerprint
from fibrefit.problem.statement.layout import Layout, Range, Slot

RECORDS = ("a.csv", "b.csv", "c.csv")
FREE = Range(-np.inf, np.inf, 1.0)
POSITIVE = Range(0.0, np.inf, 2.0)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    """Some slots of each kind; the held value tells slot and record."""
    slots = []
    for i in range(draw(st.integers(1, 5))):
        shared, kind = draw(st.booleans()), draw(st.sampled_from(("free", "held", "partly")))
        fixed: tuple[float | None, ...] = ()
        if kind == "held":
            fixed = (100.0 + i,)
        elif kind == "partly" and not shared:
            fixed = tuple(100.0 * (r + 1) + i if draw(st.booleans()) else None for r in range(len(RECORDS)))
        slots.append(Slot(f"p{i}", "-", POSITIVE if i % 2 else FREE, shared, fixed))
    return Layout(tuple(slots), RECORDS)


@given(layouts())
def test_every_record_gets_the_value_that_bears_its_name(layout: Layout) -> None:
    values = np.arange(1.0, layout.size + 1.0)
    local = np.asarray(layout.local(values))
    named = dict(zip(layout.free_names, values, strict=True))
    for r, record in enumerate(RECORDS):
        for j, slot in enumerate(layout.slots):
            held = slot.fixed_in(r)
            name = slot.name if slot.shared else f"{slot.name}[{record}]"
            assert local[r, j] == (named[name] if held is None else held)


@given(layouts())
def test_columns_are_the_places_of_the_values_that_move_a_record(layout: Layout) -> None:
    values = np.arange(1.0, layout.size + 1.0)
    before = np.asarray(layout.local(values))[:, list(layout.local_free)]
    for place in range(layout.size):
        moved = values + (np.arange(layout.size) == place)
        changed = np.asarray(layout.local(moved))[:, list(layout.local_free)] != before
        np.testing.assert_array_equal(changed, layout.local_columns == place)


@given(layouts(), st.integers(0, 3))
def test_coordinates_there_and_back(layout: Layout, more: int) -> None:
    values = np.linspace(0.5, 3.0, (more + 1) * layout.size).reshape(more + 1, layout.size)
    np.testing.assert_allclose(layout.values(layout.free(values)), values, rtol=1e-12)


def test_packing_takes_one_number_or_one_for_each_record() -> None:
    layout = Layout((Slot("k", "N/m", POSITIVE), Slot("zero", "m", FREE, False, (None, 0.0, None))), RECORDS)
    assert layout.free_names == ("k", "zero[a.csv]", "zero[c.csv]")
    np.testing.assert_array_equal(layout.pack({"k": 3.0, "zero": [1.0, 2.0, 4.0]}), [3.0, 1.0, 4.0])
    np.testing.assert_array_equal(layout.pack({"k": [3.0, 5.0, 7.0], "zero": 1.0}), [5.0, 1.0, 1.0])


def test_of_records_that_differ_a_shared_value_is_the_mean() -> None:
    layout = Layout((Slot("k", "N/m", POSITIVE), Slot("zero", "m", POSITIVE, False)), RECORDS)
    assert layout.means_of(np.array([[3.0, 1.0], [5.0, 2.0], [7.0, 4.0]])).tolist() == [5.0, 1.0, 2.0, 4.0]


def test_a_layout_without_free_values_still_serves() -> None:
    layout = Layout((Slot("k", "N/m", POSITIVE, True, (5.0,)),), RECORDS)
    assert layout.size == 0
    np.testing.assert_array_equal(layout.values(layout.free(np.empty(0))), np.empty(0))
    np.testing.assert_array_equal(layout.local(np.empty(0)), [[5.0]] * 3)


def test_a_name_that_is_missing_is_not_made_up() -> None:
    with pytest.raises(KeyError, match="k"):
        Layout((Slot("k", "N/m", POSITIVE),), RECORDS).pack({})


@given(layouts())
def test_names_of_records_make_no_other_program_and_their_number_does(layout: Layout) -> None:
    renamed, more = Layout(layout.slots, ("x", "y", "z")), Layout(layout.slots, ("a.csv", "b.csv"))
    assert renamed == layout
    assert hash(renamed) == hash(layout)
    assert fingerprint(renamed) == fingerprint(layout)
    assert renamed.records != layout.records
    assert more != layout
    assert fingerprint(more) != fingerprint(layout)


def test_sums_of_a_motion_that_ran_away_warn_of_nothing() -> None:
    local, columns = np.full((2, 1, 1), np.inf) * [[[1.0]], [[-1.0]]], np.zeros((2, 1), dtype=int)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(assembled(local, columns, 1)).all()
        assert np.isnan(gathered(local[..., 0], columns, 1)).all()


@pytest.mark.parametrize("gone", ["normal", "right"])
def test_equations_that_hold_no_numbers_have_no_solution_and_raise_nothing(gone: str) -> None:
    """Slopes of a motion that the least change leads elsewhere are none: LAPACK would end the program for it."""
    normal, right = np.diag([4.0, 9.0]), np.array([2.0, 3.0])
    np.testing.assert_allclose(least_squares(normal, right), [0.5, 1.0 / 3.0])
    {"normal": normal[0], "right": right}[gone][0] = np.nan
    assert np.isnan(least_squares(normal, right)).all()
