"""Units: what people and loggers write, what must be refused; factors of columns and how well they are known."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fibrefit.core import units
from fibrefit.core.errors import DataError, FibrefitError, StudyError, UsageError
from fibrefit.core.formatting import format_number, format_quantity, shown_unit
from fibrefit.core.units import (
    ACCEPTED,
    DEFINITIONS,
    KINDS,
    USUAL,
    Scale,
    expression,
    in_percent,
    kind_of,
    parse_quantity,
    si_unit,
    to_si,
    uncertain,
)

ROOT = Path(__file__).resolve().parents[2]

#: Conversions are decimal factors: two roundings.
ROUNDING = 4 * sys.float_info.epsilon

QUANTITIES = [
    ("3.096 kg", "kg", 3.096),
    ("30 kN/m", "N/m", 30e3),
    ("30kN/m", "N/m", 30e3),
    ("30 N/mm", "N/m", 30e3),
    ("90 deg", "rad", math.pi / 2),
    ("90°", "rad", math.pi / 2),
    ("-0.25 mm", "m", -0.25e-3),
    ("1.63 g", "kg", 1.63e-3),
    ("10 N s/m", "N s/m", 10.0),
    ("10 Ns/m", "N s/m", 10.0),
    ("10 N·s/m", "N s/m", 10.0),
    ("10 kg/s", "N s/m", 10.0),
    ("2 kHz", "Hz", 2000.0),
    ("60 rpm", "Hz", 1.0),
    ("60 U/min", "Hz", 1.0),
    ("5 %", "-", 0.05),
    ("0.05", "-", 0.05),
    (0.05, "-", 0.05),
    (".5 m", "m", 0.5),
    ("1e-3 m", "m", 1e-3),
    ("3.288 kg m^2", "kg m^2", 3.288),
    ("0.3 1/m", "1/m", 0.3),
    ("0.3 1/mm", "1/m", 300.0),
    ("4 N s^2/m^2", "N s^2/m^2", 4.0),
    ("4 N s²/m²", "N s^2/m^2", 4.0),
    ("9.81 m/s2", "m/s^2", 9.81),
    ("20 lbf", "N", 88.96443230521),
    ("12 in", "m", 0.3048),
    ("2 N/s", "N/s", 2.0),
]


@pytest.mark.parametrize(("text", "si", "value"), QUANTITIES, ids=[str(q[0]) for q in QUANTITIES])
def test_quantity(text: str, si: str, value: float) -> None:
    assert parse_quantity(text, si) == pytest.approx(value, rel=ROUNDING)


SPELLINGS = [
    ("N", "Newtons newton NEWTON"),
    ("kN", "KN kN Kilonewton"),
    ("mm", "Millimeters millimetre Millimeter"),
    ("um", "µm μm um Micrometer micron"),
    ("s", "sec Sec SEC Sekunden seconds sek"),
    ("ms", "msec Millisekunden milliseconds"),
    ("min", "Minuten minute"),
    ("degC", "°C"),
    ("rpm", "U/min 1/min"),
    ("percent", "% Prozent"),
    ("Hz", "1/s S/s hertz"),
]


@pytest.mark.parametrize(("symbol", "spellings"), SPELLINGS)
def test_spellings_mean_the_same(symbol: str, spellings: str) -> None:
    for spelling in spellings.split():
        assert to_si(spelling, si_unit(symbol) or "") == to_si(symbol, si_unit(symbol) or ""), spelling


@pytest.mark.parametrize(
    "text", ["kx", "MM", "MS", "mS", "t", "F", "u", "x", "U", "N/m s", "N//m", "Hz^0", "m^9", "", "furlong"]
)
def test_unknown_units_are_not_guessed(text: str) -> None:
    assert expression(text) is None
    assert si_unit(text) is None
    assert kind_of(text) is None


REFUSED = [
    ("3.096", "kg", 'has no unit; expected kg, g or lb. Write it with its unit, such as "3.096 kg"'),
    (3, "kg", "has no unit"),
    ("3,096 kg", "kg", "decimal comma.*Write a point"),
    ("3 kx", "N", 'unit "kx"; expected N, kN, mN, daN, cN, lbf, kgf, gf or kip'),
    ("3 mm", "kg", 'unit "mm"; expected kg, g or lb'),
    ("1 kn/m", "N/m", 'Did you mean "kN/m"'),
    ("kg", "kg", "is not a quantity"),
    ("", "kg", "is not a quantity"),
    ("1.0.2 m", "m", "is not a quantity"),
    ("1e999 m", "m", "is not finite"),
    ("nan m", "m", "is not a quantity"),
    (True, "-", "is not a quantity"),
    (None, "-", "is not a quantity"),
    ("5 mm", "-", 'unit "mm"; expected a plain number or %'),
]


@pytest.mark.parametrize(("text", "si", "message"), REFUSED, ids=[f"{r[0]} as {r[1]}" for r in REFUSED])
def test_refused(text: str, si: str, message: str) -> None:
    with pytest.raises(StudyError, match=message) as refused:
        parse_quantity(text, si, "study.toml, rig.weight_mass")
    assert refused.value.where == "study.toml, rig.weight_mass"


def test_the_error_is_of_the_class_asked_for() -> None:
    with pytest.raises(UsageError):
        parse_quantity("3", "kg", "--set", error=UsageError)
    with pytest.raises(
        DataError,
        match=r'drop_07\.csv, column "force": unit "kx"; expected N, kN, mN, daN, cN, lbf, kgf, gf or kip\. Declare it',
    ):
        to_si("kx", "N", 'drop_07.csv, column "force"', do="Declare it under [units].")


def test_a_unit_of_this_program_that_does_not_exist_is_our_own_mistake() -> None:
    with pytest.raises(ValueError, match="no unit of this program"):
        to_si("N", "kx")


@pytest.mark.parametrize("si", sorted(KINDS))
def test_every_kind_reads_its_own_unit(si: str) -> None:
    assert si_unit(si) == si
    assert to_si(si, si) == 1.0
    assert parse_quantity(f"2.5 {si}" if si != "-" else "2.5", si) == 2.5


@pytest.mark.parametrize("si", sorted(ACCEPTED))
def test_what_messages_offer_is_accepted(si: str) -> None:
    for offered in ACCEPTED[si].replace(" or ", ", ").split(", "):
        if offered not in ("a plain number",):
            assert to_si(offered, si) > 0


def test_about_forty_units() -> None:
    assert 40 <= len(DEFINITIONS) <= 60


SHOWN = [
    (34213.7, "N/m", "34.21 kN/m"),
    (340.0, "N/m", "340 N/m"),
    (0.0138, "m", "13.8 mm"),
    (0.599, "m", "599 mm"),
    (1.82, "m", "1.82 m"),
    (2.5e-5, "m", "25 um"),
    (0.0, "m", "0 mm"),
    (0.0, "N", "0 N"),
    (0.41, "N", "0.41 N"),
    (-106.94, "N", "-106.9 N"),
    (math.pi / 2, "rad", "90 deg"),
    (5e-4, "s", "500 us"),
    (1.63e-3, "kg", "1.63 g"),
    (0.02, "-", "0.02"),
    (123456.0, "N s/m", "123500 N s/m"),
]


@pytest.mark.parametrize(("value", "si", "text"), SHOWN)
def test_shown_to_people(value: float, si: str, text: str) -> None:
    assert format_quantity(value, si) == text
    assert text.isascii()


@given(
    value=st.floats(min_value=-1e9, max_value=1e9, allow_subnormal=False),
    si=st.sampled_from(sorted(KINDS)),
)
def test_what_is_shown_reads_back(value: float, si: str) -> None:
    shown = format_quantity(value, si, digits=17)
    assert parse_quantity(shown, si) == pytest.approx(value, rel=1e-9, abs=1e-300)


@given(text=st.text(max_size=30), si=st.sampled_from(sorted(KINDS)))
def test_any_text_is_read_or_refused(text: str, si: str) -> None:
    try:
        assert math.isfinite(parse_quantity(text, si))
    except FibrefitError as refused:
        assert refused.where == "value"  # noqa: PT017  (either outcome is right)


def test_the_pair_of_value_and_error_shares_a_unit() -> None:
    unit, worth = shown_unit(34210.0, "N/m")
    assert (unit, worth) == ("kN/m", 1000.0)
    assert format_number(190.0 / worth, 2) == "0.19"


def test_pint_is_imported_only_when_a_unit_is_met() -> None:
    code = """
import sys, fibrefit.core.units, fibrefit.records
print(*{"pint", "jax", "matplotlib", "pandas", "scipy", "h5py"} & set(sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


@pytest.mark.parametrize("written", USUAL)
def test_usual_units_are_what_pint_says_of_them(written: str) -> None:
    assert units._by_registry(written) == USUAL[written]


def test_a_study_in_usual_units_is_read_without_pint() -> None:
    code = """
import sys
from pathlib import Path
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records, task_of
study = load_study("configs/drop_series")
task_of(study, read_records(study))
print("pint" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == "False"


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
