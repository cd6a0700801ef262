"""Noise that grows with the load: predictions and error bars of readings are told with the noise of each of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.fitting.residuals import _gaps
from fibrefit.fitting.uncertainty import Freedom
from fibrefit.problem.statement.layout import Layout
from fibrefit.study.summaries.results import ChannelGap, PredictedChannel
from fibrefit.workflow.groups_in_common import reading_errors, within_records
from fibrefit.workflow.prediction import predict
from fibrefit.workflow.prediction.files import _channel
from fibrefit.workflow.prediction.judge import limit
from fibrefit.workflow.prediction.predicted import Predicted

NUMBER = 4000
QUIET = 0.1
GROWING = QUIET * np.linspace(1.0, 6.0, NUMBER)
CONSTANT = np.full(NUMBER, QUIET)
CAUSES = ("noise", "model", "values")
FREEDOM = Freedom(3.0)


def a_problem(noise: np.ndarray, measured: np.ndarray | None = None) -> Any:
    """One record of one channel, the last reading of which is masked."""
    weight = 1.0 / noise
    weight[-1] = 0.0
    measured = np.zeros(NUMBER) if measured is None else measured
    observations = SimpleNamespace(
        weight={"force": weight[None]},
        measured={"force": measured[None]},
        experiment=SimpleNamespace(count=np.array([NUMBER])),
    )
    model = SimpleNamespace(rig=SimpleNamespace(channels=("force",)), parameters=())
    return SimpleNamespace(model=model, layout=Layout((), ("r.csv",)), observations=observations)


def predicted(noise: np.ndarray, model: float = 0.0, values: float = 0.0) -> Predicted:
    """Readings off their prediction by all that makes them uncertain: noise, what the model lacks, errors of values."""
    random = np.random.default_rng(4)
    size = np.sqrt(noise**2 + model**2 + values**2)
    problem = a_problem(noise, size * random.standard_normal(NUMBER))
    rms = float(np.sqrt(np.mean(problem.observations.measured["force"][0, :-1] ** 2)))
    gap = ChannelGap.against_noise(QUIET, rms, "N")
    seen = SimpleNamespace(gap={"force": gap}, motion=SimpleNamespace(readings={"force": np.zeros((1, NUMBER))}))
    parts = {
        cause: (of / noise)[None, None] ** 2
        for cause, of in zip(CAUSES, (noise, np.full(NUMBER, model), np.full(NUMBER, values)), strict=True)
    }
    known, held = (
        SimpleNamespace(gaps={}, names=("a", "b", "c")),
        SimpleNamespace(task=SimpleNamespace(problem=problem)),
    )
    return Predicted(cast(Any, None), (), *cast(Any, (known, held, seen)), None, parts, {"force": FREEDOM}, 0.0)


def told(found: Predicted) -> tuple[PredictedChannel, float, float]:
    channel, (ratio, most) = _channel(found, 0, "force")
    return channel, ratio, most


def test_the_noise_of_a_reading_is_its_own_and_the_quietest_where_nothing_was_measured() -> None:
    noise = predicted(GROWING).noise[0, 0]
    np.testing.assert_allclose(noise[:-1], GROWING[:-1])
    assert noise[-1] == pytest.approx(QUIET)


@pytest.mark.parametrize("noise", [CONSTANT, GROWING], ids=["constant", "growing"])
@pytest.mark.parametrize(("model", "values"), [(0.0, 0.0), (0.2, 0.05)])
def test_readings_are_as_far_off_as_their_own_noise_has_them(noise: np.ndarray, model: float, values: float) -> None:
    channel, ratio, most = told(predicted(noise, model, values))
    assert ratio == pytest.approx(1.0, abs=0.05)
    assert channel.expected == pytest.approx(np.sqrt(np.mean(noise[:-1] ** 2) + model**2 + values**2))
    assert channel.inside == pytest.approx(0.95, abs=0.02)
    assert most > 1.0


def test_constant_noise_is_told_as_one_number() -> None:
    found = predicted(CONSTANT, 0.2, 0.05)
    square = np.mean([part[0, 0, :-1] for part in found.parts.values()], axis=1).sum()
    channel, _, most = told(found)
    assert channel.expected == pytest.approx(QUIET * np.sqrt(square), rel=1e-12)
    np.testing.assert_allclose(found.sigma(*CAUSES)[0, 0], QUIET * np.sqrt(square))
    shares = {cause: part[0, 0][None] for cause, part in found.parts.items()}
    counted = (np.arange(NUMBER) < NUMBER - 1)[None]
    assert most == pytest.approx(limit(shares, counted, FREEDOM), rel=1e-12)


def test_what_a_model_lacks_is_no_larger_where_the_noise_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predict, "Problem", lambda model, layout, data: a_problem(GROWING))
    monkeypatch.setattr(predict, "predictive_slopes", lambda *given: np.zeros((1, 1, NUMBER, 0)))
    known: Any = SimpleNamespace(
        names=(), covariance=np.zeros((0, 0)), gaps={"force": ChannelGap.against_noise(0.3, 0.5, "N")}, differences={}
    )  # fmt: skip
    task: Any = SimpleNamespace(problem=a_problem(GROWING))
    held: Any = SimpleNamespace(task=task, local=None)
    found = predicted(GROWING)
    parts, freedom = predict._expected(task, held, known)
    lacking = Predicted(found.study, (), known, held, found.seen, None, parts, freedom, 0.0).sigma("model")
    np.testing.assert_allclose(lacking, 0.4)


def test_error_bars_of_readings_are_those_of_the_values_at_any_noise() -> None:
    """A reading that moves by 3 N for a change of 1 of a value which is known to 0.01."""
    problem = a_problem(GROWING)
    weight = problem.observations.weight["force"]
    linear = SimpleNamespace(slopes=3.0 * weight[:, None, :, None])
    problem.layout = SimpleNamespace(size=1, local=lambda values: values, local_columns=np.array([[0]]))
    problem.evaluate = lambda local: (linear, None)
    found: Any = SimpleNamespace(
        problem=problem, values=np.ones(1), covariance=np.array([[1e-4]]), gap={"force": SimpleNamespace(unit="N")}
    )  # fmt: skip
    told = reading_errors(found)
    error, noise = (told[f"force_{what}"].values[0] for what in ("error", "noise"))
    np.testing.assert_allclose(error[:-1], 0.03)
    assert np.isnan(error[-1])
    np.testing.assert_allclose(noise[:-1], GROWING[:-1])
    assert noise[-1] == pytest.approx(QUIET)


def test_a_perfect_model_has_a_gap_of_one_at_any_noise() -> None:
    """Each reading is as far off as its own noise has it."""
    problem = a_problem(GROWING)
    problem.observations.measured["force"][0] = GROWING * np.random.default_rng(4).standard_normal(NUMBER)
    problem.model.pieces = None
    task: Any = SimpleNamespace(problem=problem, units={"force": "N"})
    gap, of_records = _gaps(task, {"force": np.zeros((1, NUMBER))})
    for one in (gap["force"], of_records["r.csv"]["force"]):
        assert one.ratio == pytest.approx(1.0, abs=0.05)
        assert one.noise == pytest.approx(np.sqrt(np.mean(GROWING[:-1] ** 2)))


def test_what_a_short_record_is_filled_up_with_is_no_prediction() -> None:
    problem: Any = SimpleNamespace(observations=SimpleNamespace(experiment=SimpleNamespace(count=np.array([3, 5]))))
    for readings in (np.ones((2, 5)), np.ones((4, 2, 5)), np.ones((1, 4, 2, 5))):
        kept = within_records(problem, readings)
        assert np.isfinite(kept[..., 0, :3]).all()
        assert np.isnan(kept[..., 0, 3:]).all()
        assert np.isfinite(kept[..., 1, :]).all()
