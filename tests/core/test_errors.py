"""Words that are suggested for a misspelt one."""

from __future__ import annotations

import pytest

from fibrefit.core.errors import did_you_mean
from fibrefit.laws.catalogue import CATALOGUE


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("guide.visc", "guide.viscous_friction"),  # its beginning, and not what has as many letters in common
        ("GUIDE.VISC", "guide.viscous_friction"),
        ("guide.viscuos_friction", "guide.viscous_friction"),
        ("guide.sprin", "guide.spring"),
    ],
)
def test_a_beginning_is_meant_before_a_likeness(word: str, meant: str) -> None:
    assert did_you_mean(word, CATALOGUE) == f'Did you mean "{meant}"?'


def test_a_letter_or_two_begin_too_many_words() -> None:
    assert did_you_mean("gu", CATALOGUE) == ""


def test_where_a_word_has_to_be_nearly_the_same_its_beginning_is_not_enough() -> None:
    assert did_you_mean("fib", ["fibre_mass"], 0.8) == ""
    assert did_you_mean("fibre_mas", ["fibre_mass"], 0.8) != ""
