"""A record that was taken with another fibre, among records that differ anyway."""

from __future__ import annotations

import pytest

from fibrefit.core.progress import quiet
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search import screen
from fibrefit.discovery.search.screen import Screen
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.identify import How, identify
from fibrefit.laws.catalogue import find_effect
from fibrefit.laws.families import of_record
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.validation.mistakes import Mistaken


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, Search, LaplaceFit]:
    """Number of the record, and where a search begins: records differ by one percent."""
    folder = tmp_path_factory.mktemp("other")
    odd = Mistaken("another fibre in a test", "other fibre", "fibre_mass", 28, "pink", 0.01).write(folder)
    study = load_study(folder)
    task = task_of(study)
    effects = [of_record(find_effect("study.other_fibre"), place) for place in range(1, 1 + len(study.records))]
    before = identify(task, 4, 0, How(whiten=False, rivals=False))
    return [record.file for record in study.records].index(odd) + 1, *prepared_search(task, before, effects, quiet)


def test_it_is_found_though_its_deviation_accounts_for_it(
    begun: tuple[int, Search, LaplaceFit], monkeypatch: pytest.MonkeyPatch
) -> None:
    odd, search, base = begun
    # What is left is noise: the broad prior of deviations holds that record, too.
    assert base.evidence.mode.sigma.max() > 0.02
    assert search.gap(search.plain(base)) < 1.1
    found = {one.names[-1]: one.log - base.log for one in search.tried(base, search.effects, "").found}
    assert found.pop(f"study.other_fibre@{odd}") > 2.0 * NAMED
    assert max(found.values()) < NAMED
    # A score test at the standard deviations of all records says hardly anything of it.
    monkeypatch.setattr(screen, "stands_for_differences", lambda effect: False)
    slopes = search.inference.slopes(base)
    effect = next(one for one in search.effects if one.name == f"study.other_fibre@{odd}")
    supermodel = search.supermodel_for(effect, ())
    assert Screen(search.inference, base, slopes).predicted(supermodel, [effect])[effect].gain < NAMED
