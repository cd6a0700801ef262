"""What is named has made the gap smaller; what makes it larger is taken out again, and said to be."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fibrefit.core.time_limit import Budget
from fibrefit.discovery import conclusion
from fibrefit.discovery.forward_selection import Limits
from fibrefit.study.summaries.summaries import ChannelGap

FIRST, SECOND = (SimpleNamespace(name=f"guide.{name}") for name in ("one", "other"))


def fit(gap: float, ended: bool = True, alike: bool = False) -> Any:
    check = SimpleNamespace(identifier="completion", passed=ended)
    gls = None if alike else "whitened"
    return SimpleNamespace(gap={"force": ChannelGap.beside(1.0, gap, "N", 0.99)}, checks=(check,), gls=gls)


def model(*effects: Any) -> Any:
    return SimpleNamespace(effects=effects, names=tuple(effect.name for effect in effects))


def confirmed(monkeypatch: pytest.MonkeyPatch, gaps: dict[int, Any], limits: Limits) -> tuple[Any, Any, list[str]]:
    """What remains of two effects, by the fits with so many of them."""
    monkeypatch.setattr(conclusion, "_final", lambda search, best, seed, budget: gaps[len(best.effects)])
    search = SimpleNamespace(scales=SimpleNamespace(without=lambda best, kept: model(*kept)))
    return conclusion._confirmed(cast("Any", search), model(FIRST, SECOND), fit(1.0), limits, Budget(60.0, 0.0))


def test_what_makes_the_gap_smaller_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    best, after, said = confirmed(monkeypatch, {2: fit(0.98)}, Limits())
    assert (best.effects, after.gap["force"].rms, said) == ((FIRST, SECOND), 0.98, [])


def test_what_makes_it_larger_goes_the_last_first(monkeypatch: pytest.MonkeyPatch) -> None:
    best, after, said = confirmed(monkeypatch, {2: fit(1.12), 1: fit(0.99)}, Limits())
    assert (best.effects, after.gap["force"].rms) == ((FIRST,), 0.99)
    assert [(one.identifier, one.facts) for one in said] == [("widens", {"effect": "guide.other", "gaps": (1.0, 1.12)})]


def test_nothing_may_be_left_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    best, after, said = confirmed(monkeypatch, {2: fit(1.12), 1: fit(1.05)}, Limits())
    assert (best.effects, after.gap["force"].rms, len(said)) == ((), 1.0, 2)


def test_a_fit_that_was_cut_short_and_a_person_who_chose_are_no_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    assert confirmed(monkeypatch, {2: fit(1.12, ended=False)}, Limits())[0].effects == (FIRST, SECOND)
    by_hand = replace(Limits(), choose=lambda ranking: None)
    assert confirmed(monkeypatch, {2: fit(1.12)}, by_hand)[0].effects == (FIRST, SECOND)


def test_a_fit_that_takes_records_for_alike_is_not_held_against_one_that_lets_them_differ(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert confirmed(monkeypatch, {2: fit(1.12, alike=True)}, Limits())[0].effects == (FIRST, SECOND)
