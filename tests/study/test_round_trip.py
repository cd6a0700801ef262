"""A resolved study reads back as the study it came from, to the last bit of every number."""

from __future__ import annotations

import math
import tomllib
from datetime import UTC
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fibrefit.study import load_study
from fibrefit.study.study import to_toml
from tests.study.conftest import Loader

#: The folder of the records stays the same for all examples: nothing in it depends on them.
SAME_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)

positive = st.floats(1e-9, 1e9)


@SAME_FOLDER
@given(
    mass=positive,
    angle=st.floats(0.01, 3.13),
    zero=st.floats(-1e3, 1e3),
    stiffness=positive,
    name=st.text(st.characters(codec="utf-8", exclude_categories=["Cs"], exclude_characters="\0"), min_size=1),
    shared=st.booleans(),
)
def test_resolved_studies(
    folder: Path, load: Loader, mass: float, angle: float, zero: float, stiffness: float, name: str, shared: bool
) -> None:
    study = load(
        ('"3.096 kg"', f'"{mass!r} kg"'),
        ('"45 deg"', f'"{angle!r} rad"'),
        ('"-0.12 mm"', f'"{zero!r} m"'),
        ('initial = "30 kN/m"', f'initial = "{stiffness!r} N/m"'),
        ('bounds = ["1 kN/m", "300 kN/m"]', f"shared = {str(shared).lower()}"),
        ('name = "two drops"', to_toml({"name": name}).strip()),
    )
    assert study.records[0].weight_mass == mass
    assert study.records[1].inclination == angle
    (folder / "resolved.toml").write_bytes(study.resolved_toml().encode())
    again = load_study(folder / "resolved.toml")
    assert again.model_dump() == study.model_dump()
    assert again.resolved_toml() == study.resolved_toml()


@pytest.mark.parametrize("angle", ["12 deg", "0.7°", "33.333333333333336 deg", "1.1 rad"])
def test_quantities_are_written_in_the_units_they_were_stated_in(load: Loader, folder: Path, angle: str) -> None:
    study = load(('"45 deg"', f'"{angle}"'), overrides=('records[0].lift="1 +/- 0.1 cm"',))
    turned = study.model_copy(update={"rig": study.rig.model_copy(update={"fibre_length": 0.1 + 0.2})})
    text = turned.resolved_toml(folder, as_written=True)
    said = tomllib.loads(text)
    assert [record["inclination"] for record in said["records"]] == ["90 deg", angle]
    assert (said["records"][0]["lift"], said["rig"]["weight_mass"]) == ("1 cm", "3.096 kg")
    assert said["rig"]["fibre_length"] == "0.30000000000000004 m"  # a number that no text stands for
    (folder / "written.toml").write_text(text, encoding="utf-8")
    again = load_study(folder / "written.toml")
    assert tomllib.loads(again.resolved_toml(folder)) == tomllib.loads(turned.resolved_toml(folder))
    assert tomllib.loads(again.resolved_toml(folder, as_written=True)) == said


def test_what_a_study_says_in_other_units_is_the_same_study(load: Loader) -> None:
    assert load().resolved_toml() == load(('"599 mm"', '"0.599 m"'), ('"5 mm"', '"0.5 cm"')).resolved_toml()


def test_a_resolved_study_can_move_to_another_folder(load: Loader, folder: Path) -> None:
    (folder / "mine.py").write_text("")
    study = load(('["guide.stribeck_friction"]', '["mine.py:Rubber"]'))
    other = folder / "results" / "one"
    other.mkdir(parents=True)
    (other / "study.toml").write_text(study.resolved_toml(relative_to=other))
    again = load_study(other)
    assert [record.label for record in again.records] == ["one.csv", "two.csv"]
    assert again.records[0].file == "../../one.csv"
    assert again.model.effects == ("../../mine.py:Rubber",)


scalars = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(codec="utf-8", exclude_categories=["Cs"])),
    st.dates(),
    st.times(),
    st.datetimes(timezones=st.none() | st.just(UTC)),
)
keys = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]))
tables: st.SearchStrategy[Any] = st.recursive(
    st.dictionaries(keys, scalars | st.lists(scalars)),
    lambda inner: st.dictionaries(
        keys, scalars | inner | st.lists(inner | scalars, min_size=1, max_size=3), max_size=4
    ),
    max_leaves=12,
)


@settings(max_examples=200, deadline=None)
@given(tables)
def test_what_is_written_as_toml_reads_back(content: dict[str, Any]) -> None:
    assert tomllib.loads(to_toml(content)) == content


@settings(deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_keep_their_last_bit(number: float) -> None:
    read = tomllib.loads(to_toml({"x": number}))["x"]
    assert (read, math.copysign(1, read)) == (number, math.copysign(1, number))
