"""A study file becomes a study in SI, or a message that says what to change."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from fibrefit.core.declarations import Parameter
from fibrefit.core.errors import StudyError
from fibrefit.study import load_study, study_from_files
from fibrefit.study.parameters import with_initial
from tests.study.conftest import Loader

DECLARED = {
    name: Parameter(name, unit, "", 1.0)
    for name, unit in {
        "stiffness": "N/m",
        "damping": "N s/m",
        "friction": "N",
        "guide.stribeck_friction.breakaway_excess": "N",
        "guide.load_dependent_friction.load_coefficient": "-",
    }.items()
}


def test_quantities_are_in_si(load: Loader) -> None:
    study = load()
    assert study.kind == "fibre_mass"
    assert study.records[0].weight_mass == 3.096
    assert study.records[0].fibre_length == 0.599
    assert study.records[0].release == 0.1432
    assert study.records[1].position_zero == -0.12e-3
    assert study.noise.position == 0.02e-3


def test_a_record_overrides_the_rig(load: Loader) -> None:
    one, two = load().records
    assert one.inclination == pytest.approx(math.pi / 2, rel=1e-15)
    assert two.inclination == pytest.approx(math.pi / 4, rel=1e-15)
    assert one.label == "one.csv"


def test_a_value_that_was_found_is_a_start_within_all_limits(load: Loader) -> None:
    setting = load().settings(DECLARED)["stiffness"]
    for value, lower, start in ((301e3, 0.0, 300e3), (0.5e3, 0.0, 1e3), (0.5e3, 2e3, 2e3), (5e3, 2e3, 5e3)):
        declared = Parameter("stiffness", "N/m", "", 1.0, lower=lower)
        table = with_initial(load().parameters["stiffness"], value, setting, declared)
        assert table.initial == f"{start} N/m"
        assert table.bounds is not None


def test_settings_follow_the_declared_parameters(load: Loader) -> None:
    settings = load().settings(DECLARED)
    assert list(settings) == list(DECLARED)
    stiffness = settings["stiffness"]
    assert (stiffness.initial, stiffness.lower, stiffness.upper, stiffness.fixed) == (30e3, 1e3, 300e3, False)
    assert (settings["friction"].initial, settings["friction"].fixed) == (2.5, True)
    assert settings["damping"].initial is None
    assert settings["guide.stribeck_friction.breakaway_excess"].initial == 4.0


def test_a_quoted_dotted_name_is_the_same_as_nested_tables(load: Loader) -> None:
    nested = "[parameters.guide.stribeck_friction.breakaway_excess]"
    quoted = '[parameters."guide.stribeck_friction.breakaway_excess"]'
    assert load((nested, quoted)) == load()


def test_a_pure_number_needs_no_unit(load: Loader) -> None:
    name = "guide.load_dependent_friction.load_coefficient"
    study = load(overrides=(f"parameters.{name}.initial=0.05",))
    assert study.settings(DECLARED)[name].initial == 0.05


PRIORS = {
    "{kind='normal', mean='30 kN/m', sd='2 kN/m'}": ("normal", 30e3, 2e3, -math.inf, math.inf),
    "{kind='normal', mean='30 kN/m', sd='2 kN/m', lower='0 N/m'}": ("normal", 30e3, 2e3, 0.0, math.inf),
    "{kind='half_normal', sd='2 kN/m'}": ("half_normal", 0.0, 2e3, 0.0, math.inf),
    "{kind='log_normal', median='30 kN/m', log_sd=0.3}": ("log_normal", 30e3, 0.3, 0.0, math.inf),
    "{kind='uniform', lower='1 kN/m', upper='2 kN/m'}": ("uniform", math.nan, math.nan, 1e3, 2e3),
    "{kind='log_uniform', lower='1 kN/m', upper='2 kN/m'}": ("log_uniform", math.nan, math.nan, 1e3, 2e3),
}


@pytest.mark.parametrize(("text", "expected"), PRIORS.items())
def test_priors_are_in_si(load: Loader, text: str, expected: tuple[object, ...]) -> None:
    prior = load(overrides=(f"parameters.stiffness.prior={text}",)).settings(DECLARED)["stiffness"].prior
    assert prior is not None
    found = (prior.kind, prior.centre, prior.spread, prior.lower, prior.upper)
    assert found == pytest.approx(expected, nan_ok=True)


def test_only_what_a_rig_needs_must_be_said(folder: Path) -> None:
    (folder / "study.toml").write_text(
        'schema = "fibrefit/study/1"\nname = "x"\n[rig]\nkind = "fibre_mass"\nweight_mass = "3 kg"\n'
        'inclination = "1 rad"\n[[records]]\nfile = "one.csv"\n'
    )
    study = load_study(folder)
    assert study.records[0].lift is None
    assert study.channels.force is None
    assert study.model.tension_law == "clamped"


def test_a_byte_order_mark_and_windows_lines_do_no_harm(load: Loader, folder: Path) -> None:
    expected = load()
    path = folder / "study.toml"
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert load_study(path) == expected


def test_every_file_the_study_rests_on(load: Loader, folder: Path) -> None:
    study = load(('["guide.stribeck_friction"]', '["mine.py:Rubber"]'))
    assert study.input_files() == [folder / name for name in ("study.toml", "one.csv", "two.csv", "mine.py")]


def test_a_planned_record_needs_no_file(load: Loader) -> None:
    study = load(('file = "one.csv"', 'name = "plan"\nsampling_rate = "2 kHz"\nduration = "4 s"'))
    assert (study.records[0].label, study.records[0].sampling_rate, study.records[0].duration) == ("plan", 2000.0, 4.0)


# What is changed in the study, and what the message must say.
REFUSED = {
    "bare number": (('"3.096 kg"', "3.096"), "rig.weight_mass: 3.096 without a unit", 'such as "3.096 kg"'),
    "number as text": (('"3.096 kg"', '"3.096"'), 'rig.weight_mass: "3.096" has no unit', "kg"),
    "wrong kind": (('"3.096 kg"', '"3.096 N"'), "rig.weight_mass", 'unit "N"'),
    "unknown unit": (('"3.096 kg"', '"3.096 kp"'), "rig.weight_mass", "kp"),
    "decimal comma": (('"3.096 kg"', '"3,096 kg"'), "rig.weight_mass", "decimal comma"),
    "not a mass": (('"3.096 kg"', '"0 kg"'), '"0 kg" is out of range', "above 0 kg"),
    "infinite": (('"3.096 kg"', '"1e999 kg"'), "rig.weight_mass", "not finite"),
    "boolean": (('"3.096 kg"', "true"), "rig.weight_mass: True", "such as"),
    "list": (('"3.096 kg"', '["3 kg"]'), "rig.weight_mass", "is not a quantity"),
    "date": (('"3.096 kg"', "2026-01-01"), "rig.weight_mass", "is not a quantity"),
    "level guide": (('"90 deg"', '"0 deg"'), "rig.inclination", "between 0 and 3.14159 rad"),
    "angle": (('"90 deg"', '"4000 deg"'), "rig.inclination", "out of range"),
    "misspelt key": (("weight_mass =", "wieght_mass ="), "rig.wieght_mass: unknown key", 'mean "weight_mass"?'),
    "key of another rig": (("fibre_mass = ", "wrap_angle = "), "rig.wrap_angle: unknown key", "one of weight_mass"),
    "misspelt kind": (('"fibre_mass"', '"fiber_mass"'), 'rig.kind: "fiber_mass"', 'mean "fibre_mass"?'),
    "misspelt rig": (("[rig]", "[rigg]"), "study.toml, rigg: unknown key", 'mean "rig"?'),
    "capitals": (("[rig]", "[RIG]"), "study.toml, RIG: unknown key", 'mean "rig"?'),
    "rig of another name": (("[rig]", "[apparatus]"), "study.toml: no table [rig]", '"pulley_drive"'),
    "several rigs": (("[rig]", "[[rig]]"), "rig: a list", "[rig] with kind"),
    "misspelt kind of key": (("kind =", "knd ="), "rig: no kind of rig", 'mean kind in place of "knd"?'),
    "kind by another name": (("kind =", "type ="), "rig: no kind of rig", 'mean kind in place of "type"?'),
    "effects at the top": (("[rig]", "effects = []\n[rig]"), "effects: unknown key", "stands under [model]"),
    "parameter of a rig": (("[rig]", '[rig]\nstiffness = "1 N/m"'), "rig.stiffness", "Write [parameters.stiffness]"),
    "condition of a rig": (("[rig]", '[rig]\nlift = "1 mm"'), "rig.lift: unknown key", "under [limits] or [[records]]"),
    "rig of another record": (('file = "two', 'rod_mass = "1 kg"\nfile = "two'), "rod_mass", "of inverted_pendulum."),
    "points of one record": (
        ('file = "two', 'masses_per_fibre = 3\nfile = "two'),
        "records[1].masses_per_fibre: unknown key",
        "stands under [rig]",
    ),
    "column of a channel": (('"Kraft"', '{colum = "Kraft"}'), "channels.force.colum: unknown key", 'mean "column"?'),
    "no kind": (('kind = "fibre_mass"\n', ""), "rig: no kind of rig", '"pulley_drive"'),
    "no mass": (('weight_mass = "3.096 kg"\n', ""), "records[0]: no weight_mass", "under [rig]"),
    "schema": (("study/1", "study/9"), 'schema: "fibrefit/study/9"', "fibrefit/study/1"),
    "no schema": (('schema = "fibrefit/study/1"\n', ""), 'no "schema"', ""),
    "name with NUL": (('"two drops"', '"two\\u0000drops"'), "study.toml, name", "text without a NUL"),
    "record with NUL": (('file = "two', 'name = "a\\u0000b"\nfile = "two'), "records[1].name", "text without a NUL"),
    "record without a name": (('file = "two', 'name = ""\nfile = "two'), 'records[1].name: ""', "some text"),
    "file without a name": (('"two.csv"', '""'), 'records[1].file: ""', "some text"),
    "heading without a name": (('"Kraft"', '""'), 'channels.force: ""', "some text"),
    "empty name": (('"two drops"', '""'), 'name: ""', "some text"),
    "law": (('"heaviside"', '"heavyside"'), 'model.tension_law: "heavyside"', 'mean "heaviside"?'),
    "effects": (('["guide.stribeck_friction"]', '"guide"'), 'model.effects: "guide"', "a list"),
    "swapped": (('["1 kN/m", "300 kN/m"]', '["300 kN/m", "1 kN/m"]'), "stiffness.bounds: 300000 to 1000", "Swap"),
    "equal": (('"300 kN/m"]', '"1 kN/m"]'), "stiffness.bounds", "below the upper"),
    "one bound": (
        (', "300 kN/m"]', "]"),
        "parameters.stiffness.bounds",
        "expected two values, the lower and the upper one",
    ),
    "three bounds": ((', "300 kN/m"]', ', "2 kN/m", "3 kN/m"]'), "stiffness.bounds", "expected two values"),
    "number for a prior": (('initial = "30 kN/m"', "prior = 5"), "stiffness.prior: 5", "a table with its kind"),
    "number for a channel": (('force = "Kraft"', "force = 5"), "channels.force: 5", "the heading of a column, or a"),
    "channel of another rig": (
        ('file = "two', 'channels = {force_1 = "F"}\nfile = "two'),
        "records[1].channels.force_1: unknown key",
        'Did you mean "force"?',
    ),
    "digest of no law": (
        ('effects = ["guide.stribeck_friction"]', 'effects = []\nlaws = {"mine.py" = "00"}'),
        "model.laws.mine.py: no such file; expected that of an effect",
        "remove the line",
    ),
    "duration of a file": (
        ('file = "two', 'duration = "1 s"\nfile = "two'),
        "a file and a duration",
        "Leave duration out",
    ),
    "parts of no file": (
        ('file = "two.csv"\n', 'name = "a"\nsampling_rate = "1 kHz"\nduration = "1 s"\nparts = ["two.csv"]\n'),
        "parts without a file",
        "State file too.",
    ),
    "start outside": (('"30 kN/m"', '"0.5 kN/m"'), "initial 500 N/m lies outside", "1000 to 300000 N/m"),
    "parameter": (("parameters.stiffness", "parameters.stifness"), "parameters.stifness: unknown", 'mean "stiffness"?'),
    "setting": (('initial = "30', 'intial = "30'), "stiffness.intial: unknown key", 'mean "initial"?'),
    "unit of parameter": (('"30 kN/m"', '"30 kN"'), "parameters.stiffness.initial", "N/m"),
    "bare parameter": (('"30 kN/m"', "30"), "parameters.stiffness.initial: 30.0 without a unit", "text with its unit"),
    "no record": (('file = "two.csv"', 'file = "tow.csv"'), 'records[1].file: no file "tow.csv"', '"two.csv"?'),
    "folder": (('file = "two.csv"', 'file = "."'), 'records[1].file: "." is a folder', ""),
    "twice": (('file = "two.csv"', 'file = "one.csv"'), 'records[1]: "one.csv" a second time', "Take one of the two"),
    "no file": (('file = "two.csv"\n', ""), "records[1]: no file", "planned"),
    "noise": (('force = "0.4 N"', 'froce = "0.4 N"'), "noise.froce: unknown key", 'mean "force"?'),
    "unit of channel": (('force = "kN"', 'force = "kg"'), 'units.force: unit "kg"', "N"),
    "unit without channel": (('force = "kN"', 'frce = "kN"'), "units.frce: unknown channel", 'mean "force"?'),
    "syntax": (('"two drops"', "two drops"), "line 2, column", "not TOML"),
    "open": (('name = "two drops"', 'name = "two drops'), "line 2", "not TOML"),
    "digits": (('"0.4 N"', "4" * 5000), "study.toml: a number of thousands of digits; expected numbers a person", ""),
    "key twice": (('lift = "10 mm"', 'lift = "10 mm"\nlift = "11 mm"'), "line 40", "given twice"),
    "fixed without value": (('fixed = "2.5 N"', "fixed = true"), "friction.fixed: true, but no initial", "Give it"),
    "fixed twice": (('fixed = "2.5 N"', 'fixed = "2.5 N"\ninitial = "3 N"'), "initial and fixed differ", "Remove"),
    "records": (("[[records]]\nfile = \"one.csv\"", "[records]\nfile = \"one.csv\""), "study.toml", ""),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_mistakes_are_explained(load: Loader, case: str) -> None:
    change, place, remedy = REFUSED[case]
    with pytest.raises(StudyError) as caught:
        load(change)
    assert "study.toml" in str(caught.value)
    assert place in str(caught.value)
    assert remedy in str(caught.value)


def test_one_record_in_a_plain_table_is_told(load: Loader, folder: Path) -> None:
    load()
    head, first, _ = (folder / "study.toml").read_text("utf-8").split("[[records]]")
    (folder / "study.toml").write_text(f"{head}[records]{first}", "utf-8")
    with pytest.raises(StudyError, match=r"records: one table; expected a list. Write \[\[records\]\]"):
        load_study(folder)


def test_a_missing_study_suggests_its_neighbour(load: Loader, folder: Path) -> None:
    load()
    with pytest.raises(StudyError, match=r'stduy.toml: no such file.*Did you mean "study.toml"'):
        load_study(folder / "stduy.toml")


def test_a_study_that_is_not_utf8_names_the_line(load: Loader, folder: Path) -> None:
    load()
    path = folder / "study.toml"
    path.write_bytes(path.read_bytes().replace(b"two drops", b"Stei\xdfe"))
    with pytest.raises(StudyError, match="line 2: not UTF-8"):
        load_study(path)


def test_parameters_the_model_does_not_have(load: Loader) -> None:
    study = load()
    declared = {name: DECLARED[name] for name in ("stiffness", "damping", "friction")}
    with pytest.raises(StudyError, match="breakaway_excess: unknown parameter"):
        study.settings(declared)


@pytest.mark.parametrize(
    ("prior", "says"),
    [
        ("{kind='nomal', mean='1 N/m', sd='1 N/m'}", 'mean "normal"'),
        ("{kind='normal', mean='1 N/m'}", 'no "sd"'),
        ("{kind='normal', mean='1 N/m', sd='0 N/m'}", "above 0 N/m"),
        ("{kind='uniform', lower='2 N/m', upper='1 N/m'}", "Swap"),
        ("{kind='log_uniform', lower='0 N/m', upper='1 N/m'}", "logarithm"),
        ("{kind='log_normal', median='1 N/m', log_sd=-1}", "greater than 0"),
        ("{mean='1 N/m'}", 'no "kind"'),
        ("{knd='normal', mean='1 N/m', sd='1 N/m'}", 'Did you mean kind in place of "knd"'),
        ("{kind='normal', mean='1 N/m', std='1 N/m'}", r'unknown key.*Did you mean "sd"'),
    ],
)
def test_priors_that_make_no_sense(load: Loader, prior: str, says: str) -> None:
    with pytest.raises(StudyError, match=says):
        load(overrides=(f"parameters.stiffness.prior={prior}",))


def test_a_study_of_bare_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    given = ["rig.weight_mass=3.1 kg", "rig.inclination=90 deg", "records[1].lift=5 mm"]
    study = study_from_files(["one.csv", folder / "two.csv"], "fibre_mass", given)
    assert study.name == "one and 1 more"
    assert [record.lift for record in study.records] == [None, 0.005]
    assert study.input_files() == [Path("one.csv"), folder / "two.csv"]
    assert [record.label for record in study.records] == ["one.csv", "two.csv"]


def test_a_study_of_bare_files_says_which_option_is_missing(folder: Path) -> None:
    with pytest.raises(StudyError, match=r'no weight_mass.*--set rig.weight_mass="3.096 kg"'):
        study_from_files([folder / "one.csv"], "fibre_mass")
    with pytest.raises(StudyError, match='Did you mean "fibre_mass"'):
        study_from_files([folder / "one.csv"], "fibremass")


def test_an_asymmetric_drive_rig_needs_both_distances(folder: Path) -> None:
    given = ["rig.weight_mass=3 kg", "rig.inclination=30 deg", "rig.lateral_offset=280 mm"]
    with pytest.raises(StudyError, match="lateral_offset or guide_distance alone"):
        study_from_files([folder / "one.csv"], "pulley_drive", given)


PENDULUM = (
    'schema = "fibrefit/study/1"\nname = "sweep"\n[rig]\nkind = "inverted_pendulum"\nrod_length = "1 m"\n'
    'rod_mass = "9.864 kg"\nmoment_of_inertia = "3.288 kg m^2"\nattachment_height = "0.75 m"\n'
    'anchor_distance = "1.2 m"\n'
)


def test_a_pendulum_needs_no_records(folder: Path) -> None:
    (folder / "study.toml").write_text(PENDULUM)
    assert load_study(folder).records == ()


FREE = ('initial = "30 kN/m"\nbounds = ["1 kN/m", "300 kN/m"]\n', "")
RANGED = DECLARED | {"stiffness": Parameter("stiffness", "N/m", "", 1e4, lower=10.0, upper=1e7, log=True)}
IMPOSSIBLE = {
    "a start of no stiffness": ("initial='-3 N/m'", "stiffness.initial=.*: -3 N/m; expected 10 to 1e\\+07 N/m"),
    "a start beyond all": ("initial='1e9 N/m'", "1e\\+09 N/m; expected 10 to 1e\\+07 N/m, in which stiffness can be"),
    "held where it cannot be": ("fixed='-11 kN/m'", "fixed.*: -11000 N/m; expected 10"),
    "limits outside": ("bounds=['-5 N/m', '-1 N/m']", "-5 to -1 N/m; expected a part of 10 to 1e\\+07"),
    "limits that reach below": (
        "bounds=['0 N/m', '20 N/m']",
        r"bounds.*: 0 N/m; expected a part of 10 to .* Write 10 N/m",
    ),
    "limits that reach above": ("bounds=['1 kN/m', '2e7 N/m']", r"bounds.*: 2e\+07 N/m; expected a part of 10"),
    "an even prior outside": (
        "prior={kind='uniform', lower='-2 N/m', upper='-1 N/m'}",
        "-2 to -1 N/m at the utmost; expected a part of 10",
    ),
    "a normal prior outside": ("prior={kind='normal', mean='-1e9 N/m', sd='1 N/m'}", "expected a part of 10 to"),
    "a half of a prior outside": ("prior={kind='half_normal', sd='0.5 N/m'}", "0 to 5 N/m at the utmost"),
    "a prior of no width": ("prior={kind='normal', mean='1 kN/m', sd='1e-300 N/m'}", "1e-300 N/m; expected at least"),
    "a prior of no relative width": ("prior={kind='log_normal', median='1 kN/m', log_sd=1e-300}", "1e-300 -; expected"),
}


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_what_leaves_a_parameter_no_value_is_refused(load: Loader, case: str) -> None:
    """And not moved to the nearest limit without a word."""
    written, says = IMPOSSIBLE[case]
    with pytest.raises(StudyError, match=says):
        load(FREE, overrides=(f"parameters.stiffness.{written}",)).settings(RANGED)


@pytest.mark.parametrize("written", ["initial='10 N/m'", "fixed='1e7 N/m'", "bounds=['10 N/m', '10 kN/mm']"])
def test_what_touches_the_range_is_not(load: Loader, written: str) -> None:
    study = load(FREE, overrides=(f"parameters.stiffness.{written}",))
    assert study.settings(RANGED)["stiffness"].lower in (None, 10.0)


def test_the_day_of_a_test_is_text_or_a_date(load: Loader) -> None:
    study = load(
        ('file = "one.csv"', 'file = "one.csv"\ntaken = "2026-03-14 09:30"'),
        ('file = "two.csv"', 'file = "two.csv"\ntaken = 2026-03-15'),
    )
    one, two = study.records
    assert (two.taken - one.taken).total_seconds() == 14.5 * 3600.0
    assert 'taken = "2026-03-14T09:30:00"' in study.resolved_toml()


def test_a_day_that_is_none_is_refused(load: Loader) -> None:
    with pytest.raises(
        StudyError, match=r'"14/3/2026"; expected a day, or a day and a time, such as "2026-03-14 09:30"'
    ):
        load(('file = "one.csv"', 'file = "one.csv"\ntaken = "14/3/2026"'))


def test_times_of_two_kinds_are_refused(load: Loader) -> None:
    with pytest.raises(StudyError, match=r"records\[1\].taken: a time with an offset from UTC"):
        load(
            ('file = "one.csv"', 'file = "one.csv"\ntaken = "2026-03-14 09:30"'),
            ('file = "two.csv"', 'file = "two.csv"\ntaken = 2026-03-15T10:00:00Z'),
        )


@pytest.mark.parametrize(
    "name", ["fibre.knot_slip@3", "fibre.knot_slip@1-3", "guide.friction_change@3", "study.other_fibre@1+3"]
)
def test_effects_of_a_record_that_is_not_there_are_refused(load: Loader, name: str) -> None:
    said = rf'model.effects: "{re.escape(name)}", of record 3; expected one of its 2 records'
    with pytest.raises(StudyError, match=said):
        load(('["guide.stribeck_friction"]', f'["guide.stribeck_friction", "{name}"]'))


@pytest.mark.parametrize("name", ["fibre.knot_slip@2", "fibre.knot_slip@1-2", "study.other_fibre@1+2"])
def test_those_of_one_that_is_are_not(load: Loader, name: str) -> None:
    assert load(('["guide.stribeck_friction"]', f'["{name}"]')).model.effects == (name,)


@pytest.mark.parametrize(("step", "fits"), [("0.5 Hz", False), ("0.2 Hz", True)])
def test_a_step_beyond_the_range_of_a_sweep_is_refused(folder: Path, step: str, fits: bool) -> None:
    swept = f'[sweep]\nlowest = "0.1 Hz"\nhighest = "0.3 Hz"\nstep = "{step}"\n[[sweep.curves]]\nname = "a"\n'
    (folder / "study.toml").write_text(PENDULUM + swept)
    if fits:
        load_study(folder)
        return
    with pytest.raises(StudyError, match=r"step 0\.5 Hz.*at most 0\.2 Hz"):
        load_study(folder)


def test_a_sweep_that_takes_all_memory_is_refused(folder: Path) -> None:
    (folder / "study.toml").write_text(PENDULUM + '[sweep]\nlowest = "0.001 Hz"\n')
    with pytest.raises(StudyError, match=r"2.41e\+08 steps of a period at 0.001 Hz, in all runs of a curve"):
        load_study(folder)


#: A line without quotes, and how it is written.
WITHOUT_QUOTES = {
    "weight_mass = 2350 g": 'weight_mass = "2350 g"',
    "fibre_length = 0.599m # of the rope": 'fibre_length = "0.599m"',
    "fibre_length = 599,5 mm": 'fibre_length = "599.5 mm"',
    "rig.inclination = 90 deg": 'rig.inclination = "90 deg"',
    "kind = fibre_mass": 'kind = "fibre_mass"',
    "force = F [N]": 'force = "F [N]"',
    "bounds = [1 kN/m, 300 kN/m]": 'bounds = ["1 kN/m", "300 kN/m"]',
}


@pytest.mark.parametrize("line", WITHOUT_QUOTES)
@pytest.mark.parametrize("end", ["", "\n", '\nname = "two"\n'])
def test_what_lacks_its_quotes_is_shown_with_them(line: str, end: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f'schema = "fibrefit/study/1"\n{line}{end}', encoding="utf-8")
    with pytest.raises(StudyError, match="line 2") as refused:
        load_study(path)
    assert refused.value.do == f"Write it in quotes: {WITHOUT_QUOTES[line]}"


@pytest.mark.parametrize(
    "line", ["initial = 3..5", "a = [1, 2", 'name = "two', "= 3 kg", "fixed = true false = 3", "[rig"]
)
def test_nothing_is_advised_where_it_is_not_plain_what_is_meant(line: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f'schema = "fibrefit/study/1"\n{line}\n', encoding="utf-8")
    with pytest.raises(StudyError) as refused:
        load_study(path)
    assert "in quotes:" not in refused.value.do


@pytest.mark.parametrize("second", ["[records]", "[[records]]", " [records]  # the second"])
def test_records_in_single_brackets_are_told_the_double_ones(second: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f'[records]\nfile = "one.csv"\n{second}\nfile = "two.csv"\n', encoding="utf-8")
    with pytest.raises(StudyError, match=r"Write \[\[records\]\], in double brackets, above each record"):
        load_study(path)


@pytest.mark.parametrize("key", ['mass = "0.2 kg"', 'centre_distance = "0.3 m"'])
def test_of_a_pendulum_mass_and_distance_go_together(tmp_path: Path, key: str) -> None:
    """One alone would be left out, and values would be those of another inertia."""
    (tmp_path / "a.csv").write_text("time [s],angle [rad]\n0,1\n")
    text = (
        f'schema = "fibrefit/study/1"\nname = "swing"\n[rig]\nkind = "pendulum"\n{key}\n[[records]]\nfile = "a.csv"\n'
    )
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(StudyError, match="mass or centre_distance alone; expected both or neither"):
        load_study(tmp_path)
