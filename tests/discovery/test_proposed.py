"""Laws fitted to records into which a curve was planted: much of it, and little."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.discovery.curves import free_form
from fibrefit.discovery.curves.free_form import proposing
from fibrefit.discovery.curves.probes import FrictionOfSpeed, TensionOfRate
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.laws import propose
from fibrefit.discovery.laws.propose import described, proposed
from fibrefit.fitting.result import Identification
from fibrefit.laws.ports import PORTS
from fibrefit.problem.task import Task
from tests.discovery.test_free_form import begun_at, identified, planted


@pytest.fixture(scope="module")
def found(task: Task) -> Identification:
    """Where the records have been."""
    return identified(task)


@pytest.mark.parametrize(("rise", "route"), [(2.0, "_far"), (0.15, "_near")])
def test_a_planted_law_is_found_however_much_of_it_is_missing(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch, rise: float, route: str
) -> None:
    """A friction that is proportional to speed: where it is strong, bounces come at other times."""
    monkeypatch.setattr(free_form, "PROBES", (FrictionOfSpeed, TensionOfRate))
    taken: list[str] = []
    for name in ("_far", "_near"):
        way = getattr(propose, name)
        monkeypatch.setattr(propose, name, lambda *of, name=name, way=way: (taken.append(name), way(*of))[1])
    search = begun_at(planted(task, found, FrictionOfSpeed, rise * np.linspace(0.0, 1.0, FrictionOfSpeed.knots)))
    base, context = search.base.supermodel, search.context
    fit = refit(base, context.subset(()), search.base.fit.local, context.whole)
    parent = search.inference.fitted(base, (), fit.local)
    readings = proposing(search, parent, found, tuple(PORTS))
    proposal = proposed(search, parent, readings)
    assert proposal is not None
    assert set(taken) == {route}
    assert search.gap(search.plain(proposal.best)) == pytest.approx(1.0, abs=0.02)
    law = described(search, proposal)
    assert (law.summary.port, law.summary.variable) == ("guide", "speed")
    # The rise over the range that the records saw is that which was planted, whatever the form.
    assert np.ptp(law.heights) == pytest.approx(rise, rel=0.25)
