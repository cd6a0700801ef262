"""A record that was taken with another fibre, or some of them, among records that differ anyway."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.limits import quiet
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import NAMED, PRICE
from fibrefit.discovery.search import screen
from fibrefit.discovery.search.record_sets import CHANGE, most_likely_split, of_record_sets
from fibrefit.discovery.search.screen import Screen
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.identify import How, identify
from fibrefit.laws.catalogue import find_effect, suits
from fibrefit.laws.families import of_records
from fibrefit.laws.law import Effect
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.study import load_study
from fibrefit.workflow.discovery.statements import statements_of
from fibrefit.workflow.prepare import task_of
from tests.discovery.made import identified, named, with_estimates
from tests.independent.laws import DROP
from tests.independent.make import write_study
from tests.independent.series import Series, scattered, take
from tests.validation.designs import USUAL_DESIGN, noise_of
from tests.validation.mistakes import Mistaken

OTHER = find_effect("study.other_fibre")


def searched(folder: Path) -> tuple[Search, LaplaceFit]:
    """Where a search for records of another fibre begins."""
    study = load_study(folder)
    task = task_of(study)
    effects = [of_records(OTHER, place) for place in range(1, 1 + len(study.records))]
    return prepared_search(task, identify(task, 4, 0, How(whiten=False, rivals=False)), effects, quiet)


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, Search, LaplaceFit]:
    """Number of the record, and where a search begins: records differ by one percent."""
    folder = tmp_path_factory.mktemp("other")
    odd = Mistaken("another fibre in a test", "other fibre", "fibre_mass", 28, "pink", 0.01).write(folder)
    return [record.file for record in load_study(folder).records].index(odd) + 1, *searched(folder)


def series(folder: Path, seed: int, odd: tuple[int, ...], scatter: float) -> None:
    """Five drops, those at some places with a fibre that is 1.3 times as stiff."""
    rng = np.random.default_rng(seed)
    base, noise = USUAL_DESIGN.base(rng), noise_of("pink", rng)
    stiffer = base._replace(stiffness=1.3 * base.stiffness)
    records = [
        take(plan, scattered(stiffer if i in odd else base, rng, scatter), {}, 1e-4, noise, rng, USUAL_DESIGN.step)
        for i, plan in enumerate(USUAL_DESIGN.plans(DROP, rng), 1)
    ]
    assert len(records) == 5
    write_study(Series(DROP, base, {}, tuple(records), records[0], None, seed), folder)


def test_it_is_found_though_its_deviation_accounts_for_it(
    begun: tuple[int, Search, LaplaceFit], monkeypatch: pytest.MonkeyPatch
) -> None:
    odd, search, base = begun
    # What is left is noise: the broad prior of deviations holds that record, too.
    assert base.evidence.mode.sigma.max() > 0.02
    assert search.gap_left(base) < 1.1
    found = {one.names[-1]: one.log - base.log for one in search.tried(base, search.effects, "").found}
    assert found.pop(f"study.other_fibre@{odd}") > 2.0 * NAMED
    assert max(found.values()) < NAMED
    # A score test at the standard deviations of all records says hardly anything of it.
    monkeypatch.setattr(screen, "stands_for_differences", lambda effect: False)
    slopes = search.inference.slopes(base)
    effect = next(one for one in search.effects if one.name == f"study.other_fibre@{odd}")
    supermodel = search.supermodel_for(effect, ())
    assert Screen(search.inference, base, slopes).predicted(supermodel, [effect])[effect].gain < NAMED


@pytest.mark.slow
def test_two_of_five_are_found_together(tmp_path: Path) -> None:
    series(tmp_path, 3, (2, 4), 0.005)
    search, base = searched(tmp_path)
    (both,) = of_record_sets(base, search.effects)
    assert both.name == "study.other_fibre@2+4"
    # Of a family of which a member is left out, or whose set is there already, none is offered.
    assert not of_record_sets(base, [one for one in search.effects if one.name != "study.other_fibre@5"])
    assert not of_record_sets(base, (*search.effects, both))
    whole = replace(search, effects=(*search.effects, both))
    first, *others = whole.tried(base, whole.effects, "").found
    assert first.effects[-1] is both
    assert first.log - base.log > NAMED
    assert max(one.log for one in others) - base.log < 1.0
    # To choose among all sets of five records is paid for.
    assert first.evidence.log - first.log == pytest.approx(np.log(10.0))
    change = f"{both.name}.stiffness_change"
    assert abs(first.shared[change] - 0.3) < 3.0 * first.errors[change] < 0.05


@pytest.mark.parametrize("seed", [5, pytest.param(6, marks=pytest.mark.slow)])
def test_records_that_merely_differ_are_of_one_fibre(tmp_path: Path, seed: int) -> None:
    """The negative control: two percent between records, and the best set of them tried whatever it promises."""
    series(tmp_path, seed, (), 0.02)
    search, base = searched(tmp_path)
    split = most_likely_split(base.evidence.mode.place.eta[:, :2])
    assert split is not None
    best = of_records(OTHER, *split[0])
    whole = replace(search, effects=(*search.effects, best))
    assert max(one.log - base.log for one in whole.tried(base, whole.effects, "").found) < NAMED


def test_a_set_is_proposed_where_deviations_part() -> None:
    random = np.random.default_rng(0)
    for number in range(4, 12):
        odd = sorted(random.choice(number, 2, replace=False).tolist())
        apart = np.isin(np.arange(number), odd)[:, None] * np.array([0.26, 0.0])
        split = most_likely_split(apart + 0.005 * random.standard_normal((number, 2)))
        assert split is not None
        assert split[1] > 2.0 * PRICE
        # Of two that are as large, the first record is not in the one that is named.
        smaller = odd if number > 4 or 0 not in odd else sorted(set(range(4)) - set(odd))
        assert split[0] == tuple(place + 1 for place in smaller)
    assert most_likely_split(np.zeros((3, 2))) is None
    assert most_likely_split(np.zeros((5, 0))) is None


@pytest.mark.parametrize(("number", "most"), [(4, 0.12), (5, 0.07), (8, 0.03)])
def test_records_that_merely_differ_seldom_promise_a_set(number: int, most: float) -> None:
    """The negative control, which is one more candidate at the most; and one record alone is no set."""
    random = np.random.default_rng(1)
    promised = [
        split is not None and split[1] > 2.0 * PRICE
        for split in (most_likely_split([0.02, 0.05] * random.standard_normal((number, 2))) for _ in range(500))
    ]
    assert np.mean(promised) < most
    alone = 0.005 * random.standard_normal((number, 2))
    alone[1] += 0.26
    split = most_likely_split(alone)
    assert split is not None
    assert split[1] < 2.0 * PRICE


def test_what_another_fibre_changes_is_called_as_the_rig_calls_it() -> None:
    changed = {parameter.name.removesuffix(CHANGE) for parameter in OTHER.parameters}
    for rig in (rig for rig in RIGS.values() if suits(OTHER, rig)):
        assert changed <= {parameter.name for parameter in rig.parameters}


@pytest.mark.parametrize(("effect", "taken"), [
    (of_records(OTHER, 2), "{1} was taken with another fibre: stiffness 30 +/- 1 % larger, damping 5 +/- 2 % smaller."),
    (of_records(OTHER, 1, 2),
     "{0} and {1} were taken with another fibre: stiffness 30 +/- 1 % larger, damping 5 +/- 2 % smaller."),
])  # fmt: skip
def test_a_sentence_says_which_records_were_taken_with_another_fibre(
    task: Task, effect: type[Effect], taken: str
) -> None:
    finding = replace(named(task), added=(effect,), after=identified(task, (effect,)))
    said = {"stiffness_change": (0.3, 0.01), "damping_change": (-0.05, 0.02)}
    (sentence,) = statements_of(with_estimates(finding, said))
    assert sentence == taken.format(*task.problem.layout.records)
