"""Finding effects by name: in the catalogue, in a file of the user's, in an installed package."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path

import jax.numpy as jnp
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.laws import catalogue
from fibrefit.laws.catalogue import CATALOGUE, find_effect, select_effects
from fibrefit.laws.law import GuideLaw
from fibrefit.rigs.catalogue import RIGS
from tests.simulation.drops import drop, respond

MINE = '''
from typing import ClassVar
import jax
from fibrefit.laws.law import GuideLaw, quantity

class EndStop(GuideLaw):
    """A soft stop at the end of the guide."""
    name: ClassVar[str] = "guide.end_stop"
    stop_stiffness: jax.Array = quantity("N/m", "stiffness of the stop", 1e3, lower=0.0)

    def force(self, position, velocity):
        return self.stop_stiffness * jax.numpy.maximum(position, 0.0)

class Nameless(GuideLaw):
    """No name."""
    strength_of_it: jax.Array = quantity("N", "something", 1.0)

class Empty(GuideLaw):
    """No parameter."""
    name: ClassVar[str] = "guide.empty"

class Thief(GuideLaw):
    """A name that is taken."""
    name: ClassVar[str] = "guide.viscous_friction"
    something: jax.Array = quantity("N", "something", 1.0)

number = 3
'''


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    (tmp_path / "my_effects.py").write_text(MINE, encoding="utf-8")
    (tmp_path / "broken.py").write_text("import nothing_of_that_name", encoding="utf-8")
    return tmp_path


def test_names_are_ports_and_effects() -> None:
    for name, effect in CATALOGUE.items():
        port, _, rest = name.partition(".")
        assert port in {"guide", "fibre", "pulley", "drive", "sensor", "push", "pivot", "study", "rig"}
        assert rest.replace("_", "a").isalpha()
        assert effect.name == name


def test_an_effect_of_the_users_own_moves_the_weight(mine: Path) -> None:
    effect = find_effect("my_effects.py:EndStop", mine)
    assert issubclass(effect, GuideLaw)
    assert effect.parameters[0].unit == "N/m"
    assert find_effect("my_effects.py:EndStop", mine) is effect
    short = drop(201)
    zero, stopped = (respond(short, (effect,), **{"guide.end_stop.stop_stiffness": k}) for k in (0.0, 1e4))
    assert jnp.array_equal(zero["position"], respond(short)["position"])
    assert stopped["position"].max() < 0.95 * zero["position"].max()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("guide.viscos_friction", 'not in the catalogue.*mean "guide.viscous_friction"'),
        ("something", "`fibrefit effects` lists"),
        ("nowhere.py:EndStop", "no file .*nowhere.py"),
        ("my_effects.py:EndStopp", 'no EndStopp in my_effects.py.*mean "EndStop"'),
        ("my_effects.py:number", "3 is no effect"),
        ("my_effects.py:Nameless", "its name is ''"),
        ("my_effects.py:Empty", "declares no parameter"),
        ("my_effects.py:Thief", 'the name "guide.viscous_friction" is taken'),
        ("broken.py:Anything", "broken.py fails with ModuleNotFoundError"),
    ],
)
def test_refusals(mine: Path, name: str, message: str) -> None:
    with pytest.raises(StudyError, match=message) as refused:
        find_effect(name, mine)
    assert refused.value.where == f'effect "{name}"'


@pytest.mark.parametrize(
    ("names", "kind", "message"),
    [
        (["guide.viscous_friction"], "inverted_pendulum", "makes no sense on the rig inverted_pendulum"),
        (["guide.viscous_friction"] * 2, "fibre_mass", "named twice"),
        (["guide.asymmetric_viscous_friction"], "fibre_mass", 'stands without "guide.viscous_friction"'),
    ],
)
def test_refusals_of_selections(names: list[str], kind: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        select_effects(names, RIGS[kind])


def test_all_names_that_stand_for_nothing_are_told() -> None:
    with pytest.raises(StudyError) as caught:
        select_effects(["guide.viscus", "guide.viscous_friction", "quux"], RIGS["fibre_mass"])
    begins = 'not in the catalogue; expected a name from it, or "my_effects.py:MyEffect".'
    assert str(caught.value).splitlines() == [
        f'effect "guide.viscus": {begins} Did you mean "guide.viscous_friction"?',
        f'effect "quux": {begins} `fibrefit effects` lists the catalogue.',
    ]


@pytest.mark.parametrize(
    ("name", "do"),
    [
        ("viscous", 'Did you mean "guide.viscous_friction" or "guide.asymmetric_viscous_friction"?'),
        ("Viscous", 'Did you mean "guide.viscous_friction" or "guide.asymmetric_viscous_friction"?'),
        ("guide.viscus", 'Did you mean "guide.viscous_friction"?'),
        ("", "`fibrefit effects` lists the catalogue."),
    ],
)
def test_names_that_contain_a_word_are_suggested(name: str, do: str) -> None:
    with pytest.raises(StudyError) as caught:
        find_effect(name)
    assert caught.value.do == do


def test_of_many_names_with_a_word_some_are_suggested() -> None:
    with pytest.raises(StudyError) as caught:
        find_effect("friction")
    number = sum("friction" in name for name in CATALOGUE) - catalogue.MOST_SUGGESTED
    assert caught.value.do.count(" or ") == catalogue.MOST_SUGGESTED - 1
    assert caught.value.do.endswith(f"? `fibrefit effects` lists {number} more with that word.")


def test_selection_keeps_the_order() -> None:
    names = ["sensor.force_delay", "guide.viscous_friction", "guide.asymmetric_viscous_friction"]
    assert [effect.name for effect in select_effects(names, RIGS["fibre_mass"])] == names


def test_an_installed_package_offers_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    target = "fibrefit.laws.guide.drag:ViscousFriction"
    point = EntryPoint("other.friction", target, catalogue.ENTRY_POINTS)
    monkeypatch.setattr(catalogue, "entry_points", lambda group: [point] if group == catalogue.ENTRY_POINTS else [])
    assert find_effect("other.friction") is CATALOGUE["guide.viscous_friction"]
    with pytest.raises(StudyError, match='mean "other.friction"'):
        find_effect("other.frictio")
    point = EntryPoint("other.friction", "no_such_package.laws:Friction", catalogue.ENTRY_POINTS)
    with pytest.raises(
        StudyError, match="no_such_package.laws:Friction, which an installed package offers, fails with"
    ):
        find_effect("other.friction")
