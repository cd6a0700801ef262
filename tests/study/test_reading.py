"""What a study says about reading its files reaches the reader."""

from __future__ import annotations

import pytest

from fibrefit.core.errors import StudyError
from fibrefit.study.reading import reading_of
from tests.study.conftest import Loader

NOTHING = {"header": None, "channels": {}, "units": {}, "columns": (), "delimiter": None, "decimal": None, "rate": None}


def test_the_arguments_of_a_study(load: Loader) -> None:
    study = load(('lift = "10 mm"', 'lift = "10 mm"\nsampling_rate = "2 kHz"'), overrides=("files.decimal=,",))
    assert study.reading(study.records[0]) == {
        **NOTHING,
        "channels": {"time": "time [s]", "force": "Kraft", "position": "position [mm]"},
        "units": {"force": "kN"},
        "decimal": ",",
        "rate": 2000.0,
    }
    assert study.reading(study.records[1])["rate"] is None


def test_the_arguments_of_bare_files() -> None:
    assert reading_of(()) == NOTHING
    given = ("channels.force=Kraft", "units.Kraft=kN", "files.columns=['a [s]', 'b']", "files.delimiter=;")
    assert reading_of(given) == {
        **NOTHING,
        "channels": {"force": "Kraft"},
        "units": {"Kraft": "kN"},
        "columns": ("a [s]", "b"),
        "delimiter": ";",
    }


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("channels.forc=Kraft", 'Did you mean "force"'),
        ("rig.weight_mass=3 kg", "unknown key; expected one of channels, units, files"),
        ("files.decimal=;", r'--set files.decimal=;: ";"; expected "." or ","'),
        ("files.delimiter=ab", '"ab"; expected one character'),
        ("files.columns=time", '"time"; expected a list'),
        ("units.force=3", "3; expected text"),
    ],
)
def test_what_makes_no_sense(override: str, says: str) -> None:
    with pytest.raises(StudyError, match=says):
        reading_of((override,))
