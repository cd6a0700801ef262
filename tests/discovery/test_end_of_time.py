"""What is told where the time ended in the middle of a law, of a final fit, or of the first one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.core.declarations import Statement
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import Budget, OutOfTimeError, time_limit
from fibrefit.discovery import complete_law, conclusion
from fibrefit.discovery import discover as module
from fibrefit.discovery.curves.curves import with_law_over
from fibrefit.discovery.forward_selection import Limits
from fibrefit.discovery.laws import propose, told
from fibrefit.discovery.laws.told import HeldLaw
from fibrefit.fitting.checks import COMPLETION
from fibrefit.fitting.search.starts import NowhereYet
from tests.discovery.made import CURVES

NONE: Any = None
DRIVEN: Any = SimpleNamespace(noisy_inputs=("drive",))


@pytest.mark.parametrize("late", [True, False])
def test_a_law_that_the_time_did_not_suffice_to_fit_is_not_said_to_do_worse(
    monkeypatch: pytest.MonkeyPatch, late: bool
) -> None:
    nothing = SimpleNamespace(gain=0.0, ranked=[])
    monkeypatch.setattr(propose, "_composed", lambda *of: ["a law"])
    monkeypatch.setattr(propose, "effect_of_law", lambda law: SimpleNamespace(name=law))
    monkeypatch.setattr(propose, "supermodel_of", lambda *of: None)
    monkeypatch.setattr(propose, "_ranked", lambda *of: [])
    monkeypatch.setattr(propose, "Proposal", lambda *of, needed: nothing)
    monkeypatch.setattr(propose, "_about_the_best", lambda here, needed: here)
    parent: Any = SimpleNamespace(effects=(), log=0.0, supermodel=SimpleNamespace(sensitivities=None))
    curves: Any = [SimpleNamespace(gain=100.0)]
    given = SimpleNamespace(task=None)
    with time_limit(-1.0 if late else 100.0):
        if late:
            with pytest.raises(OutOfTimeError):
                propose.proposed(given, parent, curves)  # type: ignore[arg-type]
        else:
            assert propose.proposed(given, parent, curves) is None  # type: ignore[arg-type]


@dataclass(frozen=True)
class Told:
    """A finding as far as a law changes it."""

    after: Any
    reason: tuple[Statement, ...]
    proposed_law: Any
    unexplained: Any


@dataclass(frozen=True)
class Law:
    """A law over the first curve of `CURVES`, flat at the one value it has."""

    value: float
    curve: str = CURVES[0].says

    @property
    def heights(self) -> np.ndarray:
        return np.full(len(CURVES[0].knots), self.value)


class Curves(SimpleNamespace):
    """What is left, with its curves."""

    def model_copy(self, update: Any) -> Any:
        return Curves(**{**vars(self), **update})


def with_a_law(monkeypatch: pytest.MonkeyPatch, trouble: str | None, cut: bool, in_a_step: bool = False) -> Told:
    """A finding after its final fit, with the trouble that fit has, cut short or not."""
    check = SimpleNamespace(identifier=COMPLETION, passed=not cut)
    fit = SimpleNamespace(checks=[check], cut_short=in_a_step)
    monkeypatch.setattr(conclusion, "final_fit", lambda *of: fit)
    monkeypatch.setattr(conclusion, "takes_longer", lambda *of: 0.0)
    monkeypatch.setattr(conclusion, "trouble_of", lambda *of: trouble and Statement(trouble))
    monkeypatch.setattr(conclusion, "told_by_fit", lambda law, effect, after: replace(law, value=2.0))
    law: Any = told.ToldLaw(NONE, SimpleNamespace(names=("a.law",)), Law(1.0))  # type: ignore[arg-type]
    monkeypatch.setattr(told.ToldLaw, "effect", "a.law")
    begun: Any = Told("first", (), law.told, Curves(curves=CURVES))
    found: Any = conclusion._with_law(begun, law, NONE, 0, Budget(100.0))
    return found  # type: ignore[no-any-return]


def test_a_law_is_drawn_as_the_final_fit_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    found = with_a_law(monkeypatch, None, cut=False)
    assert found.proposed_law.value == 2.0
    over, *others = (one.law for one in found.unexplained.curves)
    assert set(over) == {2.0}
    assert others == [None] * len(others)


def test_a_law_that_loses_a_motion_is_neither_told_nor_drawn_and_the_curve_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = with_a_law(monkeypatch, "lost", cut=False)
    assert found.proposed_law is None
    assert [one.law for one in found.unexplained.curves] == [None] * len(CURVES)
    assert [one.identifier for one in found.reason] == ["lost", "curve_stays"]
    assert found.after == "first"


@pytest.mark.parametrize("in_a_step", [True, False])
def test_a_final_fit_that_was_cut_short_takes_no_law_away(monkeypatch: pytest.MonkeyPatch, in_a_step: bool) -> None:
    found = with_a_law(monkeypatch, "lost", cut=not in_a_step, in_a_step=in_a_step)
    assert found.proposed_law.value == 2.0
    assert found.reason == ()


def test_a_law_is_drawn_over_its_own_curve_alone() -> None:
    shown = with_law_over(CURVES, Law(3.0, CURVES[1].says))  # type: ignore[arg-type]
    assert [one.law is None for one in shown] == [one is not CURVES[1] for one in CURVES]


def test_records_that_tell_effects_apart_are_not_looked_for_beyond_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conclusion, "separating_experiment", lambda *of: pytest.fail("it was looked for"))
    search: Any = SimpleNamespace(tell=lambda *of: None)
    with time_limit(-1.0), pytest.raises(OutOfTimeError):
        conclusion._separated(search, ["a pair"])  # type: ignore[list-item]


@pytest.mark.parametrize(("elpd", "kept"), [(5.0, True), (-1.0, False)])
def test_a_law_without_what_it_makes_needless_is_held_against_left_out_records_once_more(
    monkeypatch: pytest.MonkeyPatch, elpd: float, kept: bool
) -> None:
    """By records left out beside the model that is told; where it does not hold there, nothing is needless."""
    both, alone = SimpleNamespace(effects=("a", "law")), SimpleNamespace(effects=("law",))
    bare = SimpleNamespace(effects=())
    inference = SimpleNamespace(without=lambda parent, rest: bare)
    there: Any = SimpleNamespace(search=SimpleNamespace(inference=inference, tell=lambda *of: None))
    there.parent = SimpleNamespace(effects=("a",))
    gaps = {id(bare): (9.0, 0.0), id(alone): (2.0, elpd)}

    def left_out(search: Any, one: Any, tell: Any) -> Any:
        gap, density = gaps[id(one)]
        return SimpleNamespace(gap=gap, elpd=np.array([density]))

    monkeypatch.setattr(told, "left_out", left_out)
    monkeypatch.setattr(complete_law, "pruned", lambda inference, law: alone)
    held: Any = HeldLaw(both, NONE, NONE, (3.0, 1.5), 7.0)  # type: ignore[arg-type]
    parent, found = complete_law._without_needless(there, held)
    assert (parent is bare) is (found.fit is alone) is kept
    assert (found.left_out, found.elpd_gain) == (((9.0, 2.0), elpd) if kept else ((3.0, 1.5), 7.0))


def test_a_search_that_ends_before_it_began_is_gone_on_with(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing was tried: what the first steps left in the journal is not thrown away as of a search that is over."""

    def late(*of: Any) -> None:
        raise OutOfTimeError

    before = SimpleNamespace(running=1.0, gap={"force": 1.0}, checks=[], problem=SimpleNamespace(n_measured=9))
    monkeypatch.setattr(module, "identify", lambda *of, **more: before)
    monkeypatch.setattr(module, "total", lambda gap: gap["force"])
    monkeypatch.setattr(module, "_started", late)
    effects: Any = [SimpleNamespace(name="a"), SimpleNamespace(name="b")]
    found = module.discover(DRIVEN, effects, Limits(seconds=60.0))
    assert found.verdict == "not_trusted"
    assert (found.untried, found.undone) == (("a", "b"), ("further",))


def test_a_time_in_which_no_start_comes_anywhere_is_refused_and_not_called_an_interruption(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def nowhere(*of: Any, **more: Any) -> None:
        raise NowhereYet

    monkeypatch.setattr(module, "identify", nowhere)
    says = "time: 2 s; expected enough for a start of the first fit to come anywhere"
    with pytest.raises(UsageError, match=says) as refused:
        module.discover(DRIVEN, [], Limits(seconds=2.0))
    assert "--time" in str(refused.value)
