"""``--set`` changes what the file says, and nothing else."""

from __future__ import annotations

from typing import Any

import pytest

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.study.overrides import parse
from tests.study.conftest import Loader


@pytest.mark.parametrize(
    ("override", "keys", "value"),
    [
        ("name=three", ["name"], "three"),
        ("rig.weight_mass=3 kg", ["rig", "weight_mass"], "3 kg"),
        ('rig.weight_mass="3 kg"', ["rig", "weight_mass"], "3 kg"),
        ("records[1].lift=5 mm", ["records", 1, "lift"], "5 mm"),
        ('model.effects=["a", "b"]', ["model", "effects"], ["a", "b"]),
        ("parameters.stiffness.shared=false", ["parameters", "stiffness", "shared"], False),
        ("parameters.a.b.c.initial=0.1", ["parameters", "a.b.c", "initial"], 0.1),
        ('parameters."a.b.c".initial=1', ["parameters", "a.b.c", "initial"], 1),
        ("parameters.a.b.prior.kind=normal", ["parameters", "a.b", "prior", "kind"], "normal"),
        ('parameters.a.b={prior = {kind = "normal"}}', ["parameters", "a.b"], {"prior": {"kind": "normal"}}),
        ('parameters.a.b.prior={kind = "normal"}', ["parameters", "a.b", "prior"], {"kind": "normal"}),
        ("channels.force=F = m a", ["channels", "force"], "F = m a"),
        ("name=1\nrig = 2", ["name"], "1\nrig = 2"),
    ],
)
def test_keys_and_values(override: str, keys: list[str | int], value: Any) -> None:
    assert parse(override) == (keys, value)


@pytest.mark.parametrize("override", ["rig.weight_mass", "=3", "a..b=1", "a[x]=1", ".a=1", "a.=1", "[0=1"])
def test_what_is_no_override(override: str) -> None:
    with pytest.raises(UsageError, match="expected key=value"):
        parse(override)


def test_a_constant_of_the_rig_that_no_record_takes_is_refused(load: Loader) -> None:
    """Each record has its own: the run would be that of the old value, and nothing would say so."""
    own = (
        ('lift = "10 mm"', 'lift = "10 mm"\nweight_mass = "3.1 kg"'),
        ('lift = "5 mm"', 'lift = "5 mm"\nweight_mass = "3.2 kg"'),
    )
    with pytest.raises(StudyError) as refused:
        load(*own, overrides=("rig.weight_mass=3.3 kg",))
    said = "--set rig.weight_mass=3.3 kg: set for the rig, and each record states its own weight_mass; expected"
    assert said in str(refused.value)
    assert "records[0].weight_mass=..." in str(refused.value)
    # Where a record takes it, it is what the others do not say.
    some = load(own[0], overrides=("rig.weight_mass=3.3 kg",))
    assert [record.weight_mass for record in some.records] == [3.1, 3.3]
    inclined = load(overrides=("rig.inclination=80 deg",))
    assert inclined.records[0].inclination != inclined.records[1].inclination


def test_a_channel_that_is_a_heading_alone_is_given_more(load: Loader) -> None:
    found = load(overrides=("channels.force.zero=3",))
    assert (found.channels.force.column, found.channels.force.zero) == ("Kraft", 3.0)


def test_a_value_is_changed_and_the_rest_stays(load: Loader) -> None:
    before, after = load(), load(overrides=("records[1].lift=7 mm",))
    assert after.records[1].lift == 0.007
    assert after.records[0] == before.records[0]
    assert after.rig == before.rig


def test_a_later_override_wins(load: Loader) -> None:
    assert load(overrides=("rig.weight_mass=1 kg", "rig.weight_mass=2 kg")).records[0].weight_mass == 2.0


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("rig.wieght_mass=3 kg", "--set rig.wieght_mass=3 kg: unknown key"),
        ("rgi.weight_mass=3 kg", 'Did you mean "rig"'),
        ("rig.weight_mass=3", "--set rig.weight_mass=3: 3 without a unit"),
        ("records[2].lift=3 mm", r"no records\[2\]; expected an index below 2"),
        ("records.lift=3 mm", "records is not a table"),
        ("rig[0]=3 mm", "rig is not a list"),
        ("name.first=a", "name is not a table"),
        ("parameters.stiffness.bounds=['2 N/m', '1 N/m']", "--set parameters.stiffness.bounds"),
        ("records[0].file=none.csv", r"--set records\[0\].file=none.csv: no file"),
        ("name=2024", "name=2024: 2024; expected text"),
    ],
)
def test_an_override_that_is_wrong_is_named(load: Loader, override: str, says: str) -> None:
    with pytest.raises(StudyError, match=says):
        load(overrides=(override,))
