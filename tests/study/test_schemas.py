"""The JSON Schemas in ``data_schemas/`` are those of the code, and accept what the code accepts."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from fibrefit.study import schemas
from tests.study.conftest import TEXT
from tests.study.test_summaries import EXAMPLES

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "data_schemas"
NAMES = sorted(schemas.schemas())


def test_there_is_one_for_every_kind_of_file() -> None:
    assert [
        f"{name}.schema.json"
        for name in (
            "batch",
            "discovery",
            "distinguish",
            "fit",
            "plan",
            "posterior",
            "prediction",
            "series",
            "study",
            "sweep",
        )
    ] == NAMES
    assert sorted(path.name for path in FOLDER.iterdir()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_files_and_code_agree(name: str) -> None:
    on_disk = json.loads((FOLDER / name).read_text(encoding="utf-8"))
    assert on_disk == schemas.schemas()[name], "run `make schemas`"
    jsonschema.Draft202012Validator.check_schema(on_disk)


def test_the_command_writes_them(tmp_path: Path) -> None:
    schemas.write_schemas(tmp_path)
    for name in NAMES:
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()


def test_writing_them_needs_no_jax() -> None:
    code = "import sys, fibrefit.study.schemas; sys.exit('jax' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def validator(name: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schemas.schemas()[f"{name}.schema.json"])


@pytest.mark.parametrize("path", sorted(ROOT.glob("configs/**/study.toml")), ids=lambda path: path.parent.name)
def test_the_schema_accepts_the_studies_that_ship(path: Path) -> None:
    validator("study").validate(tomllib.loads(path.read_text(encoding="utf-8")))


def test_the_schema_accepts_every_way_to_write_a_study() -> None:
    content = tomllib.loads(TEXT)
    validator("study").validate(content)
    validator("study").validate({**content, "records": "series.csv"})


def test_the_schema_accepts_a_number_of_the_rig_with_an_uncertainty() -> None:
    content = {
        "schema": "fibrefit/study/1",
        "name": "axis",
        "rig": {"kind": "guided_mass", "gain": "1.02 +/- 0.01"},
        "records": [{"file": "axis.csv"}],
    }
    assert validator("study").is_valid(content)
    assert not validator("study").is_valid(content | {"rig": {"kind": "guided_mass", "gain": []}})


@pytest.mark.parametrize(
    "change",
    [
        {"schema": "fibrefit/study/2"},
        {"records": []},
        {"colour": "red"},
        {"rig": {"kind": "fibre_mass", "weight_mass": 3.0}},
        {"rig": {"kind": "fibre_mass", "wieght_mass": "3 kg"}},
        {"model": {"tension_law": "slack"}},
        {"parameters": {"stiffness": {"intial": "3 N/m"}}},
    ],
)
def test_the_schema_refuses_what_the_code_refuses(change: dict[str, Any]) -> None:
    assert not validator("study").is_valid(tomllib.loads(TEXT) | change)


@pytest.mark.parametrize("schema", EXAMPLES)
def test_the_schema_accepts_what_the_code_writes(schema: str) -> None:
    validator(schema.split("/")[1]).validate(json.loads(EXAMPLES[schema].model_dump_json(by_alias=True)))
