"""The eighteen example files of laboratory loggers: read exactly, or refused with the reason."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import TimeGap, describe, read_record, read_table

LOGGERS = Path(__file__).parent.parent / "data" / "loggers"

TIME = np.arange(6) / 2000
FORCE = 12.5 + 0.001 * np.arange(6)
POSITION = -0.25e-3 - 1e-7 * np.arange(6)

#: One rounding of the decimal text and one of the conversion to SI.
LAST_BITS = 4e-16

EXACT = [
    "01_plain.csv",
    "02_excel_de_cp1252.csv",
    "03_excel_cz_cp1250.csv",
    "05_units_row.csv",
    "06_catman_simple.txt",
    "07_catman_channel_info.txt",
    "09_labview.lvm",
    "10_clock_time.csv",
    "11_no_time_comments.csv",
    "14_instron_like.csv",
    "15_zwick_like.csv",
    "17_utf16.txt",
]


@pytest.mark.parametrize("name", EXACT)
def test_read_exactly(name: str) -> None:
    record = read_record(LOGGERS / name)
    np.testing.assert_allclose(record.time, TIME, rtol=0, atol=1e-12)
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=LAST_BITS)
    np.testing.assert_allclose(record.channels["position"], POSITION, rtol=LAST_BITS)
    assert all(valid.all() for valid in record.valid.values())
    assert record.rate == 2000.0


def test_the_sep_line_file_carries_no_units() -> None:
    path = LOGGERS / "04_excel_utf8_bom_sepline.csv"
    table = read_table(path)
    np.testing.assert_array_equal(table.column("Kraft").values, [12.5, 12.501, 12.502, 12.503, 12.504, 12.505])
    with pytest.raises(
        DataError,
        match=r'columns "Zeit", "Kraft", "Weg": no units; .* such as time = "s", force = "N", position = "mm"',
    ):
        read_record(path)
    record = read_record(path, units={"time": "s", "force": "N", "position": "mm"})
    np.testing.assert_allclose(record.channels["position"], POSITION, rtol=LAST_BITS)
    assert record.rate == 2000.0


def test_the_header_decides_the_rate_of_a_channel_block() -> None:
    record = read_record(LOGGERS / "07_catman_channel_info.txt")
    assert 'rate from the header ("dt=500 us")' in record.history[0]


def test_of_two_rates_the_slow_group_is_named_and_left_out() -> None:
    path = LOGGERS / "08_catman_two_rates.txt"
    record = read_record(path)
    assert set(record.channels) == {"force"}
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=LAST_BITS)
    assert "Left out, sampled at 100 Hz: Temp [°C]." in record.history
    slow = read_table(path).times[1]
    assert slow.rate == 100.0


def test_without_a_header_names_are_asked_for() -> None:
    path = LOGGERS / "12_headerless.txt"
    with pytest.raises(DataError, match="3 columns without headings.*Name the columns in order"):
        read_record(path)
    record = read_record(path, columns=["time [s]", "force [N]", "position [mm]"])
    np.testing.assert_allclose(record.channels["position"], POSITION, rtol=LAST_BITS)
    by_number = read_record(
        path,
        channels={"time": "column 1", "force": "column 2", "position": "column 3"},
        units={"time": "s", "force": "N", "position": "mm"},
    )
    np.testing.assert_array_equal(by_number.channels["force"], record.channels["force"])


def test_bad_samples_are_masked_and_counted_and_the_gap_is_named() -> None:
    path = LOGGERS / "13_bad_tokens.csv"
    record = read_record(path)
    np.testing.assert_allclose(record.time, [0, 0.0005, 0.001, 0.0015, 0.002, 0.003], rtol=LAST_BITS)
    np.testing.assert_array_equal(record.valid["force"], [True, True, False, False, False, True])
    np.testing.assert_array_equal(record.valid["position"], [True, False, True, True, True, True])
    assert np.isnan(record.channels["force"][2:5]).all()
    assert record.gaps == (TimeGap(0.002, 1),)
    table = read_table(path)
    assert dict(table.column("F [N]").masked) == {"not a number": 1, "overflow": 1, "absurd": 1}
    assert dict(table.column("u [mm]").masked) == {"empty": 1}
    text = " ".join(" ".join(describe(table)).split())
    assert "Gap after 2 ms: 1 sample missing." in text
    assert "3 masked (1 not a number, 1 overflow, 1 absurd)" in text


def test_a_comma_for_columns_and_decimals_is_refused_with_both_readings() -> None:
    with pytest.raises(DataError) as refused:
        read_record(LOGGERS / "16_ambiguous_comma.csv")
    said = str(refused.value)
    assert "as 6 whole numbers (0  0000  12  500  -0  2500)" in said
    assert "as 3 with a decimal comma (0,0000  12,500  -0,2500)" in said
    assert "Export it again with semicolons or tabs" in said


def test_thousands_are_refused_with_the_line() -> None:
    with pytest.raises(DataError, match=r'column "F \[N\]", line 2: "1\.012,5" has a thousands separator.*Export'):
        read_record(LOGGERS / "18_thousands.csv")


@pytest.mark.parametrize("path", sorted(LOGGERS.glob("[01]*")), ids=lambda path: path.name)
def test_what_was_understood_can_be_saved(path: Path) -> None:
    if path.name[:2] in ("12", "16", "18"):
        with pytest.raises(DataError, match=path.name) as refused:
            read_table(path)
        assert refused.value.exit_code == 3
        return
    table = read_table(path)
    saved = json.loads(json.dumps(table.understood))
    assert saved["schema"] == "fibrefit/understood/1"
    assert saved["columns"][0]["samples"] == 6
    assert all(len(line) <= 80 for line in describe(table))


@pytest.mark.parametrize(
    ("name", "encoding", "header"),
    [
        ("02_excel_de_cp1252.csv", "cp1252", "Verschiebung [µm]"),
        ("03_excel_cz_cp1250.csv", "cp1250", "Síla v laně [N]"),
        ("04_excel_utf8_bom_sepline.csv", "UTF-8", "Kraft"),
        ("15_zwick_like.csv", "cp1252", "Standardkraft"),
        ("17_utf16.txt", "UTF-16", "Kraft [N]"),
    ],
)
def test_encodings(name: str, encoding: str, header: str) -> None:
    table = read_table(LOGGERS / name)
    assert table.layout["encoding"] == encoding
    assert header in [column.header for column in table.columns]
