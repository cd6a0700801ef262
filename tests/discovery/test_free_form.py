"""Probes fitted to records into which a curve was planted, and to records that hold none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.declarations import HELD
from fibrefit.discovery.curves import free_form, predicted
from fibrefit.discovery.curves.curves import drawn
from fibrefit.discovery.curves.free_form import (
    FittedCurve,
    _followed,
    _held,
    probe_all,
)
from fibrefit.discovery.curves.predicted import WALKS, PromisedCurve, _prepared, look_at
from fibrefit.discovery.curves.probes import (
    PROBES,
    Curve,
    ForceErrorOfForce,
    FrictionOfPosition,
    FrictionOfSpeed,
    PositionErrorOfPosition,
    TensionOfRate,
)
from fibrefit.discovery.curves.variables import in_motion, range_of
from fibrefit.discovery.engine.common_noise import common_noise_of
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.priors import Heights
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search import inputs
from fibrefit.discovery.search.linearised import About
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import set_up
from fibrefit.fitting.result import Identification
from fibrefit.laws.ports import PORTS
from fibrefit.problem.formulation import formulate
from fibrefit.problem.inputs.errors_in_variables import input_errors, no_errors
from fibrefit.problem.inputs.sensitivities import sensitivities_of
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.study.summaries.discovery import FreeCurve
from fibrefit.workflow.prepare import read_records
from tests.discovery.made import BASE, identified

DRIVE = Path(__file__).parents[2] / "configs" / "drive_series" / "study.toml"
SURE = 4.0
"""Standard errors by which a height may be off: once in two hundred tests of eighty heights."""
USUAL = 1.4
"""Root mean square of so many heights over their standard errors, at most: it is hardly ever more by chance."""
NOISE = 0.02
"""Share by which the gap that noise leaves may differ from 1, with forty knots to fit it and six thousand samples."""
SIZE = 0.25
"""Share of itself by which the size of a planted curve may be off: a few times its error where forty knots are free."""
PLANTED = ((ForceErrorOfForce, 0.8), (PositionErrorOfPosition, 4e-5), (FrictionOfPosition, 0.4))


@pytest.fixture(scope="module")
def found(task: Task) -> Identification:
    """Where the records have been."""
    return identified(task)


def begun_at(task: Task, probes: Sequence[type[Curve]] = ()) -> Search:
    layout = task.problem.layout
    start = {name: np.full(len(layout.records), BASE[name]) for name in layout.names if name in BASE}
    search = set_up(replace(task, start=layout.pack(start)), None, probes, lambda what, share: None)
    # What is planted has white noise, of the level the weights stand for.
    weights, band = task.problem.observations.weight, 0.5 / float(np.diff(task.traces[0].times).mean())
    white = [Noise(float(weights[c].max()) ** -2 / band, 0.0, 0.0, 1000) for c in task.problem.model.rig.channels]
    common_noise = common_noise_of(search.base.supermodel, white)
    return search.with_inference(LaplaceInference(search.context, search.inference.reference, common_noise))


def planted(task: Task, found: Identification, probe: type[Curve], heights: np.ndarray) -> Task:
    """The records a model with a curve would make, with white noise."""
    base = begun_at(task, (probe,)).base
    layout, local = base.supermodel.problem.layout, base.fit.local.copy()
    ends = range_of(probe.variable, in_motion(found)[probe.variable][0])
    for name, value in zip(("low", "high", *probe.heights), (*ends, *heights), strict=True):
        local[:, layout.names.index(f"{probe.name}.{name}")] = value
    return measured_of(task, base.supermodel, local, 4)


def measured_of(task: Task, supermodel: Supermodel, local: np.ndarray, seed: int) -> Task:
    """The records that a model would make at values of each record, with white noise."""
    layout, data = supermodel.problem.layout, task.problem.observations
    values = layout.pack({name: local[:, j] for j, name in enumerate(layout.names)})
    said = supermodel.problem.predict(layout.local(jnp.asarray(values)), supermodel.problem.observations.experiment)
    random = np.random.default_rng(seed)
    measured = {
        channel: readings + random.standard_normal(readings.shape) / data.weight[channel].max()
        for channel, readings in said.items()
    }
    return replace(task, problem=replace(task.problem, observations=data._replace(measured=measured)))


def probed(task: Task, found: Identification, worth: float) -> tuple[list[FittedCurve], tuple[FreeCurve, ...]]:
    search = begun_at(task)
    supermodel, context = search.base.supermodel, search.context
    fit = refit(supermodel, context.subset(()), search.base.fit.local, context.whole)
    curves = probe_all(search, search.inference.fitted(supermodel, (), fit.local), found, worth)
    return curves, drawn(curves, found)


def scores(curve: FreeCurve, heights: np.ndarray) -> np.ndarray:
    """Differences from what was planted over their standard errors, but for the level."""
    off, errors = np.array(curve.heights) - heights, np.array(curve.std_errors, dtype=float)
    errors = np.where(np.isfinite(errors), errors, np.inf)
    return (off - np.average(off, weights=errors**-2)) / errors


@pytest.mark.parametrize(("probe", "size"), [*PLANTED[:2], pytest.param(*PLANTED[2], marks=pytest.mark.slow)])
def test_a_planted_curve_is_found_within_its_errors(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch, probe: type[Curve], size: float
) -> None:
    # Wrong curves with forty knots take long to fit: a few rivals do.
    monkeypatch.setattr(predicted, "PROBES", (FrictionOfSpeed, TensionOfRate, probe))
    heights = size * np.sin(np.linspace(0.0, 2.0 * np.pi, probe.knots))
    curves, shown = probed(planted(task, found, probe, heights), found, NAMED)
    assert curves[0].probe is probe
    assert [curve.gain for curve in curves] == sorted((curve.gain for curve in curves), reverse=True)
    assert all(curve.gain > NAMED for curve in curves)
    best = shown[0]
    assert (best.variable, best.says, best.height_unit) == (probe.variable, probe.says, probe.unit)
    off = scores(best, heights)
    assert np.max(np.abs(off)) < SURE
    assert np.sqrt(np.mean(off**2)) < USUAL
    # What was planted is there, and in its full size where the records see it.
    with_it = best.model_copy(update={"heights": tuple(heights)})
    wave, seen = (scores(one, np.zeros(probe.knots)) for one in (with_it, best))
    assert np.sum(wave * seen) / np.sum(wave**2) == pytest.approx(1.0, abs=SIZE)
    assert best.gap_after == pytest.approx(1.0, abs=NOISE)


@pytest.mark.slow
def test_a_planted_curve_gains_as_much_about_itself(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is linear in its inputs is the same about any model: the gain is that over the model without the curve."""
    probes = (FrictionOfSpeed, TensionOfRate)
    monkeypatch.setattr(predicted, "PROBES", probes)
    monkeypatch.setattr(
        free_form, "linearised_about", lambda search, fitted, lead: About(search, fitted.supermodel, fitted.local)
    )
    heights = 0.02 * np.sin(np.linspace(0.0, 2.0 * np.pi, FrictionOfSpeed.knots))
    search = begun_at(planted(task, found, FrictionOfSpeed, heights))
    parent = search.inference.fitted(search.base.supermodel, (), search.base.fit.local)
    ends: list[Any] = []

    def held(found: Sequence[Any], worth: float, gain: Any) -> Sequence[Any]:
        ends.extend((end.fitted.log - parent.log, gain(end)) for end in found)
        return found

    monkeypatch.setattr(free_form, "_held", held)
    assert probe_all(search, parent, found, NAMED)
    (first, about_itself), *_ = ends
    assert first > NAMED
    assert about_itself == pytest.approx(first, abs=0.5)


@pytest.mark.slow
def test_no_curve_is_worth_anything_where_there_is_nothing(task: Task, found: Identification) -> None:
    """The negative control: each costs more than it gains, and is level within its errors."""
    nothing = np.zeros(ForceErrorOfForce.knots)
    made = planted(task, found, ForceErrorOfForce, nothing)
    assert probed(made, found, NAMED) == ([], ())
    curves, shown = probed(made, found, -1e9)
    assert {curve.probe for curve in curves} == set(PROBES)
    assert max(curve.gain for curve in curves) < 1.0
    for one in shown:
        assert np.max(np.abs(scores(one, np.zeros(len(one.knots))))) < SURE, one.says
        assert one.gap_after == pytest.approx(1.0, abs=NOISE), one.says


def test_slopes_of_the_parent_predict_what_simulated_ones_do(task: Task, found: Identification) -> None:
    search, probe = (
        begun_at(planted(task, found, FrictionOfPosition, 0.4 * np.ones(FrictionOfPosition.knots))),
        PROBES[0],
    )
    parent = search.inference.fitted(search.base.supermodel, (), search.base.fit.local)
    supermodel = supermodel_of(search.task, PROBES)
    start = _prepared(
        supermodel, parent, PROBES, {name: range_of(name, of) for name, (of, _) in in_motion(found).items()}
    )
    names = tuple(f"{probe.name}.{height}" for height in probe.heights)
    known, simulated = (
        search.inference.secant(supermodel, search.inference.slopes(parent)),
        search.inference.secant(supermodel),
    )
    for walk in WALKS:
        curve = Heights(names, probe.size, walk)
        predicted = partial(search.inference.predicted_evidence, curve, parent, supermodel, start)
        one, other = predicted(known), predicted(simulated)
        assert one == pytest.approx(other, abs=0.01)


def test_the_time_spent_near_the_knots_is_that_of_the_motion(found: Identification, task: Task) -> None:
    moving = found.motion.phase != HELD
    within = np.arange(moving.shape[1]) < np.asarray(task.problem.observations.experiment.count)[:, None]
    step = float(np.diff(task.traces[0].times).mean())
    for values, seconds in in_motion(found).values():
        assert len(values) == len(seconds)
        assert seconds.sum() == pytest.approx(step * np.sum(moving & within), rel=1e-9)


@pytest.mark.slow
def test_a_curve_on_a_driven_rig_begins_at_the_cost_of_the_model_it_is_put_on(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(DRIVE)
    study = study.model_copy(update={"records": study.records[:1]})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    random = np.random.default_rng(0)
    coefficients = {
        name: 0.5 * random.standard_normal(wave.shape) for name, wave in no_errors(input_errors(task)).items()
    }
    supermodel = supermodel_of(task, (), sensitivities_of(task, task.start, coefficients))
    local, whole = np.asarray(task.problem.layout.local(task.start)), task.counts[-1]
    cost = float(supermodel.costs(local, whole).sum())
    parent = cast(Any, SimpleNamespace(effects=(), supermodel=supermodel, local=local, log=0.0))
    began: list[float] = []

    def begins(search: Any, parent: Any, probe: type[Curve], begun: tuple[Supermodel, np.ndarray, Any]) -> None:
        began.append(float(begun[0].costs(begun[1], whole).sum()))

    monkeypatch.setattr(predicted, "_predicted", begins)
    monkeypatch.setattr(predicted, "in_motion", lambda found: {"speed": (np.array([0.0, 0.1]), np.ones(2))})
    inference = SimpleNamespace(slopes=lambda parent: None)
    search = cast(Any, SimpleNamespace(task=task, tell=lambda what, share: None, inference=inference))
    assert probe_all(search, parent, cast(Any, SimpleNamespace(problem=task.problem)), NAMED) == []
    assert began == [pytest.approx(cost, rel=1e-4)]


def test_over_a_variable_that_keeps_its_value_there_is_no_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[tuple[type[Curve], ...]]()

    def composed(task: Any, probes: Any, sensitivities: Any) -> Any:
        asked.append(probes)
        raise LookupError

    monkeypatch.setattr(predicted, "supermodel_of", composed)
    still, moving = np.zeros(9), np.linspace(-1.0, 1.0, 9)
    monkeypatch.setattr(
        predicted, "in_motion", lambda found: {"speed": (moving, still), "stretch rate": (still, still)}
    )
    problem = SimpleNamespace(model=SimpleNamespace(rig=RIGS["fibre_mass"]))
    parent = SimpleNamespace(effects=(), supermodel=SimpleNamespace(sensitivities=None))
    search, found = SimpleNamespace(task=None), SimpleNamespace(problem=problem)
    with pytest.raises(LookupError):
        look_at(cast(Any, search), cast(Any, parent), cast(Any, found), tuple(PORTS))
    assert {probe.variable for probe in asked[0]} == {"speed"}


def test_curves_predicted_far_less_than_one_gains_are_not_followed() -> None:
    """The most promising two first; of the others only what may do better than these."""
    gains = {"a": 900.0, "b": 800.0, "c": 700.0, "d": 120.0}
    followed: list[str] = []

    def with_curve(parent: Any, supermodel: Any, start: Any, probe: Any, *rest: Any) -> Any:
        followed.append(probe.name)
        return SimpleNamespace(log=gains[probe.name])

    inference = SimpleNamespace(with_curve=with_curve)
    search = cast(Any, SimpleNamespace(inference=inference, tell=lambda what, share: None))
    search.recalled = lambda what, parent, about, job, own: job
    named = {name: cast(Any, SimpleNamespace(name=name)) for name in gains}
    predicted = [
        PromisedCurve(gain, named[name], cast(Any, None), cast(Any, None), np.zeros(1), lambda: cast(Any, None))
        for name, gain in gains.items()
    ]
    ends = _followed(search, cast(Any, SimpleNamespace(log=0.0)), predicted[::-1])
    assert sorted(followed) == ["a", "b", "c"]
    assert sorted(end.fitted.log for end in ends) == [700.0, 800.0, 900.0]


@pytest.mark.parametrize(("gains", "kept"), [((30.0, 1.0), "ab"), ((2.0, 9.0), "b"), ((2.0, 4.0), "")])
def test_curves_whose_gain_is_gone_about_themselves_are_none(gains: tuple[float, ...], kept: str) -> None:
    asked: list[str] = []

    def gain(end: Any) -> float:
        asked.append(end)
        return gains["ab".index(end)]

    assert "".join(cast(Any, _held(cast(Any, "ab"), 5.0, gain))) == kept
    # The first that holds is enough.
    assert asked == (["a"] if kept == "ab" else ["a", "b"])


def expected(strength: float, **more: Any) -> Any:
    """A mode by a strength in units of its prior's standard deviation."""
    unknowns = SimpleNamespace(names=("offset",), mean=np.zeros(1), precision=np.eye(1))
    return SimpleNamespace(unknowns=unknowns, place=SimpleNamespace(z=np.array([strength]), **more))


@pytest.mark.parametrize(
    ("led", "strength", "gain"), [(-500.0, 1.0, 60.0), (55.0, 1.0, 5.0), (80.0, 1.0, -20.0), (-500.0, 9.0, 20.0)]
)
def test_a_curve_gains_what_leads_its_parent_nowhere_and_is_no_surprise_of_its_values(
    led: float, strength: float, gain: float
) -> None:
    """The parent is fitted from where the curve ended, the curve level and its range as it was. What a strength that is
    far from usual costs beforehand, a curve that takes its place does not explain."""
    begun: list[Any] = []

    def fitted(supermodel: Any, effects: Any, local: np.ndarray, sigma: Any, eta: Any) -> Any:
        begun.append((supermodel, effects, local.tolist(), sigma, eta))
        return SimpleNamespace(log=led)

    probe: Any = SimpleNamespace(name="probe.any", heights=("h1", "h2"))
    supermodel: Any = SimpleNamespace(names=("friction", "probe.any.h1", "probe.any.low", "probe.any.h2"))
    mode: Any = expected(1.0, eta="eta")
    mode.sigma = "sigma"
    there: Any = SimpleNamespace(
        log=60.0, supermodel=supermodel, local=np.array([[3.0, 0.1, -1.0, 0.2]]), evidence=SimpleNamespace(mode=mode)
    )
    search: Any = SimpleNamespace(inference=SimpleNamespace(fitted=fitted))
    end, before = free_form._End(probe, there, cast(Any, None)), SimpleNamespace(mode=expected(strength))
    parent = SimpleNamespace(log=0.0, effects=("one",), evidence=before)
    assert free_form._gain_over_led(search, cast(Any, parent), end) == gain
    assert begun == [(supermodel, ("one",), [[3.0, 0.0, -1.0, 0.0]], "sigma", "eta")]


@pytest.mark.parametrize(
    ("gain", "loss", "ratio", "there"),
    [(20.0, 7.0, 1.0, True), (20.0, 9.0, 1.0, False), (200.0, 9.0, 1.0, True), (20.0, 0.0, 5.0, False)],
)
def test_a_curve_that_a_record_or_the_scatter_of_the_scores_speaks_against_is_none(
    monkeypatch: pytest.MonkeyPatch, gain: float, loss: float, ratio: float, there: bool
) -> None:
    """As an effect: where it acts, it makes no record far less probable."""
    parent = Ended(0.0, 0.0, ratio)
    end = free_form._End(ForceErrorOfForce, cast(Any, Ended(gain, loss, ratio)), cast(Any, None))
    monkeypatch.setattr(free_form, "_followed", lambda search, parent, promising: [end])
    monkeypatch.setattr(inputs, "occam", lambda before, after: 0.0)
    looks = cast(Any, SimpleNamespace(predicted=(), price=0.0))
    search: Any = SimpleNamespace(inference=SimpleNamespace(overdispersion=lambda parent, one, names: one.ratio))
    assert bool(free_form._worthy(search, cast(Any, parent), looks, NAMED, NAMED)) is there


@dataclass(frozen=True)
class Ended:
    """Where a curve led."""

    log: float
    loss: float
    ratio: float
    effects: tuple[Any, ...] = ()
    evidence: Any = None

    def largest_loss_to(self, other: Any) -> float:
        return self.loss

    def with_log(self, log: float, divided_off: float = 0.0) -> Ended:
        return replace(self, log=log)
