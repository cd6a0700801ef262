"""From an empty folder to a result and back, with nothing stubbed."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from fibrefit.store import read_result, read_summary
from fibrefit.study import load_study
from fibrefit.study.schemas import schemas
from fibrefit.study.summaries.results import FitSummary
from tests.cli.conftest import Run

#: Stiffness [N/m] of the fibre in the demonstration record, from a fit of the whole series it belongs to,
#: and how far one record alone may be from it: five of its standard errors.
STIFFNESS, ALLOWED = 11150.7, 25.0


@pytest.fixture
def done(fibrefit: Run) -> Run:
    """The demonstration study, fitted into ``out``."""
    assert fibrefit("init", "demo").code == 0
    fitted = fibrefit("fit", "demo", "--out", "out", "--starts", "2", "-q")
    assert fitted.code == 0, fitted.err
    assert "stiffness" in fitted.out
    return fibrefit


def test_the_demonstration_study(done: Run) -> None:
    summary = read_summary("out")
    assert isinstance(summary, FitSummary)
    assert summary.parameters["stiffness"].value == pytest.approx(STIFFNESS, abs=ALLOWED)

    content = json.loads(Path("out/summary.json").read_text())
    jsonschema.validate(content, schemas()["fit.schema.json"])
    assert done("show", "out", "--json").document == content

    groups, attributes = read_result(Path("out/result.h5"))
    assert attributes["schema"] == "fibrefit/fit/1"
    assert groups["observed_data"]["force"].unit == "N"
    assert content["provenance"]["resolved_study"] == str(groups["provenance"]["resolved_study"].values)
    assert len(content["provenance"]["inputs"]) == 2

    again = load_study("out/study.toml")
    assert again.records[0].weight_mass == load_study("demo").records[0].weight_mass
    assert [path.name for path in Path("out/figures").iterdir()] == ["overview.png"]
    drawn = done("show", "out", "--figures", "png", "--out", "drawn").out.split()
    assert {"overview.png", "starts.png", "record_drop_10mm_90deg.png"} <= {Path(file).name for file in drawn}

    # The resolved study beside the result is a study like any other.
    assert done("simulate", "out/study.toml", "--out", "simulated").code == 0
    header = Path("simulated/simulated/drop_10mm_90deg.csv").read_text().partition("\n")[0]
    assert header == "time [s],force [N],position [mm]"
