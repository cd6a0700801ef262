"""A search that goes on: no fit that was finished is made again, and it ends where one ends that nobody interrupted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest

from fibrefit.core.limits import OutOfTimeError, quiet
from fibrefit.discovery.curves import free_form, predicted
from fibrefit.discovery.engine import laplace_inference, linearisation
from fibrefit.discovery.engine.candidates import SearchContext
from fibrefit.discovery.engine.journal import Journal
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.linearisation import AS_BEGUN, Linearisation
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.search import inputs, linearised
from fibrefit.discovery.search.linearised import linearised_once
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.laws.catalogue import find_effect
from fibrefit.laws.ports import PORTS
from fibrefit.problem.task import Task
from tests.discovery.test_free_form import identified
from tests.discovery.test_journal import Counted
from tests.discovery.test_records_differ import begin

VISCOUS = find_effect("guide.viscous_friction")


def same(one: LaplaceFit, other: LaplaceFit) -> bool:
    """Whether two hypotheses are the same to the last bit."""
    mine, others = one.evidence, other.evidence
    pairs = (
        (one.local, other.local), (mine.logs, others.logs), (mine.z, others.z), (mine.covariance, others.covariance),
        (mine.mode.place.eta, others.mode.place.eta), (mine.mode.sigma, others.mode.sigma),
    )  # fmt: skip
    return one.names == other.names and one.log == other.log and all(np.array_equal(*pair) for pair in pairs)


def counted(monkeypatch: pytest.MonkeyPatch, module: Any, name: str) -> Mock:
    """A function that counts how often it is called."""
    mock = Mock(wraps=getattr(module, name))
    monkeypatch.setattr(module, name, mock)
    return mock


def all_fits(search: Search, base: LaplaceFit) -> list[LaplaceFit]:
    """A hypothesis with an effect and what a round makes of it."""
    inference = search.inference
    supermodel = search.supermodel_for(VISCOUS)
    local = np.array([[supermodel.declared[name].typical for name in supermodel.names]] * len(base.local))
    for j, name in enumerate(supermodel.names):
        if name in base.supermodel.names:
            local[:, j] = base.local[:, base.supermodel.names.index(name)]
    found = inference.fitted(supermodel, (VISCOUS,), local)
    lesser = inference.without(found, ())
    return [found, lesser, inference.again(found), inference.warm_started_without(found, ()), inference.pooled(lesser)]


def test_records_are_taken_for_alike_along_the_slopes_of_where_they_differ(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Deviations are there where the descent begins: what is shared moves with them as they are taken away."""
    search, base = prepared_search(task, identified(task), [VISCOUS], quiet)
    place = base.evidence.mode.place
    apart = place._replace(eta=place.eta + np.linspace(-0.01, 0.03, place.eta.size).reshape(place.eta.shape))
    differing = replace(base, evidence=replace(base.evidence, mode=replace(base.evidence.mode, place=apart)))
    begun = list[np.ndarray]()
    descend = laplace_inference.mode

    def followed(unknowns: Any, start: Any, *of: Any, **how: Any) -> Any:
        begun.append(start.eta)
        return descend(unknowns, start, *of, **how)

    monkeypatch.setattr(laplace_inference, "mode", followed)
    alike = search.inference.pooled(differing)
    np.testing.assert_array_equal(begun[0], apart.eta)
    assert not alike.evidence.mode.sigma.any()
    assert np.abs(alike.evidence.mode.place.eta).max() < 1e-6
    assert alike.log == pytest.approx(search.inference.pooled(base).log, abs=0.05)


def test_fits_are_made_once(task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    search, base = prepared_search(task, identified(task), [VISCOUS], quiet)
    plain = all_fits(search, base)
    evidence, mode = (counted(monkeypatch, laplace_inference, name) for name in ("laplace_evidence", "mode"))
    kept = search.with_inference(search.inference.kept_in(tmp_path))
    first, times = all_fits(kept, base), (evidence.call_count, mode.call_count)
    assert times == (4, 1)
    again = all_fits(kept, base)
    assert (evidence.call_count, mode.call_count) == times
    for one, two, three in zip(plain, first, again, strict=True):
        assert same(one, two)
        assert same(one, three)
    # The negative control: from elsewhere it is another fit.
    moved = replace(base, evidence=replace(base.evidence, mode=replace(base.evidence.mode, sigma=base.local[0, :0])))
    kept.inference.fitted(base.supermodel, (), 1.001 * moved.local)
    assert evidence.call_count == times[0] + 1


@pytest.mark.slow
def test_what_slopes_predict_of_curves_is_found_once(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = identified(task)
    search, base = prepared_search(task, found, [], quiet, tmp_path)
    probes = predicted.PROBES[:2]
    weigh = counted(monkeypatch, laplace_inference.MarginalLikelihood, "of")
    looks = [predicted.look_at(search, base, found, tuple(PORTS), probes)]
    times = weigh.call_count
    assert times
    looks.append(predicted.look_at(search, base, found, tuple(PORTS), probes))
    assert weigh.call_count == times
    first, second = ([(one.gain, one.probe, one.curve) for one in each.predicted] for each in looks)
    assert first == second
    # Where a curve is followed all the same, it begins with the slopes that an uninterrupted search has.
    ends = [free_form._bent(search, base, each.predicted[0]) for each in looks]
    assert same(*ends)


def test_laws_of_one_name_are_told_by_their_source(tmp_path: Path) -> None:
    """Names of composed laws are those of their forms: the same form over another range is another law."""
    context = SearchContext((), (), (), np.array([[10]]), {})
    inference = LaplaceInference(context, {}, cast(Any, SimpleNamespace(words=[])), tmp_path)
    jobs = []
    for module in ("one", "other", "one"):
        law = type("Law", (), {"name": "guide.law", "__module__": module})
        jobs.append(Counted(Refit(np.ones((1, 1)), 1.0)))
        inference._recalled("fitted", cast(Any, SimpleNamespace(effects=(law,), sensitivities=None)), (), jobs[-1])
    assert [job.times for job in jobs] == [1, 1, 0]


@dataclass(frozen=True)
class Begun:
    """What of a search a chain of linearisations asks for."""

    folder: Path
    linearisation: Linearisation = AS_BEGUN
    base: Any = field(default_factory=lambda: SimpleNamespace(fit=Refit(np.zeros((1, 1)), 0.0)))

    def recalled(self, what: str, parent: Any, about: object, job: Callable[[], Any]) -> Callable[[], Any]:
        return partial(Journal(self.folder).recall, what, job)


@pytest.mark.parametrize("came", [True, False])
def test_where_the_time_ended_readings_are_linearised_further_with_more_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, came: bool
) -> None:
    monkeypatch.setattr(linearised, "_as_kept", lambda search, fitted, *kept: ("kept", kept))
    search, fitted = cast(Any, Begun(tmp_path)), cast(Any, SimpleNamespace(evidence=1.0))
    job = Mock(side_effect=lambda search, fitted: (replace(search), fitted, came))
    assert linearised_once(search, fitted, job)[1] is fitted
    there = linearised_once(search, fitted, job)
    assert job.call_count == (1 if came else 2)
    assert (there[0] == "kept") == came
    # What ends before there is anything to go on with is told.
    late = Mock(side_effect=OutOfTimeError)
    with pytest.raises(OutOfTimeError):
        linearised_once(cast(Any, Begun(tmp_path / "gone")), fitted, late)


@pytest.mark.slow
def test_readings_that_were_linearised_anew_are_so_where_they_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, search, base = begin(tmp_path, 2)
    evidence = counted(monkeypatch, laplace_inference, "laplace_evidence")
    descents = [counted(monkeypatch, module, "refit") for module in (inputs, linearised)]
    anew = counted(monkeypatch, linearisation, "sensitivities_of")

    def calls() -> tuple[int, int]:
        return evidence.call_count, sum(each.call_count for each in descents)

    def chain(search: Search) -> tuple[Search, LaplaceFit]:
        return inputs.linearised_where_records_differ(search, base)

    def rest(there: Search, found: LaplaceFit) -> tuple[Search, LaplaceFit, LaplaceFit]:
        seen = inputs.confirmed(there, found, found, lead=True)
        assert seen is not None
        return seen.search, seen.found, seen.parent

    plain = [chain(search)]
    often, plain_rest = anew.call_count, rest(*plain[0])
    assert often > 2
    folders = [tmp_path / name for name in ("whole", "interrupted")]
    for folder in folders:
        folder.mkdir()
    whole, cut = (search.with_inference(search.inference.kept_in(folder)) for folder in folders)
    before = calls()
    rest(*chain(whole))
    asked = np.subtract(calls(), before)
    # The negative control: nothing of another journal.
    before = calls()
    chain(cut)
    first = np.subtract(calls(), before)
    assert first.all()
    before, linearised_before = calls(), anew.call_count
    there, found = chain(cut)
    assert calls() == before
    assert anew.call_count == linearised_before + 1
    resumed = rest(there, found)
    assert np.array_equal(first + np.subtract(calls(), before), asked)
    assert there.linearisation.reactions is not None
    assert same(found, plain[0][1])
    assert there.inference.common_noise.words == plain[0][0].inference.common_noise.words
    for one, other in ((there, plain[0][0]), (resumed[0], plain_rest[0])):
        mine, others = one.base.supermodel.sensitivities, other.base.supermodel.sensitivities
        assert mine is not None
        assert others is not None
        assert np.array_equal(mine.offset, others.offset)
        assert np.array_equal(mine.downweight, others.downweight)
        assert all(np.array_equal(a.rows, b.rows) for a, b in zip(mine.records, others.records, strict=True))
        assert np.array_equal(one.base.fit.local, other.base.fit.local)
        assert one.base.fit.cost == other.base.fit.cost
    assert all(same(a, b) for a, b in zip(resumed[1:], plain_rest[1:], strict=True))
    before = calls()
    rest(*chain(cut))
    assert calls() == before
