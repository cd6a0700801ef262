"""What a study states of noise is its size: its colour is that of the rests, and without any is not known."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting.checks import check as judged
from fibrefit.fitting.residuals import readings_at_rest, spectrum
from fibrefit.problem import formulation
from fibrefit.problem.diagnose.motion import Motion, ResidualSet
from fibrefit.problem.noise.readings import largest_load, louder_under_load
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_residuals
from fibrefit.problem.task import Task
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.rigs.signals.rest import rests
from tests.fitting import made

SAMPLES = 8000
STATED = f'[noise]\nforce = "{made.NOISE["force"]} N"\nposition = "{1e3 * made.NOISE["position"]} mm"'
CHANNELS = ("force", "position")
UNRESTED = {c: Noise(size**2 / (0.5 * made.RATE), 0.0, 0.0, 0) for c, size in made.NOISE.items()}
"""Of records without a rest."""


@pytest.fixture(scope="module")
def drops() -> list[made.Made]:
    """Two drops of 4 s in noise of which half the amplitude is pink."""
    return made.records(share=0.5, seed=3, samples=SAMPLES)


@pytest.fixture(scope="module")
def stated(tmp_path_factory: pytest.TempPathFactory, drops: list[made.Made]) -> Task:
    return made.task(tmp_path_factory.mktemp("stated"), drops, more=STATED)


@pytest.fixture(scope="module")
def noise() -> np.ndarray:
    """What a perfect model leaves of such drops, in units of the noise."""
    random = np.random.default_rng(5)
    rows = [[made.coloured(SAMPLES, 0.5, random) for _ in CHANNELS] for _ in made.LIFTS]
    return np.array(rows)


def left(task: Task, residuals: np.ndarray) -> ResidualSet:
    whole = np.zeros((len(residuals), 2, task.problem.observations.weight["force"].shape[1]))
    whole[..., :SAMPLES] = residuals
    fitted = dict(zip(CHANNELS, noise_of_residuals(task.problem, whole), strict=True))
    nothing = Motion(np.zeros(whole[:, 0].shape, dtype=int), {}, np.zeros(len(whole), dtype=bool), {})
    rests = readings_at_rest(task)
    return ResidualSet(task.problem, whole, nothing, task.noise, fitted, rests, task.noise_given)


def test_its_colour_is_that_of_the_rests_and_its_size_what_is_stated(
    stated: Task, drops: list[made.Made], tmp_path: Path
) -> None:
    plain = made.task(tmp_path, drops)
    assert plain.stated_over_rest == {}
    for channel in CHANNELS:
        known, shown = stated.noise[channel], plain.noise[channel]
        assert known.rms(SAMPLES / made.RATE, made.RATE) == pytest.approx(made.NOISE[channel], rel=1e-3)
        assert known.pink / known.white == pytest.approx(shown.pink / shown.white)
        assert known.samples == shown.samples > 0
        factor = stated.stated_over_rest[channel]
        for (here, _), (there, _) in zip(
            readings_at_rest(stated)[channel], readings_at_rest(plain)[channel], strict=True
        ):
            np.testing.assert_allclose(here, factor * there)


def test_residuals_that_are_that_noise_pass(stated: Task, noise: np.ndarray) -> None:
    check = judged("residual_spectrum", spectrum(left(stated, noise)))
    assert check.passed, fit_sentence(check)
    # As if its size said that it is white, it is none.
    as_white = dataclasses.replace(left(stated, noise), noise=UNRESTED, rests={}, stated=())
    assert not judged("residual_spectrum", spectrum(as_white)).passed
    # Nor are residuals noise that hold a slow wave besides.
    wave = np.sin(2.0 * np.pi * 20.0 * np.arange(SAMPLES) / made.RATE)
    check = judged("residual_spectrum", spectrum(left(stated, noise + wave)))
    assert not check.passed
    assert "times that of the noise at rest of the stated size" in fit_sentence(check)


def test_without_a_rest_only_its_power_in_all_is_judged(stated: Task, noise: np.ndarray) -> None:
    check = judged("residual_spectrum", spectrum(dataclasses.replace(left(stated, noise), noise=UNRESTED, rests={})))
    assert check.passed, fit_sentence(check)
    assert "stated noise of force and position has no known spectrum" in fit_sentence(check)
    wave = 1.5 * np.sin(2.0 * np.pi * 20.0 * np.arange(SAMPLES) / made.RATE)
    loud = judged(
        "residual_spectrum", spectrum(dataclasses.replace(left(stated, noise + wave), noise=UNRESTED, rests={}))
    )
    assert not loud.passed
    assert "times that of the stated noise; chance allowed for" in fit_sentence(loud)


def test_coarse_steps_are_seen_whether_noise_is_stated_or_not(drops: list[made.Made], tmp_path: Path) -> None:
    step = 1e-4
    coarse = [made.replace(one, position=step * np.round(one.channels["position"] / step)) for one in drops]
    for number, more in enumerate(("", STATED)):
        steps = made.task(tmp_path / str(number), coarse, more=more).steps
        assert set(steps) == {"position"}
        np.testing.assert_allclose(steps["position"].size, step, rtol=1e-6)


def test_noise_grows_with_the_load_from_what_is_stated(
    drops: list[made.Made], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where readings show that it doubles up to the largest load."""
    monkeypatch.setattr(formulation, "growth_with_load", lambda traces, channel: 1.0)
    weight = np.asarray(made.task(tmp_path, drops, more=STATED).problem.observations.weight["force"])
    noise = 1.0 / weight[:, :SAMPLES]
    assert noise.min() == pytest.approx(made.NOISE["force"], rel=0.01)
    assert noise.max() == pytest.approx(2.0 * made.NOISE["force"], rel=0.01)


def test_what_rests_show_has_grown_with_their_load(
    drops: list[made.Made], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A weight that hangs at rest: readings there are as noisy as they are, and those without load less."""
    monkeypatch.setattr(formulation, "growth_with_load", lambda traces, channel: 1.0)
    task = made.task(tmp_path, drops)
    weight = np.asarray(task.problem.observations.weight["force"])
    still = [1.0 / weight[r, : len(t.times)][rest] for r, t in enumerate(task.traces) for rest in rests(t)]
    seen = task.noise["force"].rms(task.traces[0].duration, task.traces[0].rate)
    assert np.sqrt(np.mean(np.concatenate(still) ** 2)) == pytest.approx(seen, rel=1e-6)
    assert 1.0 / weight.max() < 0.99 * seen


def _slow(values: np.ndarray) -> float:
    """Standard deviation of means over 25 ms."""
    return float(values[: len(values) // 50 * 50].reshape(-1, 50).mean(axis=1).std())


def test_rests_under_a_load_are_taken_back_to_no_load_without_the_load_itself(tmp_path: Path) -> None:
    """A load is read with noise: a factor that follows the readings and acts on the load too takes slow noise away."""
    task = made.task(tmp_path, made.records(seed=4, samples=SAMPLES))
    largest = largest_load(task.traces, "force")
    louder = [louder_under_load(trace, "force", 2.0, largest) for trace in task.traces]
    weight = np.zeros_like(np.asarray(task.problem.observations.weight["force"]))
    for row, more in zip(weight, louder, strict=True):
        row[: len(more)] = 1.0 / more
    growing: Any = SimpleNamespace(
        traces=task.traces, noise=task.noise, stated_over_rest={},
        problem=SimpleNamespace(model=task.problem.model, observations=SimpleNamespace(
            weight={**task.problem.observations.weight, "force": weight})),
    )  # fmt: skip
    whole = [(trace.channels["force"][rest], more[rest]) for trace, more in zip(task.traces, louder, strict=True)
             for rest in rests(trace)]  # fmt: skip
    found = readings_at_rest(growing)["force"]
    loaded = [(values, more, here) for (values, more), (here, _) in zip(whole, found, strict=True) if values.mean() > 5]
    assert loaded
    for values, more, here in loaded:
        assert here.mean() == pytest.approx(0.0, abs=0.05 * here.std())
        assert here.std() == pytest.approx(values.std() / more.mean(), rel=0.02)
        slow, quieter, with_load = (_slow(one) for one in (values / more.mean(), here, values / more))
        assert quieter == pytest.approx(slow, rel=0.05)
        assert with_load < 0.8 * slow  # the control
