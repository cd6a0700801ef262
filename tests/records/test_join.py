"""One record from several files: parts, two loggers side by side, and a header in a file of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import joined, read_record, side_by_side
from tests.records.exports.base import FORCE, POSITION, N, f, fu, lines, t, tfu, u

HEAD = "Time [s],Force [N],Position [mm]\n"


def part(first: int, last: int, make) -> str:
    return HEAD + "".join(make(i) + "\n" for i in range(first, last))


def test_parts_whose_times_run_on(write) -> None:
    whole = joined([read_record(write(part(a, b, tfu()), f"p{a}.csv")) for a, b in ((0, 20), (20, 45), (45, N))])
    np.testing.assert_allclose(whole.time, np.arange(N) / 2000, atol=1e-12)
    np.testing.assert_allclose(whole.channels["force"], FORCE)
    assert not whole.gaps
    assert "p20.csv follows by its times; no sample is missing between." in whole.history


def test_parts_that_begin_anew(write) -> None:
    pieces = [write(part(a, b, lambda i, a=a: f"{t(i - a)},{f(i)},{u(i)}"), f"p{a}.csv") for a, b in ((0, 20), (20, N))]
    whole = joined([read_record(piece) for piece in pieces])
    np.testing.assert_allclose(whole.time, np.arange(N) / 2000, atol=1e-12)
    assert "p20.csv follows without a gap, as its times begin anew; no sample is missing between." in whole.history


def test_a_part_that_repeats_the_end_of_the_one_before(write) -> None:
    rows = [fu()(i) + "\n" for i in range(N)]
    cut = [("p1", rows[:30]), ("p2", rows[22:]), ("p3", rows[30:])]
    first, again, rest = (
        read_record(write("force [N],position [mm]\n" + "".join(own), f"{name}.csv"), rate=2000.0) for name, own in cut
    )
    assert len(joined([first, rest])) == N
    with pytest.raises(DataError, match="p2.csv: where it begins 8 rows repeat the 8 before them"):
        joined([first, again])


def test_parts_with_clocks_keep_the_gap_between_them(write) -> None:
    def stamped(i: int) -> str:
        return f"2024-05-12T14:22:{11 + i / 2000:07.4f}Z,{f(i)},{u(i)}"

    pieces = [write(part(a, b, stamped), f"p{a}.csv") for a, b in ((0, 20), (25, N))]
    whole = joined([read_record(piece) for piece in pieces])
    np.testing.assert_allclose(whole.time, np.delete(np.arange(N), range(20, 25)) / 2000, atol=1e-5)
    assert [gap.missing for gap in whole.gaps] == [5]


def test_parts_that_do_not_belong_together_are_refused(write) -> None:
    first, second = (read_record(write(part(a, b, tfu()), f"p{a}.csv")) for a, b in ((0, 30), (20, N)))
    with pytest.raises(DataError, match="it begins at 10 ms, and the part before it ends at 14.5 ms.*in their order"):
        joined([first, second])
    with pytest.raises(DataError, match="the channels force in a part of a record of force, position"):
        joined([first, second.only("force")])


def test_two_loggers_with_an_offset_of_their_clocks(write) -> None:
    force = read_record(write("Time [s],Force [N]\n" + lines(lambda i: f"{t(i)},{f(i)}"), "f.csv"))
    shifted = read_record(write("Time [s],Position [mm]\n" + lines(lambda i: f"{i / 2000 + 5:.4f},{u(i)}"), "x.csv"))
    whole = side_by_side(force, shifted, -5.0)
    np.testing.assert_allclose(whole.channels["position"], POSITION * 1e-3, rtol=1e-9)
    assert "sample by sample" in whole.history[-1]
    half = side_by_side(force, shifted, -5.0 + 0.25e-3)
    np.testing.assert_allclose(half.channels["position"][1:], (POSITION[1:] + POSITION[:-1]) / 2e3, rtol=1e-6)
    assert not half.valid["position"][0]
    assert "interpolated linearly at 59 instants" in half.history[-1]
    with pytest.raises(DataError, match="times from 5 s .*State the offset of its clock"):
        side_by_side(force, shifted)
    with pytest.raises(DataError, match="the force, which f.csv holds too"):
        side_by_side(force, force)


def test_clocks_tell_the_offset_themselves(write) -> None:
    def stamped(head: str, cell, late: int) -> str:
        return head + "".join(f"14:22:{11 + (i + late) / 2000:07.4f},{cell(i)}\n" for i in range(N))

    force = read_record(write(stamped("Time,Force [N]\n", f, 0), "f.csv"))
    position = read_record(write(stamped("Time,Position [mm]\n", u, 10), "x.csv"))
    whole = side_by_side(force, position)
    np.testing.assert_allclose(whole.channels["position"][10:], POSITION[:-10] * 1e-3, rtol=1e-3)
    assert not whole.valid["position"][:10].any()


@pytest.mark.parametrize("dated", [True, False])
def test_clocks_in_columns_of_a_parquet_file_tell_the_offset_too(dated: bool, tmp_path) -> None:
    day = "2024-05-12T14:22:11" if dated else "1970-01-01T14:22:11"

    def stamped(name: str, column: str, values: np.ndarray, late: int) -> Path:
        times = np.datetime64(day, "ns") + (np.arange(N) + late) * np.timedelta64(500_000, "ns")
        pd.DataFrame({"Time": times, column: values}).to_parquet(tmp_path / name)
        return tmp_path / name

    force = read_record(stamped("f.parquet", "Force [N]", FORCE, 0))
    position = read_record(stamped("x.parquet", "Position [mm]", POSITION, 10))
    whole = side_by_side(force, position)
    # A number of seconds since the year 1 is good to 8 us.
    np.testing.assert_allclose(whole.channels["position"][10:], POSITION[:-10] * 1e-3, rtol=1e-3, atol=5e-6)
    assert not whole.valid["position"][:10].any()
    # The same clock as one in words.
    assert force.origin == pytest.approx((739018 * 86400.0 if dated else 0.0) + 51731.0)


CONFIGURATIONS = {
    "run.ini": "[DAQ]\nfs = 2000 Hz\n[Channel1]\nname = Force\nunit = N\n[Channel2]\nname = Position\nunit = mm\n",
    "run.json": '{"sample_rate_hz": 2000, "channels": [{"name": "Force", "unit": "N"}, '
    '{"name": "Position", "unit": "mm"}]}',
    "run.hdr": "Sample rate: 2,000 Hz\nForce [N],Position [mm]\n",
    "run.cfg": "sampling rate=2000\nch1_name=Force\nch1_unit=N\nch2_name=Position\nch2_unit=mm\n",
}


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_header_in_a_file_of_its_own(name: str, write) -> None:
    record = read_record(write(lines(fu()), "run.csv"), header=write(CONFIGURATIONS[name], name))
    np.testing.assert_allclose(record.time, np.arange(N) / 2000, atol=1e-12)
    np.testing.assert_allclose(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], POSITION * 1e-3)


STUDY = """schema = "fibrefit/study/1"
name = "x"
[rig]
kind = "fibre_mass"
weight_mass = "3 kg"
inclination = "90 deg"
[channels]
position = "Weg"
[units]
position = "mm"
time = "s"
[[records]]
file = "a.csv"
parts = ["b.csv"]
beside = { file = "x.csv", clock_offset = "-5 s" }
"""


def test_a_study_names_them_all(write) -> None:
    from fibrefit.study import load_study
    from fibrefit.workflow.inspection.inspection import inspect
    from fibrefit.workflow.prepare import read_records

    for first, last, name in ((0, 30, "a.csv"), (30, N, "b.csv")):
        write(part(first, last, lambda i: f"{t(i)},{f(i)},1").replace("Position [mm]", "aux [V]"), name)
    write("Zeit;Weg\n" + lines(lambda i: f"{i / 2000 + 5:.4f};{u(i)}"), "x.csv")
    study = load_study(write(STUDY, "study.toml"))
    assert [seen.verdict for seen in inspect(study).seen] == ["understood"] * 3
    (record,) = read_records(study)
    assert record.name == "a.csv"
    np.testing.assert_allclose(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], POSITION * 1e-3)


@pytest.mark.parametrize("odd", ["a.csv", "x.csv"])
def test_a_file_of_two_side_by_side_that_is_not_understood_is_told_of(odd: str, write) -> None:
    """It is reported with the reason, and the other one as what it is; a fit is refused for that reason."""
    from fibrefit.study import load_study
    from fibrefit.workflow.inspection.inspection import inspect
    from fibrefit.workflow.prepare import read_records

    force, position = (
        "Time [s],Force [N]\n" + lines(lambda i: f"{t(i)},{f(i)}"),
        "Zeit;Weg\n" + lines(lambda i: f"{i / 2000 + 5:.4f};{u(i)}"),
    )
    for name, text in (("a.csv", force), ("x.csv", position)):
        write("no numbers at all\n" if name == odd else text, name)
    study = load_study(write(STUDY.replace('parts = ["b.csv"]\n', ""), "study.toml"))
    seen = inspect(study)
    verdicts = {one.understood["file"]: one.verdict for one in seen.seen}
    assert verdicts == {name: "not understood" if name == odd else "understood" for name in ("a.csv", "x.csv")}
    with pytest.raises(DataError) as refused:
        read_records(study)
    assert str(refused.value) == str(*seen.refusals)


def test_files_that_are_not_understood_are_told_at_once(write) -> None:
    """All of a study, and of each all that is in doubt; no more are read than are told."""
    from fibrefit.study import load_study
    from fibrefit.workflow.prepare import read_records

    text = "Zeit [s];Kraft [V];Weg [mV]\n" + lines(lambda i: f"{t(i)};{f(i)};{u(i)}")
    names = [f"{letter}.csv" for letter in "abcdefgh"]
    for name in names:
        write("no numbers at all\n" if name == "b.csv" else text, name)
    records = "".join(f'[[records]]\nfile = "{name}"\n' for name in names)
    study = load_study(write(STUDY.partition("[channels]")[0] + records, "study.toml"))
    with pytest.raises(DataError) as refused:
        read_records(study)
    places = [line.partition(":")[0] for line in str(refused.value).splitlines()]
    force, position = 'column "Kraft [V]"', 'column "Weg [mV]"'
    assert places[:5] == [f"a.csv, {force}", f"a.csv, {position}", "b.csv", f"c.csv, {force}", f"c.csv, {position}"]
    assert len(places) in (8, 9)
    assert not any(name in str(refused.value) for name in names[-3:])


def test_a_gap_of_the_second_logger_is_not_bridged(write) -> None:
    force = read_record(write("Time [s],Force [N]\n" + lines(lambda i: f"{t(i)},{f(i)}"), "f.csv"))
    kept = [i for i in range(N) if not 20 <= i < 40]
    rows = "".join(f"{i / 2000 + 5:.4f},{u(i)}\n" for i in kept)
    position = read_record(write("Time [s],Position [mm]\n" + rows, "x.csv"))
    assert position.gaps
    for offset, first, last in ((-5.0, 20, 40), (-5.0 + 0.25e-3, 20, 41)):
        whole = side_by_side(force, position, offset)
        seen = whole.valid["position"]
        assert not seen[first:last].any()
        assert seen[1:first].all()
        assert seen[last:].all()


def test_what_is_said_of_a_later_part_is_kept(write) -> None:
    first = read_record(write("Time [s],Force [N]\n" + lines(lambda i: f"{t(i)},{f(i)}"), "a.csv"))
    later = replace(first, time=first.time + 1.0, history=(*first.history, "300 readings are left out as saturated."))
    whole = joined([first, later])
    assert sum("left out as saturated" in line for line in whole.history) == 1
    assert len(set(whole.history)) == len(whole.history)
