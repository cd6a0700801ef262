"""Which effects are tried, and what is said of those that cannot be."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.core.errors import FibrefitError, StudyError, UsageError
from fibrefit.laws.catalogue import CATALOGUE, is_sought, select_effects, suits
from fibrefit.laws.families import members
from fibrefit.laws.fibre.point_masses import point_masses
from fibrefit.rigs.catalogue import RIGS
from fibrefit.study import Study, load_study
from fibrefit.workflow.discovery.candidates import candidates_of
from tests.discovery.conftest import DATA

OWN = '''
from typing import ClassVar

from fibrefit.core.declarations import Capability
from fibrefit.laws.families import members
from fibrefit.laws.law import GuideLaw, quantity


class Rub(GuideLaw):
    """A law of one's own."""

    name: ClassVar[str] = "guide.rub"
    rub: float = quantity("N", "how much", 1.0)


class Elsewhere(Rub):
    """A law for another rig."""

    name: ClassVar[str] = "guide.elsewhere"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.PULLEY})
    more: float = quantity("N", "how much more", 1.0)


class Since(Rub):
    """A law that holds from one record on."""

    name: ClassVar[str] = "guide.since"
    family: ClassVar[str] = "since"
'''


@pytest.fixture
def own(tmp_path: Path) -> Study:
    """A study with a file of effects beside it."""
    (tmp_path / "mine.py").write_text(OWN)
    for path in (DATA / "viscous").glob("*.csv"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "study.toml").write_bytes((DATA / "viscous" / "study.toml").read_bytes())
    return load_study(tmp_path)


def test_the_whole_catalogue_as_far_as_it_suits_the_rig(study: Study) -> None:
    tried, records = candidates_of(study), len(study.records)
    sought = [effect for effect in CATALOGUE.values() if is_sought(effect, RIGS[study.kind])]
    assert set(tried) == {member.name for effect in sought for member in members(effect, records)}
    alone = {effect.name for effect in sought if not effect.family and effect.name != "fibre.mass"}
    assert all(tried[name] is CATALOGUE[name] for name in alone)


@pytest.mark.parametrize(("overrides", "points"), [((), 5), (("rig.masses_per_fibre=3",), 3)])
def test_a_fibre_has_as_many_points_as_the_study_says(overrides: tuple[str, ...], points: int) -> None:
    tried = candidates_of(load_study(DATA / "viscous", overrides), only=("fibre.mass",))
    assert tried == {"fibre.mass": point_masses(points)}


def test_what_the_model_has_already_is_not_tried() -> None:
    study = load_study(DATA / "viscous", ['model.effects=["guide.viscous_friction"]'])
    tried = candidates_of(study)
    assert "guide.viscous_friction" not in tried
    assert "guide.asymmetric_viscous_friction" in tried


def test_only_these_in_their_order(study: Study) -> None:
    names = ("sensor.force_lag", "guide.viscous_friction")
    assert tuple(candidates_of(study, only=names)) == names


def test_patterns(study: Study) -> None:
    tried = candidates_of(study, only=("sensor.force_*", "fibre.hardening"), exclude=("*_drift",))
    assert {name.partition(".")[0] for name in tried} == {"sensor", "fibre"}
    assert "sensor.force_delay" in tried
    assert "sensor.force_drift" not in tried


def test_an_effect_of_ones_own_alone_or_beside_the_catalogue(own: Study) -> None:
    assert list(candidates_of(own, only=("mine.py:Rub",))) == ["mine.py:Rub"]
    beside = candidates_of(own, also=("mine.py:Rub",))
    assert beside["mine.py:Rub"].name == "guide.rub"
    assert len(beside) == len(candidates_of(own)) + 1
    assert list(candidates_of(own, only=("mine.py:*",), also=("mine.py:Rub",))) == ["mine.py:Rub"]
    # What is offered by name is tried beside what a pattern leaves.
    assert "mine.py:Rub" in candidates_of(own, only=("guide.*",), also=("mine.py:Rub",))


def test_the_name_of_effects_of_single_records_stands_for_that_of_each(study: Study) -> None:
    records = len(study.records)
    changes = [f"guide.friction_change@{place}" for place in range(2, records + 1)]
    assert list(candidates_of(study, only=("guide.friction_change",))) == changes
    assert list(candidates_of(study, only=("guide.friction_change@2",))) == changes[:1]
    rest = candidates_of(study, exclude=("guide.friction_change", "fibre.knot_slip"))
    assert not any(name.startswith(("guide.friction_change", "fibre.knot_slip")) for name in rest)
    assert "fibre.stiffness_change@2" in rest


def test_a_law_of_ones_own_may_belong_to_single_records(own: Study) -> None:
    names = [f"mine.py:Since@{place}" for place in range(2, len(own.records) + 1)]
    tried = candidates_of(own, only=("mine.py:Since",))
    assert list(tried) == names
    assert [effect.records for effect in tried.values()] == [(place,) for place in range(2, len(own.records) + 1)]
    assert set(names) < set(candidates_of(own, also=("mine.py:Since",)))
    (second,) = select_effects(names[:1], RIGS[own.kind], own.source.parent)
    assert (second.name, second) == ("guide.since@2", tried[names[0]])


@pytest.mark.parametrize("name", ["guide.friction_change", "fibre.knot_slip", "mine.py:Since"])
def test_a_model_names_the_record_of_an_effect_of_single_ones(own: Study, name: str) -> None:
    with pytest.raises(StudyError, match='belongs to single records, and names none; expected "(guide|fibre).*@3"'):
        select_effects([name], RIGS[own.kind], own.source.parent)


def test_in_a_single_record_nothing_changes_from_one_to_the_next() -> None:
    study = load_study(DATA / "viscous")
    alone = study.model_copy(update={"records": study.records[:1]})
    with pytest.raises(UsageError, match="belongs to single records of a series; expected two records or more"):
        candidates_of(alone, only=("guide.friction_change",))


def test_what_needs_another_is_not_tried_without_it(study: Study) -> None:
    tried = candidates_of(study, exclude=("guide.viscous_friction",))
    assert "guide.asymmetric_viscous_friction" not in tried


def test_leaving_out_what_does_not_suit_the_rig_does_no_harm(study: Study) -> None:
    elsewhere = {name for name, effect in CATALOGUE.items() if not suits(effect, RIGS[study.kind])}
    assert candidates_of(study, exclude=tuple(elsewhere)) == candidates_of(study)


@pytest.mark.parametrize(
    ("asked", "kind", "says"),
    [
        (
            {"only": ("guide.viscos_friction",)},
            UsageError,
            'only "guide.viscos_friction": not in the catalogue; expected a name from it, or "my_effects.py:MyEffect". '
            'Did you mean "guide.viscous_friction"?',
        ),
        (
            {"exclude": ("guide.viscos_friction",)},
            UsageError,
            'exclude "guide.viscos_friction": no such effect among the candidates; expected a name or a pattern. '
            'Did you mean "guide.viscous_friction"?',
        ),
        (
            {"only": ("gide*",)},
            UsageError,
            'only "gide*": no such effect among the candidates; expected a name or a pattern. '
            "`fibrefit effects` lists the catalogue.",
        ),
        (
            {"only": ("guide.asymmetric_viscous_friction",)},
            UsageError,
            'only "guide.asymmetric_viscous_friction": stands without "guide.viscous_friction"; expected both. '
            'Add "guide.viscous_friction" to the list.',
        ),
        (
            {"only": ("fibre.hardening",), "exclude": ("fibre.*",)},
            UsageError,
            "only and exclude: no effect is left to try; expected one at least. Exclude fewer.",
        ),
        (
            {"only": ("mine.py:Elsewhere",)},
            UsageError,
            'only "mine.py:Elsewhere": makes no sense on the rig fibre_mass; expected a rig with a guide and a pulley. '
            "Take it off the list.",
        ),
        ({"also": ("mine.py:Rab",)}, StudyError, 'Did you mean "Rub"?'),
        ({"also": ("yours.py:Rub",)}, StudyError, "Check the path."),
    ],
)
def test_refusals(own: Study, asked: dict[str, tuple[str, ...]], kind: type[FibrefitError], says: str) -> None:
    with pytest.raises(kind) as caught:
        candidates_of(own, **asked)
    assert str(caught.value).endswith(says)


def test_what_is_in_the_model_cannot_be_missing() -> None:
    study = load_study(DATA / "viscous", ['model.effects=["guide.viscous_friction"]'])
    with pytest.raises(UsageError) as caught:
        candidates_of(study, only=("guide.viscous_friction",))
    assert str(caught.value) == (
        'only "guide.viscous_friction": is in the model already; expected an effect that may be missing. '
        "Take it off the list."
    )
