"""All that is wrong with a study is told at once, a line each, and nothing that only follows from it."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest

from fibrefit.core.declarations import Parameter
from fibrefit.core.errors import FibrefitError, StudyError
from fibrefit.study import load_study
from tests.study.conftest import Loader


def told(error: FibrefitError, folder: Path) -> list[str]:
    """Lines of a message, without the folder."""
    return str(error).replace(f"{folder}{os.sep}", "").splitlines()


def test_all_mistakes_are_told_a_line_each(load: Loader, folder: Path) -> None:
    """Unknown keys beside wrong values, and nothing of what follows from another mistake."""
    with pytest.raises(StudyError) as caught:
        load(
            ("weight_mass =", "wieght_mass ="),
            ('inclination = "90 deg"', "inclination = 90"),
            ('"heaviside"', '"heavyside"'),
            ('lift = "5 mm"', 'lift = "5 kg"\nlfit = 3'),
        )
    assert [line.partition("; expected")[0] for line in told(caught.value, folder)] == [
        "study.toml, rig.wieght_mass: unknown key",
        "study.toml, records[1].lfit: unknown key",
        "study.toml, rig.inclination: 90 without a unit",
        'study.toml, model.tension_law: "heavyside"',
        'study.toml, records[1].lift: unit "kg"',
    ]
    for line, do in zip(told(caught.value, folder), ("weight_mass", "lift", "", "heaviside", ""), strict=True):
        assert not do or line.endswith(f'Did you mean "{do}"?')
    assert caught.value.where.endswith("study.toml, rig.wieght_mass")
    assert [error.got for error in caught.value.further][:2] == ["unknown key", "90 without a unit"]
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)


def test_no_more_than_eight_mistakes_are_told(load: Loader, folder: Path) -> None:
    keys = "\n".join(f"nonsense_{i} = {i}" for i in range(10))
    with pytest.raises(StudyError) as caught:
        load(("[model]", f"[model]\n{keys}"))
    lines = told(caught.value, folder)
    assert [line.partition(":")[0] for line in lines[:-1]] == [f"study.toml, model.nonsense_{i}" for i in range(8)]
    assert lines[-1] == "study.toml: 2 more mistakes."


def test_what_only_values_can_show_is_told_at_once_too(load: Loader, folder: Path) -> None:
    """Parameters, units, times, effects and files: no look rests on what another one found."""
    with pytest.raises(StudyError) as caught:
        load(
            ('initial = "30 kN/m"', 'initial = "30 kN"'),
            ('bounds = ["1 kN/m", "300 kN/m"]', 'bounds = ["300 kN/m", "1 kN/m"]'),
            ("parameters.friction", "parameters.frction"),
            ('force = "kN"', 'force = "kg"\nfrce = "N"'),
            ('["guide.stribeck_friction"]', '["guide.stribeck_friction@3"]'),
            ('file = "two.csv"', 'file = "tow.csv"\nuncertainties = { added_mass = "1 g" }\nparts = ["x/3.csv", "."]'),
        )
    assert [line.partition("; expected")[0] for line in told(caught.value, folder)] == [
        'study.toml, parameters.stiffness.initial: unit "kN"',
        "study.toml, parameters.stiffness.bounds: 300000 to 1000 N/m",
        "study.toml, parameters.frction: unknown parameter",
        'study.toml, units.force: unit "kg"',
        "study.toml, units.frce: unknown channel",
        "study.toml, records[1]: the uncertainty of added_mass",
        'study.toml, model.effects: "guide.stribeck_friction@3", of record 3',
        'study.toml, records[1].file: no file "tow.csv"',
        "study.toml: 2 more mistakes.",
    ]


def test_what_a_record_lacks_keeps_no_other_mistake_from_being_told(load: Loader, folder: Path) -> None:
    with pytest.raises(StudyError) as caught:
        load(
            ('weight_mass = "3.096 kg"\n', ""),
            ('force = "Kraft"', 'force = { unit = "V" }\n[channels.position]\nunit = "V"'),
            ('position = "position [mm]"\n', ""),
            ('file = "one.csv"', 'file = "on.csv"'),
            ('file = "two.csv"', 'file = "tow.csv"'),
        )
    assert [line.partition("; expected")[0] for line in told(caught.value, folder)] == [
        "study.toml, records[0]: no weight_mass",
        'study.toml, channels.force: unit "V"',
        'study.toml, channels.position: unit "V"',
        'study.toml, records[0].file: no file "on.csv"',
        'study.toml, records[1].file: no file "tow.csv"',
    ]


def test_of_many_missing_files_those_that_are_told_have_a_suggestion(load: Loader, folder: Path) -> None:
    more = "".join(f'\n[[records]]\nfile = "one{i}.csv"\n' for i in range(10))
    with pytest.raises(StudyError) as caught:
        load(('position_zero = "-0.12 mm"\n', f'position_zero = "-0.12 mm"\n{more}'))
    lines = told(caught.value, folder)
    assert all(line.endswith('Did you mean "one.csv"?') for line in lines[:-1])
    assert (len(lines), lines[-1]) == (9, "study.toml: 2 more mistakes.")


def test_settings_of_a_model_tell_all_that_is_wrong_with_them(load: Loader, folder: Path) -> None:
    study = load(('initial = "4 N"', 'initial = "4 kg"'), ('fixed = "2.5 N"', 'fixed = "-2.5 N"'))
    declared = {
        "friction": Parameter("friction", "N", "", 1.0, lower=0.0),
        "guide.stribeck_friction.breakaway_excess": Parameter("breakaway_excess", "N", "", 1.0),
    }
    with pytest.raises(StudyError) as caught:
        study.settings(declared)
    assert [line.partition(";")[0] for line in told(caught.value, folder)] == [
        "study.toml, parameters.stiffness: unknown parameter",
        "study.toml, parameters.friction.fixed: -2.5 N",
        'study.toml, parameters.guide.stribeck_friction.breakaway_excess.initial: unit "kg"',
    ]


def test_a_list_is_not_called_too_short_for_what_is_wrong_in_it(load: Loader, folder: Path) -> None:
    with pytest.raises(StudyError) as caught:
        load(('lift = "5 mm"', 'lift = "5"'))
    assert told(caught.value, folder) == [
        'study.toml, records[1].lift: "5" has no unit; expected m, mm, um, cm, nm, in, ft or mil. '
        'Write it with its unit, such as "5 m".'
    ]


def test_a_key_that_is_missing_under_another_name_is_told_once(load: Loader, folder: Path) -> None:
    with pytest.raises(StudyError) as caught:
        load(overrides=("parameters.stiffness.prior={kind='normal', mean='1 N/m', std='1 N/m'}",))
    (line,) = told(caught.value, folder)
    assert line.endswith('unknown key; expected one of kind, mean, sd, lower, upper. Did you mean "sd"?')


@pytest.mark.parametrize("written", ["", "records = []\n"])
def test_a_study_without_records_is_told_how_to_list_one(folder: Path, written: str) -> None:
    head = f'schema = "fibrefit/study/1"\nname = "x"\n{written}'
    (folder / "study.toml").write_text(f'{head}[rig]\nkind = "fibre_mass"\n')
    with pytest.raises(StudyError) as caught:
        load_study(folder)
    assert told(caught.value, folder) == [
        'study.toml, records: no [[records]]; expected at least one. Write [[records]] and below it file = "drop.csv".'
    ]


def test_a_copy_in_the_list_is_taken_off_it(load: Loader, folder: Path) -> None:
    with pytest.raises(StudyError) as caught:
        load(('file = "two.csv"', 'file = "one.csv"'))
    assert told(caught.value, folder) == [
        'study.toml, records[1]: "one.csv" a second time; expected each record once. '
        "Take one of the two off the list: a copy is no further evidence."
    ]


@pytest.mark.parametrize(
    "record", ['file = "two.csv"\nname = "one.csv"', 'file = "one.csv"\nchannels = { force = "Kraft 2" }']
)
def test_two_records_of_one_name_are_to_be_named(load: Loader, folder: Path, record: str) -> None:
    """Of two files, or of two columns of one file."""
    with pytest.raises(StudyError) as caught:
        load(('file = "two.csv"', record))
    assert told(caught.value, folder) == [
        'study.toml, records[1]: "one.csv" a second time; expected a name for each record. Give one a name.'
    ]


@pytest.mark.parametrize(
    ("own", "says"),
    [
        ((1,), "It stands in records[1] alone. Write"),
        ((1, 2, 4), "It stands in records[1], records[2] and records[4] alone. Write"),
        ((1, 2, 3, 4), "It stands in 4 of 5 records alone. Write"),
    ],
)
def test_a_constant_that_stands_in_some_records_only_is_told_so(folder: Path, own: tuple[int, ...], says: str) -> None:
    records = "".join(
        f'[[records]]\nname = "plan {i}"\nsampling_rate = "2 kHz"\nduration = "1 s"\n'
        + ('weight_mass = "3 kg"\n' if i in own else "")
        for i in range(5)
    )
    head = 'schema = "fibrefit/study/1"\nname = "x"\n[rig]\nkind = "fibre_mass"\n'
    (folder / "study.toml").write_text(head + records)
    with pytest.raises(StudyError) as caught:
        load_study(folder)
    mass, inclination = told(caught.value, folder)
    begins, ends = "study.toml, records[0]: no weight_mass; expected it here or under [rig]. ", "rig.weight_mass"
    assert mass == f'{begins}{says} weight_mass = "3.096 kg" under [rig], or --set {ends}="3.096 kg".'
    assert inclination.startswith("study.toml, records[0]: no inclination; expected it here or under [rig]. Write")


def test_in_a_table_such_records_are_numbered_as_its_rows(folder: Path) -> None:
    (folder / "series.csv").write_text("file,weight_mass [kg]\none.csv,\ntwo.csv,3\n")
    (folder / "study.toml").write_text(
        'schema = "fibrefit/study/1"\nname = "x"\nrecords = "series.csv"\n[rig]\nkind = "fibre_mass"\n'
        'inclination = "90 deg"\n'
    )
    with pytest.raises(StudyError) as caught:
        load_study(folder)
    assert told(caught.value, folder) == [
        "series.csv, record 1: no weight_mass; expected it here or under [rig]. It stands in record 2 alone. "
        'Write weight_mass = "3.096 kg" under [rig], or --set rig.weight_mass="3.096 kg".'
    ]
