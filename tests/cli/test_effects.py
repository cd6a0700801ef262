"""The catalogue as a person and as a program see it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.cli.terminal import spelt
from fibrefit.core.errors import StudyError
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.study import load_study
from fibrefit.workflow.prepare import model_of
from tests.cli.conftest import Run

OWN = '''
from __future__ import annotations
from typing import ClassVar
import jax
from fibrefit.laws.law import GuideLaw, quantity

class Glue(GuideLaw):
    """A guide that sticks.

    Law
    ---
    ``g``.
    """

    name: ClassVar[str] = "guide.glue"
    strength_of_glue: jax.Array = quantity("N", "strength", 1.0)
'''


def test_the_list_holds_every_effect(fibrefit: Run) -> None:
    done = fibrefit("effects")
    assert done.code == 0
    assert all(f"  {name} " in done.out for name in CATALOGUE)
    assert max(map(len, done.out.splitlines())) <= 80
    assert {effect["name"] for effect in fibrefit("effects", "--json").document} == set(CATALOGUE)


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_page_tells_law_parameters_units_and_source(fibrefit: Run, name: str) -> None:
    page = fibrefit("effects", name).out
    for title in ("Law\n", "Parameters\n", "Source\n", f'effects = ["{name}"]'):
        assert title in page
    for parameter in CATALOGUE[name].parameters:
        assert f"{name}.{parameter.name}" in page
        assert parameter.doc.split()[0] in page
    document = fibrefit("effects", name, "--json").document
    assert document["law"]
    assert document["source"]
    assert [p["unit"] for p in document["parameters"]] == [p.unit for p in CATALOGUE[name].parameters]


def test_a_page_has_a_picture_where_a_curve_says_what_the_effect_does(fibrefit: Run) -> None:
    page = fibrefit("effects", "guide.quadratic_drag").out
    picture = page[page.index("At its typical values") : page.index("Valid range")].splitlines()
    assert "force of the guide / N" in picture[1]
    drawn = "".join(picture[2:])
    assert drawn.count("#") > 30
    assert drawn.count(".") > 20
    assert max(map(len, page.splitlines())) <= 80
    assert "At its typical values" not in fibrefit("effects", "rig.inclination_error").out
    assert "At its typical values" not in fibrefit("effects", "guide.quadratic_drag", "--json").out


def test_a_misspelt_effect_suggests_its_neighbour(fibrefit: Run) -> None:
    done = fibrefit("effects", "guide.viscus_friction")
    assert done.code == 2
    assert 'Did you mean "guide.viscous_friction"?' in done.err


def test_a_word_of_a_name_finds_it(fibrefit: Run) -> None:
    done = fibrefit("effects", "viscous")
    assert done.code == 2
    assert 'Did you mean "guide.viscous_friction" or "guide.asymmetric_viscous_friction"?' in done.err


def test_an_effect_that_a_study_names_in_vain_is_told_with_its_place(fibrefit: Run) -> None:
    fibrefit("init", "here")
    study = load_study("here", ['model.effects=["guide.viscus", "quux"]'])
    with pytest.raises(StudyError) as caught:
        model_of(study)
    place = '--set model.effects=["guide.viscus", "quux"]'
    assert [error.where for error in (caught.value, *caught.value.further)] == [
        f'{place}, effect "guide.viscus"',
        f'{place}, effect "quux"',
    ]
    file = Path("here/study.toml")
    file.write_text(file.read_text("utf-8").replace("effects = []", 'effects = ["guide.viscus"]'), "utf-8")
    with pytest.raises(StudyError) as caught:
        model_of(load_study("here"))
    assert str(caught.value) == (
        f'{file}, model.effects, effect "guide.viscus": not in the catalogue; expected a name from it, or '
        '"my_effects.py:MyEffect". Did you mean "guide.viscous_friction"?'
    )


def test_an_effect_of_ones_own(fibrefit: Run) -> None:
    Path("mine.py").write_text(OWN)
    page = fibrefit("effects", "mine.py:Glue").out
    assert page.rstrip().endswith('effects = ["mine.py:Glue"]')
    assert 'effects = ["mine.py:Glue"]' in fibrefit("effects", "./mine.py:Glue").out
    assert "A guide that sticks." in page
    assert "guide.glue.strength_of_glue" in page


def test_a_law_that_is_begun_keeps_the_contract(fibrefit: Run) -> None:
    done = fibrefit("init", "--effect", "guide.my_drag")
    assert done.code == 0
    assert 'effects = ["my_drag.py:MyDrag"]' in done.out
    assert fibrefit("effects", "--check", "my_drag.py:MyDrag").code == 0
    again = fibrefit("init", "--effect", "guide.my_drag")
    assert again.code == 2
    assert "exists already" in again.err
    for words in (("demo",), ("more.py", "--effect", "guide.my_drag")):
        done = fibrefit("init", *words, "--port", "fibre")
        assert done.code == 2
        assert "--port fibre: " in done.err
        assert not Path(words[0]).exists()
    assert fibrefit("init", "other.py", "--effect", "my_drag", "--port", "fibre", "--json").document == {
        "effect": "fibre.my_drag",
        "file": "other.py",
        "name": "other.py:MyDrag",
    }


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--effect", "gide.drag"], 'Did you mean "guide"?'),
        (["--effect", "drag"], "PORT.NAME"),
        (["--effect", "guide.My-Drag"], "small letters"),
        (["--effect", "guide.quadratic_drag"], "in the catalogue already"),
        (["drag.txt", "--effect", "guide.drag"], "no Python file"),
        ([], "no folder"),
    ],
)
def test_what_cannot_be_begun(fibrefit: Run, words: list[str], says: str) -> None:
    done = fibrefit("init", *words)
    assert done.code == 2
    assert says in done.err


def test_all_that_is_wrong_with_a_law_is_said(fibrefit: Run) -> None:
    assert fibrefit("init", "--effect", "guide.drag").code == 0
    text = Path("drag.py").read_text()
    Path("drag.py").write_text(text.replace("    def force(", "    def forse(").replace("N s^3/m^3", "quux"))
    done = fibrefit("effects", "--check", "drag.py:Drag")
    assert done.code == 4
    assert done.err.count("error: ") == 2
    told = fibrefit("effects", "--check", "drag.py:Drag", "--json")
    assert told.code == 4
    assert len(told.document["violations"]) == 2
    assert not told.document["passed"]
    assert fibrefit("effects", "--check").code == 2
    assert fibrefit("effects", "--check", "guide.quadratic_drag").code == 0


@pytest.mark.parametrize(
    ("encoding", "expected"), [("utf-8", "η e ü"), ("cp1252", "eta e ü"), ("ascii", "eta e ü"), (None, "eta e ü")]
)
def test_greek_letters_are_spelt_where_they_are_lacking(encoding: str | None, expected: str) -> None:
    assert spelt("η e ü", encoding) == expected
