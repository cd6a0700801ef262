"""Programs made while a first fit goes on: those, and no others, that a search then asks for."""

from __future__ import annotations

from fibrefit.discovery.curves.predicted import look_at
from fibrefit.discovery.curves.probes import PROBES
from fibrefit.discovery.engine import supermodel
from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.first_programs import first_programs
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.laws.catalogue import find_effect
from fibrefit.laws.ports import PORTS
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.discovery import made
from tests.discovery.conftest import DATA


def test_first_programs_are_those_that_a_search_then_asks_for() -> None:
    """Made from a task alone, they are found when effects and curves are looked at beside the fitted base model."""
    task = task_of(load_study(DATA / "viscous"))
    effects = [made.VISCOUS, find_effect("fibre.toe_region"), find_effect("sensor.force_lag")]
    jobs = first_programs(task, effects)
    # Three places of the effects, then curves.
    assert len(jobs) == 4
    for job in jobs:
        job()
    search, base = prepared_search(task, made.identified(task), effects, lambda *of: None)
    known = set(supermodel._rows._programs)
    for effect in effects:
        held = search.supermodel_for(effect)
        local = transferred(held, base.supermodel, base.local)
        held.residuals(local, search.context.whole)
    look_at(search, base, made.identified(task), tuple(PORTS), PROBES)
    assert set(supermodel._rows._programs) == known
