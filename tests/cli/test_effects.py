"""The catalogue as a person and as a program see it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.cli.terminal import spelt
from fibrefit.effects.catalogue import CATALOGUE
from tests.cli.conftest import Run

OWN = '''
from __future__ import annotations
from typing import ClassVar
import jax
from fibrefit.effects.law import GuideLaw, quantity

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


def test_an_effect_of_ones_own(fibrefit: Run) -> None:
    Path("mine.py").write_text(OWN)
    page = fibrefit("effects", "mine.py:Glue").out
    assert "A guide that sticks." in page
    assert "guide.glue.strength_of_glue" in page


@pytest.mark.parametrize(
    ("encoding", "expected"), [("utf-8", "η e ü"), ("cp1252", "eta e ü"), ("ascii", "eta e ü"), (None, "eta e ü")]
)
def test_greek_letters_are_spelt_where_they_are_lacking(encoding: str | None, expected: str) -> None:
    assert spelt("η e ü", encoding) == expected
