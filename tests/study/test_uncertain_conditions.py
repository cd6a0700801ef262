"""Conditions of records with an uncertainty: read, written again, refused where they say nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.core.errors import StudyError
from fibrefit.study import Study, load_study
from fibrefit.workflow.together.conditions import conditions_of_records

STUDY = """
schema = "fibrefit/study/1"
name = "drops"

[rig]
kind = "fibre_mass"
weight_mass = "3.1 kg"
inclination = "90 deg"

[[records]]
name = "a"
{first}
sampling_rate = "2 kHz"
duration = "1 s"

[[records]]
name = "b"
lift = "10 mm"
sampling_rate = "2 kHz"
duration = "1 s"
"""


def load(folder: Path, first: str) -> Study:
    """A study of two planned drops, the first as stated."""
    file = folder / "study.toml"
    file.write_text(STUDY.format(first=first), encoding="utf-8")
    return load_study(file)


@pytest.mark.parametrize(
    "first", ['lift = "5 +/- 0.1 mm"', 'lift = "5 mm"\nuncertainties = { lift = "100 um" }', 'lift = "5 ± 0.1 mm"']
)
def test_an_uncertainty_is_that_of_the_condition(tmp_path: Path, first: str) -> None:
    study = load(tmp_path, first)
    lift = next(one for one in conditions_of_records(study, study.records) if one.name == "lift")
    assert lift.values.tolist() == pytest.approx([0.005, 0.01])
    assert lift.errors.tolist() == pytest.approx([1e-4, 0.0])
    assert "5 mm +/- 0.1 mm" in str(study.records[0]) or "5 mm +/- 100 um" in str(study.records[0])


def test_it_is_written_and_read_again(tmp_path: Path) -> None:
    study = load(tmp_path, 'lift = "5 +/- 0.1 mm"')
    again = tmp_path / "again.toml"
    again.write_text(study.resolved_toml(), encoding="utf-8")
    assert load_study(again).records[0].uncertainty("lift") == pytest.approx(1e-4)
    assert load_study(again).records[1].uncertainty("lift") == 0.0


@pytest.mark.parametrize(
    ("first", "said"),
    [
        ('lift = "5 +/- 0.1 mm"\nuncertainties = { lift = "0.1 mm" }', "the uncertainty of lift twice"),
        ('lift = "5 mm"\nuncertainties = { height = "0.1 mm" }', 'the uncertainty of "height"'),
        ('lift = "5 mm"\nuncertainties = { lift = "0.1 kg" }', "kg"),
        ('lift = "5 mm"\nuncertainties = { lift = "0.1" }', "lift"),
        ('lift = "5 mm"\nuncertainties = { lift = "-0.1 mm" }', "as the uncertainty of lift"),
        ('lift = "5 mm"\nuncertainties = { fibre_length = "1 mm" }', "the uncertainty of fibre_length"),
        ('lift = "5 mm"\nuncertainties = "0.1 mm"', "uncertainties"),
        ('lift = "5 mm"\nrelease = "0.1 +/- 0.01 s"', "with an uncertainty"),
    ],
)
def test_what_says_nothing_is_refused(tmp_path: Path, first: str, said: str) -> None:
    with pytest.raises(StudyError, match="study.toml") as caught:
        load(tmp_path, first)
    assert said in str(caught.value)
