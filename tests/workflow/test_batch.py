"""Many identifications: which, what comes of each, what is kept. The fits themselves are made of paper."""

from __future__ import annotations

import csv
import gc
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jsonschema
import pytest

from fibrefit.core.errors import DataError, StudyError, UsageError, as_one
from fibrefit.records.copies import Fingerprint
from fibrefit.report.batch import batch_report
from fibrefit.series.engines import Done
from fibrefit.store.summary import read_summary
from fibrefit.study import Study
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries.results import FitSummary
from fibrefit.study.summaries.series import BatchItem, BatchSummary
from fibrefit.workflow.batches import batch
from fibrefit.workflow.batches.batch import Batch, Engine, _error_line, batch_studies
from fibrefit.workflow.batches.item import Job, Outcome, identified, outcome_of
from fibrefit.workflow.batches.jobs import copies_of, jobs_of, origins_of
from fibrefit.workflow.batches.run import batch as batch_command
from fibrefit.workflow.batches.shards import part_of, parts_of, shard_of
from fibrefit.workflow.growing import growing_folder
from tests.fitting import made
from tests.study.test_summaries import FIT

SCHEMA = Path(__file__).resolve().parents[2] / "data_schemas" / "batch.schema.json"


@pytest.fixture
def series(tmp_path: Path) -> Path:
    """Two records and their study."""
    where = tmp_path / "series"
    where.mkdir()
    made.study(where)
    made.write(where, made.records(share=0.5, seed=3))
    return where


@pytest.fixture
def drawn() -> None:
    """Asked for by a test that looks at figures."""


@pytest.fixture(autouse=True)
def _undrawn(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures take longer than all else; most tests do not look at them."""
    if "drawn" not in request.fixturenames:
        monkeypatch.setattr("fibrefit.plots.save.save_figures", lambda *of, **how: [])


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the jobs that were carried out; one called "bad" has bad data, one called "odd" shows a fault,
    and the model of one called "more" leaves more than noise."""
    names: list[str] = []

    def outcome(job: Job) -> Outcome:
        names.append(job.name)
        if job.name.startswith("bad"):
            raise DataError(job.name, "nothing", "something", "Measure again.")
        if job.name.startswith("odd"):
            raise ZeroDivisionError("by nought\nand more")
        status = "suspect" if job.name.startswith("so-so") else "ok"
        update: dict = {"status": status}
        if job.name.startswith("more"):
            left = FIT.checks[0].model_copy(update={"passed": False, "about": "model", "quantity": "residual size"})
            update["checks"] = (left,)
        seen = len(job.name.removeprefix("twice "))
        looks = Fingerprint(600, {"force": [seen + 0.1 * place for place in range(64)]}, {"force": 1e-3})
        update["provenance"] = None
        return outcome_of(job, FIT.model_copy(update=update), job.digest(), looks if seen == 3 else None)

    monkeypatch.setattr(batch, "identified", outcome)
    return names


def jobs(series: Path, *names: str) -> list[Job]:
    (one, *_) = jobs_of(origins_of([str(series)], None, ()), "study", 4, 0)
    return [Job(name, one.origin, None, 4, 0) for name in names]


def carried_out(work: list[Job], out: Path, **how: bool) -> Batch:
    with growing_folder(out, (batch.ITEMS,), **how) as directory:
        found = batch_studies("many", work, directory.path)
        found.write(directory)
    return found


def test_a_failed_case_does_not_stop_the_rest(series: Path, asked: list[str], tmp_path: Path) -> None:
    found = carried_out(jobs(series, "a", "bad", "odd", "so-so", "z"), tmp_path / "out")
    assert asked == ["a", "bad", "odd", "so-so", "z"]
    assert [item.status for item in found.items.values()] == ["ok", None, None, "suspect", "ok"]
    assert found.items["bad"].error == "bad: nothing; expected something. Measure again."
    assert found.items["odd"].error == "fault in the program: ZeroDivisionError: by nought"
    assert found.status == "suspect"
    assert isinstance(read_summary(tmp_path / "out" / "items" / "a"), FitSummary)


@pytest.mark.usefixtures("drawn")
def test_the_files_are_for_programs_and_spreadsheets(series: Path, asked: list[str], tmp_path: Path) -> None:
    carried_out(jobs(series, "a", "bad, it is"), tmp_path / "out")
    content = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(content, json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert content["items"]["a"]["result"] == "items/a"
    assert [check["passed"] for check in content["checks"]] == [False, True, True, True]
    with (tmp_path / "out" / "results.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["item"] for row in rows] == ["a", "bad, it is"]
    assert float(rows[0]["stiffness [N/m]"]) == 34210.0
    assert rows[0]["status"] == "ok"
    assert rows[1]["status"] == "not possible"
    assert "Measure again." in rows[1]["error"]
    assert (tmp_path / "out" / "figures" / "parameters.png").exists()


def test_a_batch_says_what_it_rests_on(series: Path, asked: list[str], tmp_path: Path) -> None:
    """The study and the records, by name and digest; a record that is gone since costs no result."""
    work = jobs(series, "a", "z")
    records = sorted(work[0].study.data_files())
    assert len(records) == 2
    found = carried_out(work, tmp_path / "out").summary().provenance.inputs
    assert {Path(name).name for name in found} == {"study.toml", *(file.name for file in records)}
    assert found[records[0].as_posix()] == sha256(records[0].read_bytes()).hexdigest()
    records[0].unlink()
    left = carried_out(work, tmp_path / "again").summary().provenance.inputs
    assert set(found) - set(left) == {records[0].as_posix()}


def test_digests_are_those_of_what_was_read(
    series: Path, asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though a file is another one, or gone, by the time all is done, and though items are taken up."""
    plain, (job,) = batch.identified, jobs(series, "a")
    file = job.study.data_files()[0]
    read = sha256(file.read_bytes()).hexdigest()

    def changing(job: Job) -> Outcome:
        found = plain(job)
        origin = FIT.provenance.model_copy(update={"inputs": {file.as_posix(): read}})
        made = outcome_of(job, FIT.model_copy(update={"provenance": origin}), json.loads(found.item)["digest"])
        file.write_text("another measurement\n")
        return made

    monkeypatch.setattr(batch, "identified", changing)
    found = carried_out([job], tmp_path / "out")
    assert sha256(file.read_bytes()).hexdigest() != read
    assert found.summary().provenance.inputs[file.as_posix()] == read
    assert read_summary(tmp_path / "out") == found.summary()
    file.unlink()
    assert found.summary().provenance.inputs[file.as_posix()] == read


def test_items_that_the_model_does_not_explain_are_named(series: Path, asked: list[str], tmp_path: Path) -> None:
    found = carried_out(jobs(series, "a", "more", "bad"), tmp_path / "out")
    assert found.items["more"].lacks == ("residual size",)
    assert found.items["more"].status == "ok"
    assert "MODEL model: 1 of 2 items leave more than noise: more." in " ".join(found.report().split())
    assert "looks for what the model lacks" in " ".join(found.report().split())
    with (tmp_path / "out" / "results.csv").open(encoding="utf-8", newline="") as file:
        assert [row["lacks"] for row in csv.DictReader(file)] == ["", "residual size", ""]
    assert "MODEL" not in carried_out(jobs(series, "a"), tmp_path / "other").report()


@pytest.mark.parametrize("said", ["lacks", "speeds"])
def test_an_item_that_does_not_say_all_is_done_again(series: Path, asked: list[str], tmp_path: Path, said: str) -> None:
    batch_studies("many", jobs(series, "a"), tmp_path)
    file = tmp_path / "items" / "a" / "item.json"
    kept = json.loads(file.read_text(encoding="utf-8"))
    batch_studies("many", jobs(series, "a"), tmp_path)
    assert asked == ["a"]
    del kept["item"][said]
    file.write_text(json.dumps(kept), encoding="utf-8")
    batch_studies("many", jobs(series, "a"), tmp_path)
    assert asked == ["a", "a"]


def test_the_report_counts_and_names(series: Path, asked: list[str], tmp_path: Path) -> None:
    found = carried_out(jobs(series, "a", "b", "so-so", *(f"bad {n}" for n in range(20))), tmp_path / "out")
    text = found.report()
    assert text == batch_report(read_summary(tmp_path / "out"))  # type: ignore[arg-type]
    assert max(map(len, text.splitlines())) <= 80
    plain = " ".join(text.split())
    for part in (
        "23 identifications: 2 ok, 1 suspect, 20 not possible.",
        "FAILED identifications: 20 of 23 items could not be carried out: bad 0, bad 1, bad 2, bad 3, bad 4 and 15 "
        "more.",
        "and 8 more: see results.csv.",
        "run the same again with --resume",
        "stiffness 34.21",
    ):
        assert part in plain, part


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (("a", "bad", "odd", "bad 2"), "1 of 4 can be used: see what to doubt."),
        (("a", "so-so"), "All 2 can be used: see what to doubt."),
        (("a", "b"), "each passed all checks of its numbers."),
        (("bad",), "None of these identifications can be used."),
    ],
)
def test_how_many_can_be_used_is_counted(
    series: Path, asked: list[str], tmp_path: Path, names: tuple[str, ...], says: str
) -> None:
    text = " ".join(carried_out(jobs(series, *names), tmp_path / "out").report().split())
    assert says in text
    assert "All 0" not in text


def test_a_median_of_nothing_and_its_errors_are_told_in_one_unit() -> None:
    """Of a friction that most items have at its end: the errors had been told in a unit of their own each."""
    frictions = (0.0, 0.0, 0.0, 3.0, 4.0)
    values = [s.ParameterSummary(value=1e3 * one, unit="N", std_error=20.0 + one) for one in frictions]
    items = {str(n): BatchItem(status="ok", gap=1.0, parameters={"friction": one}) for n, one in enumerate(values)}
    text = " ".join(batch_report(BatchSummary(status="ok", name="many", items=items)).split())
    assert "friction 0 20 N 5" in text
    spread = [one.model_copy(update={"value": n * 1e3 - 2e3}) for n, one in enumerate(values)]
    items = {name: items[name].model_copy(update={"parameters": {"friction": spread[int(name)]}}) for name in items}
    text = " ".join(batch_report(BatchSummary(status="ok", name="many", items=items)).split())
    assert "friction 0 1.5 0.020 kN 5" in text


def test_an_interruption_ends_those_at_work_though_somebody_keeps_where_it_was(
    series: Path, asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a notebook keeps the last traceback; also between two outcomes, while one is put away."""
    ended = []

    def engine(work: Any, arguments: Sequence[Any]) -> Iterator[Done]:
        try:
            for number, argument in enumerate(arguments):
                yield Done(number, work(argument))
        finally:
            ended.append(True)

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(batch, "in_this_process", engine)
    with pytest.raises(KeyboardInterrupt) as kept:
        batch_studies("many", jobs(series, "a", "z"), tmp_path, Engine(), interrupted)
    assert ended == [True]
    assert len(kept.traceback) > 1


def test_an_interrupted_batch_goes_on(
    series: Path, asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = batch.identified

    def interrupted(job: Job) -> Outcome:
        if job.name == "c":
            raise KeyboardInterrupt
        return kept(job)

    monkeypatch.setattr(batch, "identified", interrupted)
    work = jobs(series, "a", "bad", "c", "d")
    with pytest.raises(KeyboardInterrupt):
        carried_out(work, tmp_path / "out")
    monkeypatch.setattr(batch, "identified", kept)
    asked.clear()
    found = carried_out(work, tmp_path / "out", resume=True)
    # What could not be done is tried again: the file may have been put right.
    assert asked == ["bad", "c", "d"]
    assert found.taken_up == 1
    assert list(found.items) == ["a", "bad", "c", "d"]


def test_what_was_done_is_kept_where_its_study_or_record_cannot_be_read_for_a_time(
    series: Path, asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hours of work are not lost to a misprint, or to a share that is away."""
    out, kept = tmp_path / "out", batch.identified
    work = [replace(job, record=0) for job in jobs(series, "b/1", "b/2", "gone")]
    carried_out(work, out)

    def away(job: Job) -> Outcome:
        raise DataError(job.name, "no such file", "a record")

    # Now "b" is one job, as its study cannot be read, and the record of "gone" is away.
    monkeypatch.setattr(batch, "identified", away)
    monkeypatch.setattr(batch, "_resumed", lambda *of: None)
    now = [*jobs(series, "b"), work[2]]
    found = carried_out(now, out, resume=True)
    batch.forget_others(out, now)
    assert [item.status for item in found.items.values()] == [None, None]
    monkeypatch.undo()
    monkeypatch.setattr(batch, "identified", kept)
    asked.clear()
    assert carried_out(work, out, resume=True).taken_up == 3
    assert asked == []
    # What is listed no more is gone.
    batch.forget_others(out, work[:1])
    assert [path.parent.name for path in out.glob("items/*/item.json")] == ["b_1"]


def test_what_has_changed_is_done_again(series: Path, asked: list[str], tmp_path: Path) -> None:
    work = jobs(series, "a", "b")
    carried_out(work, tmp_path / "out")
    asked.clear()
    carried_out(work, tmp_path / "out", resume=True)
    assert asked == []
    record = next(series.glob("*.csv"))
    record.write_text(record.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    carried_out(work, tmp_path / "out", resume=True)
    assert asked == ["a", "b"]


@pytest.mark.parametrize("damage", ["", "{", '{"digest": 1}', "[]"])
def test_a_damaged_item_is_done_again(series: Path, asked: list[str], tmp_path: Path, damage: str) -> None:
    work = jobs(series, "a")
    carried_out(work, tmp_path / "out")
    (tmp_path / "out" / "items" / "a" / "item.json").write_text(damage)
    carried_out(work, tmp_path / "out", resume=True)
    assert asked == ["a", "a"]


def test_nothing_usable_is_a_failed_batch(series: Path, asked: list[str], tmp_path: Path) -> None:
    found = carried_out(jobs(series, "bad"), tmp_path / "out")
    assert found.status == "failed"
    assert found.plot() == {}


def test_progress_tells_how_far_and_how_long(series: Path, asked: list[str], tmp_path: Path) -> None:
    said: list[tuple[str, float | None]] = []
    batch_studies("many", jobs(series, "a", "bad"), tmp_path, Engine(), lambda *words: said.append(words))
    assert said[0][0].startswith("1 of 2 identified; ")
    assert said[0][0].endswith(" a second, about 0 s left")
    assert said[0][1] == 0.5
    assert said[1][0].startswith("2 of 2 identified, 1 not possible; ")


def test_what_is_done_is_on_disk_until_all_are(series: Path, asked: list[str], tmp_path: Path) -> None:
    def alive() -> int:
        return sum(type(one) is BatchItem for one in gc.get_objects())

    work, before, seen = jobs(series, *"abcdefgh"), alive(), list[int]()
    for _ in range(2):  # identified, and taken up
        found = batch_studies(
            "many", [*work, *jobs(series, "bad")], tmp_path, Engine(), lambda *_: seen.append(alive())
        )
        assert all(found.items[job.name].result == f"items/{job.name}" for job in work[:-1])
        assert len(found.items) == 9
        assert max(seen) - before <= 1
        del found
        seen.clear()


@pytest.fixture
def lifted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A series of ten records whose stiffness rises with the lift; that of the last one is far off."""
    where = tmp_path / "lifted"
    lifts = [1e-3 * (5 + n) for n in range(10)]
    made.study(where, lifts)

    def outcome(job: Job) -> Outcome:
        lift = job.study.records[0].lift
        noise = 5.0 * (-1.0) ** round(1e3 * lift)
        value = 2e4 + 1e5 * lift + noise + (900.0 if lift > 0.0135 else 0.0)
        stiffness = FIT.parameters["stiffness"].model_copy(update={"value": value, "std_error": 10.0})
        # Falls as far as it is lifted: a speed of its own, and another one for friction.
        speed = (2 * 9.81 * lift) ** 0.5
        told = {"stiffness": (0.0, speed, speed), "friction": (0.0, 2.0 * speed, speed)}
        record = next(iter(FIT.records.values())).model_copy(update={"speeds": told})
        update = {"status": "ok", "parameters": {"stiffness": stiffness}, "records": {"one": record}}
        return outcome_of(job, FIT.model_copy(update=update), job.digest())

    monkeypatch.setattr(batch, "identified", outcome)
    return where


def of_records(series: Path) -> list[Job]:
    return jobs_of(origins_of([str(series)], None, ()), "record", 4, 0)


@pytest.mark.usefixtures("drawn")
def test_a_batch_says_what_its_records_say_together(lifted: Path, tmp_path: Path) -> None:
    found = carried_out(of_records(lifted), tmp_path / "out")
    summary = found.summary()
    trend = next(one for one in summary.trends if one.condition == "lift")
    assert trend.chance_corrected < 1e-3
    assert trend.slope_interval_95[0] < 1e5 < trend.slope_interval_95[1]
    assert [stray.record for stray in trend.outliers] == ["drop_14mm.csv"]
    pooled = summary.population["stiffness"]
    assert pooled.mean_interval_95[0] < 21000.0 < pooled.mean_interval_95[1]
    assert pooled.chance < 1e-6
    plain = " ".join(found.report().split())
    assert "stiffness over lift: 100" in plain
    assert "drop_14mm.csv does not follow the others" in plain
    assert {"population", "trends"} <= {path.stem for path in (tmp_path / "out" / "figures").glob("*.png")}
    with (tmp_path / "out" / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["record"] for row in rows[:2]] == ["drop_5mm.csv", "drop_6mm.csv"]
    assert float(rows[1]["lift [m]"]) == 0.006
    assert (tmp_path / "out" / "table.parquet").exists()


def test_a_parameter_is_held_against_the_speed_that_its_record_tells_of_it_at(lifted: Path, tmp_path: Path) -> None:
    found = carried_out(of_records(lifted), tmp_path / "out")
    trend = next(one for one in found.summary().trends if one.condition == "speed")
    assert (trend.parameter, trend.condition_unit) == ("stiffness", "m/s")
    # From 5 to 13 mm, as the record of 14 mm is off: 800 N/m over 0.192 m/s.
    assert trend.slope_interval_95[0] < 800.0 / 0.192 < trend.slope_interval_95[1]
    with (tmp_path / "out" / "table.csv").open(encoding="utf-8", newline="") as file:
        row = next(csv.DictReader(file))
    assert float(row["speed of stiffness [m/s]"]) == pytest.approx((2 * 9.81 * 0.005) ** 0.5)


def test_values_are_drawn_to_the_mean_of_all(lifted: Path, tmp_path: Path) -> None:
    found = carried_out(of_records(lifted), tmp_path / "out")
    middle = found.summary().population["stiffness"].mean
    with (tmp_path / "out" / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for row, item in zip(rows, found.summary().items.values(), strict=True):
        value, drawn = float(row["value"]), float(row["shrunk"])
        assert abs(drawn - middle) < abs(value - middle)
        # Records differ by far more than their errors: pooling takes next to nothing off these.
        assert float(row["shrunk_error"]) == pytest.approx(float(row["std_error"]), rel=1e-3)
        assert item.shrunk["stiffness"].value == pytest.approx(drawn)


def test_a_parameter_is_held_against_the_day_of_its_test(lifted: Path, tmp_path: Path) -> None:
    study = lifted / "study.toml"
    days = iter(range(1, 11))
    lines = study.read_text(encoding="utf-8").split("\n")
    said = [f'{line}\ntaken = "2026-03-{next(days):02d}"' if line.startswith("file =") else line for line in lines]
    study.write_text("\n".join(said), encoding="utf-8")
    found = carried_out(of_records(lifted), tmp_path / "out")
    trend = next(one for one in found.summary().trends if one.condition == "time since the first record")
    # A millimetre and 100 N/m a day.
    assert trend.slope_interval_95[0] < 100.0 < trend.slope_interval_95[1]
    assert trend.chance_corrected < 1e-3


@pytest.mark.parametrize("name", ["out", "out[1]"])
def test_parts_are_gathered(lifted: Path, tmp_path: Path, name: str) -> None:
    whole, work = tmp_path / name, of_records(lifted)
    for number in (1, 2, 3):
        folder, mine = part_of(whole, work, (number, 3))
        carried_out(mine, folder)
    assert [path.name for path in parts_of(whole)] == [f"{name}.shard-{n}-of-3" for n in (1, 2, 3)]
    found = batch_studies("many", work, (tmp_path / "growing", *parts_of(whole)))
    assert found.taken_up == len(work)
    assert list(found.items) == [job.name for job in work]
    alone = batch_studies("many", work, tmp_path / "alone")
    assert found.table() == alone.table()


@pytest.mark.parametrize("said", ["0/3", "4/3", "3", "a/b", "-1/3", pytest.param("1/" + "9" * 5000, id="long")])
def test_a_part_that_is_none_is_refused(said: str) -> None:
    with pytest.raises(UsageError, match="i/n with i from 1 to n"):
        shard_of(said)


def test_more_parts_than_records_are_refused(lifted: Path) -> None:
    with pytest.raises(UsageError, match="as many parts at the most"):
        part_of(Path("out"), of_records(lifted), (11, 11))


def test_a_study_gives_a_job_a_record(series: Path) -> None:
    found = jobs_of(origins_of([str(series)], None, ()), None, 4, 0)
    assert [job.record for job in found] == [0, 1]
    assert len(found[0].study.records) == 1
    assert found[0].digest() != found[1].digest()
    assert found[0].name == found[0].study.records[0].label


def test_several_studies_give_a_job_each(series: Path, tmp_path: Path) -> None:
    folders = [tmp_path / "all" / name for name in ("x", "y")]
    for folder in folders:
        folder.parent.mkdir(exist_ok=True)
        series.rename(folder) if folder.name == "x" else made_again(folder)
    found = jobs_of(origins_of([str(tmp_path / "all")], None, ()), None, 4, 0)
    assert [(job.name, job.record) for job in found] == [("x", None), ("y", None)]
    each = jobs_of(origins_of([str(tmp_path / "all")], None, ()), "record", 4, 0)
    assert len(each) == 4
    assert each[0].name.startswith("x/")
    twice = jobs_of(origins_of([str(folders[0]), str(folders[0])], None, ()), None, 4, 0)
    assert [job.name for job in twice] == ["x", "x (2)"]


def test_no_two_jobs_have_one_name(tmp_path: Path) -> None:
    folders = [tmp_path / year / name for year, name in (("2023", "rope"), ("2024", "rope"), ("2025", "rope (2)"))]
    for folder in (*folders, tmp_path / "2026" / "rope"):
        made_again(folder)
    words = [str(folder) for folder in (*folders, folders[0])]
    names = [job.name for job in jobs_of(origins_of(words, None, ()), None, 4, 0)]
    assert names == ["rope", "rope (2)", "rope (2) (2)", "rope (3)"]


def test_two_gauges_of_one_file_are_two_measurements(lifted: Path) -> None:
    plain = of_records(lifted)
    copies, name = copies_of(plain), plain[3].name
    assert len(copies) == len(plain) - 1  # all files are empty
    text = (lifted / "study.toml").read_text(encoding="utf-8")
    channels = 'channels = { force = "force 2 [N]" }'
    (lifted / "study.toml").write_text(text.replace(f'"{name}"', f'"{name}"\n{channels}'), encoding="utf-8")
    assert set(copies) - set(copies_of(of_records(lifted))) == {name}


def test_parts_are_gathered_whatever_their_items_are_called(lifted: Path, tmp_path: Path) -> None:
    """Long names are cut, and numbered where they are alike then: in a part by itself and in the whole differently."""
    work = [replace(job, name=f"{'a rope of the laboratory/' * 5}{n}") for n, job in enumerate(of_records(lifted))]
    parts = [tmp_path / f"part {n}" for n in (1, 2)]
    for part, folder in enumerate(parts):
        batch_studies("part", work[part::2], folder)
    found = batch_studies("whole", work, (tmp_path / "whole", *parts))
    assert found.taken_up == len(work)
    whole = batch_studies("anew", work, tmp_path / "anew")
    assert found.items == whole.items


def made_again(folder: Path) -> None:
    folder.mkdir(parents=True)
    made.study(folder)
    made.write(folder, made.records(share=0.5, seed=4))


def test_bare_records_are_jobs_of_one_rig(series: Path) -> None:
    files = sorted(str(path) for path in series.glob("*.csv"))
    overrides = ('rig.weight_mass="3.096 kg"', 'rig.inclination="90 deg"')
    found = jobs_of(origins_of(files, "fibre_mass", overrides), None, 4, 0)
    assert [job.name for job in found] == [Path(file).name for file in files]


def test_an_unreadable_study_among_many_is_one_failed_job(series: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "study.toml").write_text("schema = 1")
    work = jobs_of(origins_of([str(series), str(broken)], None, ()), "record", 4, 0)
    assert [job.name for job in work][-1] == "broken"
    with pytest.raises(StudyError):
        identified(work[-1])
    with pytest.raises(StudyError):
        jobs_of(origins_of([str(broken)], None, ()), None, 4, 0)


def test_how_well_a_condition_is_known_is_told_and_drawn(lifted: Path, tmp_path: Path) -> None:
    file = lifted / "study.toml"
    exact = carried_out(of_records(lifted), tmp_path / "exact").summary()
    text = re.sub(r'lift = "([\d.]+) (m+)"', r'lift = "\1 +/- 0.5 mm"', file.read_text(encoding="utf-8"))
    file.write_text(text, encoding="utf-8")
    told = carried_out(of_records(lifted), tmp_path / "told").summary()
    assert {error for item in told.items.values() for error in item.condition_errors.values()} == {5e-4}
    assert set(next(iter(told.items.values())).condition_errors) == {"lift [m]"}
    errors = [next(one for one in of.trends if one.condition == "lift").slope_error for of in (exact, told)]
    assert errors[1] > 1.1 * errors[0]
    assert not any(item.condition_errors for item in exact.items.values())


def test_all_mistakes_of_an_item_are_told_in_one_line() -> None:
    mistakes = as_one([StudyError("a.toml", "one"), StudyError("a.toml", "two")], "a.toml")
    assert _error_line(mistakes) == "a.toml: one. a.toml: two."
    assert _error_line(ValueError("x\ny")) == "fault in the program: ValueError: x"


def test_words_that_name_no_study_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="a folder without studies"):
        origins_of([str(tmp_path)], None, ())
    bare = tmp_path / "drop.csv"
    with pytest.raises(UsageError, match="no such file"):
        origins_of([str(bare)], None, ())
    bare.write_text("time [s],force [N]\n0,0\n")
    with pytest.raises(UsageError, match="Add --rig fibre_mass"):
        origins_of([str(bare)], None, ())


def test_one_identification_is_that_of_the_fit(study: Study, folder: Path) -> None:
    """The only real one: a record of the series alone."""
    job = jobs_of(origins_of([str(folder)], None, ()), None, made.STARTS, 0)[1]
    summary = FitSummary.model_validate_json(identified(job).summary)
    assert list(summary.records) == [study.records[1].label]
    stiffness = summary.parameters["stiffness"]
    assert stiffness.std_error is not None
    assert abs(stiffness.value - made.TRUTH["stiffness"]) < 4.0 * stiffness.std_error


def test_a_file_that_is_missing_is_one_item_and_an_error_names_its_record(series: Path) -> None:
    files = sorted(series.glob("*.csv"))
    files[0].unlink()
    missing, there = sorted(jobs_of(origins_of([str(series)], None, ()), "record", 1, 0), key=lambda job: job.name)
    with pytest.raises(DataError, match=f"{files[0].name}: no such file"):
        identified(missing)
    cut = files[1].read_text(encoding="utf-8").splitlines()[:80]
    files[1].write_text("\n".join([*cut, ""]), encoding="utf-8")
    with pytest.raises(DataError, match=f"^{files[1].name}: the record does not fall"):
        identified(there)


def test_a_record_that_is_listed_twice_counts_once(lifted: Path, tmp_path: Path) -> None:
    """Copies of one measurement would make the population narrower than it is."""
    work = of_records(lifted)
    files = [lifted / job.study.records[0].file for job in work]
    for number, file in enumerate(files):
        file.write_text(f"{file.read_text()}# {number}\n")
    for file in files[3:6]:
        file.write_bytes(files[0].read_bytes())
    alone = carried_out([*work[:3], *work[6:]], tmp_path / "alone")
    found = batch_command(lifted, tmp_path / "out", starts=4, processes=1)
    refused = [name for name, item in found.items.items() if item.error]
    assert refused == [job.name for job in work[3:6]]
    said = f'{work[3].name}: the same data as "{work[0].name}"; expected each measurement once.'
    assert found.items[work[3].name].error.startswith(said)
    assert set(found.tidy()["record"]) == {job.name for job in work} - set(refused)
    assert found.summary().population["stiffness"].mean == pytest.approx(alone.summary().population["stiffness"].mean)
    again = batch_command(lifted, tmp_path / "out", starts=4, processes=1, resume=True)
    assert {name: item.error for name, item in again.items.items()} == {n: i.error for n, i in found.items.items()}
    assert again.taken_up == len(work) - len(refused)


def test_a_record_in_other_digits_counts_once(series: Path, tmp_path: Path, asked: list[str]) -> None:
    """Its bytes are others; it is known by how it looks, which is kept beside each item."""
    work = jobs(series, "four", "two", "twice two")
    found = carried_out(work, tmp_path / "out")
    assert found.items["four"].error is found.items["two"].error is None
    assert found.items["twice two"].error.startswith(
        'twice two: the same data as "two"; expected each measurement once.'
    )
    again = carried_out(work, tmp_path / "out", resume=True)
    assert again.items == found.items
    assert asked == ["four", "two", "twice two"], "what was kept says how each looks"


def test_a_study_of_which_all_files_are_missing_is_refused_at_once(series: Path) -> None:
    for file in series.glob("*.csv"):
        file.unlink()
    with pytest.raises(StudyError, match="no file"):
        jobs_of(origins_of([str(series)], None, ()), "record", 1, 0)


def test_a_record_that_changes_while_it_is_identified_is_identified_anew(
    series: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (job,) = jobs(series, "one")
    before = job.digest()

    def changing(*given: object) -> SimpleNamespace:
        file = next(series.glob("*.csv"))
        file.write_text(f"{file.read_text()}# measured again\n")
        return SimpleNamespace(status="ok")

    monkeypatch.setattr("fibrefit.workflow.fit.prepared", lambda study: ((), None))
    monkeypatch.setattr("fibrefit.fitting.identify.identify", changing)
    monkeypatch.setattr("fibrefit.workflow.fit.Fit", lambda *of: SimpleNamespace(summary=lambda: FIT))
    kept = json.loads(identified(job).item)
    assert kept["digest"] == before
    assert kept["digest"] != job.digest()


@pytest.mark.parametrize("effect", ["guide.friction_change@2", "fibre.knot_slip@1", "fibre.stiffness_trend"])
def test_a_record_by_itself_has_no_place_in_a_series(tmp_path: Path, effect: str) -> None:
    said = f'[model]\neffects = ["guide.viscous_friction", "{effect}"]'
    made.study(tmp_path / "two", more=said)
    with pytest.raises(StudyError, match=f'the effect "{effect}", which goes by the place of a record in its series'):
        jobs_of(origins_of([str(tmp_path / "two")], None, ()), None, 4, 0)
    assert len(jobs_of(origins_of([str(tmp_path / "two")], None, ()), "study", 4, 0)) == 1
    # The only record of a study is its series.
    made.study(tmp_path / "one", made.LIFTS[:1], more='[model]\neffects = ["fibre.knot_slip@1"]')
    assert len(jobs_of(origins_of([str(tmp_path / "one")], None, ()), "record", 4, 0)) == 1


def test_a_study_that_goes_by_places_stops_none_of_the_others(series: Path, tmp_path: Path) -> None:
    made.study(tmp_path / "trend", more='[model]\neffects = ["guide.friction_trend"]')
    work = jobs_of(origins_of([str(series), str(tmp_path / "trend")], None, ()), "record", 4, 0)
    assert [job.name.partition("/")[0] for job in work] == ["series", "series", "trend", "trend"]
    with pytest.raises(StudyError, match='the effect "guide.friction_trend", which goes by the place'):
        identified(work[-1])


def test_a_study_that_is_edited_meanwhile_mixes_up_no_records(
    lifted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A record put before the others makes each of them another one in its place; one put behind them, nothing."""
    plain, file, before = batch.identified, lifted / "study.toml", of_records(lifted)
    head, first, *others = file.read_text(encoding="utf-8").split("[[records]]")
    blocks = [first, *others]
    last = f"{blocks[-1].rstrip()}\n\n"

    def editing(job: Job) -> Outcome:
        found = plain(job)
        if job.name == before[1].name:
            (lifted / "further.csv").touch()
            further = first.replace(before[0].name, "further.csv")
            file.write_text("[[records]]".join([head, *blocks[:-1], last, further]), encoding="utf-8")
        if job.name == before[3].name:
            file.write_text("[[records]]".join([head, last, *blocks[:-1]]), encoding="utf-8")
        return found

    monkeypatch.setattr(batch, "identified", editing)
    conditions = carried_out(before, tmp_path / "alone").conditions
    assert [conditions[job.name].values["lift"] for job in before] == pytest.approx([1e-3 * (5 + n) for n in range(10)])
    items = json.loads((tmp_path / "alone" / "summary.json").read_text(encoding="utf-8"))["items"]
    done = [name for name, item in items.items() if item["error"] is None]
    assert done == [job.name for job in before[:4]]
    values = [items[name]["parameters"]["stiffness"]["value"] for name in done]
    assert values == pytest.approx([2e4 + 1e2 * (5 + n) - 5.0 * (-1.0) ** n for n in range(4)])
    said = f'{file}: says something else of "{before[5].name}" than when the batch began'
    assert items[before[5].name]["error"].startswith(said)


def test_the_same_again_finds_its_folder_whatever_was_put_right(
    lifted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By its words and its settings; what is listed no more is kept no longer."""
    monkeypatch.chdir(tmp_path)
    for job in of_records(lifted):
        (lifted / job.study.records[0].file).write_text(job.name)  # no copies of each other
    found = batch_command("lifted", starts=4, processes=1)
    gone, *left = [job.name for job in of_records(lifted)]
    file = lifted / "study.toml"
    head, _, *others = file.read_text(encoding="utf-8").split("[[records]]")
    file.write_text("[[records]]".join([head, *others]), encoding="utf-8")
    with pytest.raises(UsageError, match="exists already.*Add --resume to go on with it, --force to replace it"):
        batch_command("lifted", starts=4, processes=1)
    again = batch_command("lifted", starts=4, processes=1, resume=True)
    assert (again.folder, again.taken_up, list(again.items)) == (found.folder, len(left), left)
    kept = {path.parent.name for path in Path(again.folder).glob("items/*/summary.json")}
    assert len(kept) == len(left)
    assert not any(gone.startswith(name) for name in kept)
    other = batch_command("lifted", starts=5, processes=1)
    assert other.folder != found.folder


def test_another_batch_is_not_gone_on_with_in_the_folder_of_one(lifted: Path, tmp_path: Path) -> None:
    """A wrong folder that is typed costs nothing."""
    for job in of_records(lifted):
        (lifted / job.study.records[0].file).write_text(job.name)
    out = tmp_path / "out"
    done = batch_command(lifted, out, starts=4, processes=1)
    file = lifted / "study.toml"
    head, *records = file.read_text(encoding="utf-8").split("[[records]]")
    (lifted / "other.csv").write_text("another")
    other = records[0].replace(of_records(lifted)[0].study.records[0].file or "", "other.csv")
    file.write_text("[[records]]".join([head, other]), encoding="utf-8")
    with pytest.raises(UsageError, match="items of another batch, such as .*; expected items of this one.*--out"):
        batch_command(lifted, out, starts=4, processes=1, resume=True)
    assert {path.parent.name for path in out.glob("items/*/summary.json")} == {
        Path(item.result or "").name for item in done.items.values()
    }


def test_what_a_part_has_no_longer_is_kept_for_the_part_that_has_it(lifted: Path, tmp_path: Path) -> None:
    """A record that is taken off the list makes each one behind it another part's."""
    for job in of_records(lifted):
        (lifted / job.study.records[0].file).write_text(job.name)
    out, file = tmp_path / "out", lifted / "study.toml"
    done = batch_command(lifted, out, starts=4, processes=1, shard=(1, 2))
    head, _, *others = file.read_text(encoding="utf-8").split("[[records]]")
    file.write_text("[[records]]".join([head, *others]), encoding="utf-8")
    mine, other = (batch_command(lifted, out, starts=4, processes=1, shard=(part, 2), resume=True) for part in (1, 2))
    assert not set(mine.items) & set(done.items)
    assert (set(other.items) <= set(done.items), other.taken_up) == (True, len(other.items))


def test_records_of_several_studies_are_no_studies(lifted: Path, tmp_path: Path) -> None:
    made_again(tmp_path / "second")
    found = batch_command([lifted, tmp_path / "second"], tmp_path / "out", each="record", starts=4, processes=1)
    assert found.name == "2 studies"
    assert len(found.items) > 10
