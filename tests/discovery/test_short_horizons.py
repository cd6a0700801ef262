"""Refits led once more over the first bounces, with the descents themselves made up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.discovery.engine import candidates
from fibrefit.discovery.engine.candidates import SearchContext, rescued_by_short_horizons
from fibrefit.discovery.engine.refit import Refit, Subset

WHOLE = 100


def ends(cost: float) -> Refit:
    return Refit(np.zeros((1, 1)), cost)


def led(monkeypatch: pytest.MonkeyPatch, costs: list[float], stages: list[int], sensitivities: Any = None) -> float:
    """Cost at the end, where descents over whole records end with `costs` one after the other."""
    ahead = iter(costs)

    def descend(supermodel: Any, subset: Any, local: Any, counts: np.ndarray, *limits: float) -> Refit:
        return ends(next(ahead)) if counts[0] == WHOLE else ends(1.0)

    monkeypatch.setattr(candidates, "refit", descend)
    context = SearchContext((), (), (), np.array([[stage] for stage in stages]), {})
    supermodel: Any = SimpleNamespace(sensitivities=sensitivities)
    return rescued_by_short_horizons(supermodel, Subset((), ()), ends(1000.0), context).cost


def test_it_goes_on_as_long_as_that_leads_lower(monkeypatch: pytest.MonkeyPatch) -> None:
    assert led(monkeypatch, [500.0, 100.0, 99.9], [20, WHOLE]) == 100.0


def test_it_keeps_what_it_had(monkeypatch: pytest.MonkeyPatch) -> None:
    assert led(monkeypatch, [2000.0], [20, WHOLE]) == 1000.0
    assert led(monkeypatch, [float("nan")], [20, WHOLE]) == 1000.0


def test_there_is_nothing_to_lead_where_whole_records_are_the_first_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    assert led(monkeypatch, [], [WHOLE]) == 1000.0
    assert led(monkeypatch, [], [20, WHOLE], sensitivities=object()) == 1000.0
