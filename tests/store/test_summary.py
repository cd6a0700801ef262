"""``summary.json`` reads back as what was written, or says what is wrong with it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from fibrefit.core.errors import DataError, FibrefitError, StudyError
from fibrefit.store import provenance, read_summary, write_summary
from fibrefit.study.summaries.results import Basin, FitSummary, Gap, RecordSummary

GAP = Gap.model_validate({"force": {"rms": 0.1 + 0.2, "unit": "N", "noise": 0.4, "ratio": 1.5}, "total": 1.5})


@pytest.fixture
def summary(tmp_path: Path) -> FitSummary:
    data = tmp_path / "ä.csv"
    data.write_text("1")
    origin = provenance('name = "x"', [data], seed=7, seconds=1.5)
    return FitSummary(
        status="ok",
        study="Füße",
        parameters={},
        gap=GAP,
        records={"ä": RecordSummary(gap=GAP)},
        checks=(),
        provenance=origin,
    )


def test_it_reads_back(tmp_path: Path, summary: FitSummary) -> None:
    path = write_summary(tmp_path, summary)
    assert read_summary(tmp_path) == summary
    assert read_summary(path) == summary
    assert json.loads(path.read_text(encoding="utf-8"))["gap"]["force"]["rms"] == 0.1 + 0.2


def test_what_it_rests_on(summary: FitSummary) -> None:
    origin = summary.provenance
    assert origin is not None
    assert next(iter(origin.inputs.values())).startswith("6b86b273ff34fce1")
    assert origin.created.endswith("+00:00")
    assert origin.versions["numpy"][0].isdigit()
    assert (origin.seed, origin.seconds) == (7, 1.5)


@pytest.mark.parametrize(
    ("content", "error", "says"),
    [
        ("{", DataError, "not JSON"),
        ("[]", StudyError, "schema null; expected one of fibrefit/fit/1"),
        ('{"schema": "fibrefit/fit/9"}', StudyError, 'schema "fibrefit/fit/9"'),
        ('{"schema": ["x"]}', StudyError, "schema"),
        ('{"schema": "fibrefit/fit/1"}', StudyError, "summary.json, status"),
        ("\xff", DataError, "not JSON"),
    ],
)
def test_what_is_no_summary(tmp_path: Path, content: str, error: type[FibrefitError], says: str) -> None:
    (tmp_path / "summary.json").write_bytes(content.encode("latin-1"))
    with pytest.raises(error, match=says):
        read_summary(tmp_path)


def test_numbers_are_not_taken_from_text(tmp_path: Path, summary: FitSummary) -> None:
    path = write_summary(tmp_path, summary)
    path.write_text(path.read_text(encoding="utf-8").replace('"total": 1.5', '"total": "1.5"'), encoding="utf-8")
    with pytest.raises(StudyError, match="total"):
        read_summary(path)


def test_a_missing_result_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"summary.json: no such file"):
        read_summary(tmp_path)
    with pytest.raises(DataError, match="no such file"):
        read_summary(tmp_path / "none")


def test_nothing_is_written_that_is_not_finite() -> None:
    for value in (math.nan, math.inf, -math.inf):
        assert json.loads(Gap(total=value).model_dump_json())["total"] is None
    with pytest.raises(ValueError, match="finite"):
        Basin(cost=math.nan, starts=1)


@pytest.mark.parametrize(
    ("name", "what"), [("inspection.json", "an inspection"), ("simulated", "a simulation"), ("study.toml", "a study")]
)
def test_a_folder_that_is_no_such_result_is_told_for_what_it_is(tmp_path: Path, name: str, what: str) -> None:
    (tmp_path / "study.toml").touch()
    (tmp_path / name).mkdir() if name == "simulated" else (tmp_path / name).touch()
    with pytest.raises(DataError, match=f"{what}, without a summary.json; expected a result of another command"):
        read_summary(tmp_path)
