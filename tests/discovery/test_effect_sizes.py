"""How much an effect matters, beside what else would have explained the same."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from fibrefit.discovery.search import effect_sizes
from fibrefit.laws.catalogue import find_effect

DRAG = find_effect("guide.quadratic_drag")


@pytest.mark.parametrize(
    ("differ", "alike", "gain"),
    [
        (True, 900.0, 50.0),  # records that differ explain most of what values that all share leave
        (False, 900.0, 800.0),
        (True, 120.0, 20.0),  # where they lead to a wrong minimum, those that are alike
    ],
)
def test_what_records_differ_by_is_not_what_an_effect_does(differ: bool, alike: float, gain: float) -> None:
    def hypothesis(cost: float) -> Any:
        return SimpleNamespace(fit=SimpleNamespace(cost=cost), effects=(), supermodel=None)

    sigma = SimpleNamespace(any=lambda: differ)
    best: Any = SimpleNamespace(effects=(DRAG,), evidence=SimpleNamespace(mode=SimpleNamespace(sigma=sigma)))
    search: Any = SimpleNamespace(
        base=hypothesis(alike),
        inference=SimpleNamespace(without=lambda one, rest: rest),
        plain=lambda rest: hypothesis(150.0),
    )
    base = effect_sizes._where_records_differ(search, best, (), search.base)
    (found,) = effect_sizes._without_each(search, best, cast(Any, hypothesis(100.0)), base)
    assert (found.effect, found.gain) == (DRAG, gain)
