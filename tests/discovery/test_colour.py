"""Gains by chance of an effect, against gains over noise that was drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fibrefit.discovery.engine.candidates import Hypothesis, absent_values, carried
from fibrefit.discovery.engine.noise_inflation import colour_of
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.engine.supermodel import Frame, frame_of
from fibrefit.discovery.engine.thresholds import colour, slowest
from fibrefit.effects.catalogue import find_effect
from fibrefit.problem.inputs.errors_in_variables import residuals
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.task import Task

VISCOUS = find_effect("guide.viscous_friction")
DRAWS = 400
#: Four standard errors of the mean of squares of so many normal draws, sqrt(2 / 400) each.
CHANCE = 4.0 * np.sqrt(2.0 / DRAWS)


@pytest.fixture(scope="module")
def hypothesis(task: Task) -> Hypothesis:
    """A weak viscous friction at the starting values."""
    frame = frame_of(task, (VISCOUS,))
    start = np.asarray(task.problem.layout.local(task.start))
    local = carried(frame, absent_values(frame, len(start)), Frame(task), start)
    local[:, frame.names.index("guide.viscous_friction.viscous_coefficient")] = 0.1
    return Hypothesis((VISCOUS,), Refit(local, 0.0, 0.0, {}, 0), frame)


def with_noise(task: Task, white: float, pink: float) -> Task:
    """The same task with noise of another colour."""
    return replace(task, noise={channel: Noise(white, pink, 0.0, 1000) for channel in task.noise})


def test_white_noise_has_no_colour(task: Task, hypothesis: Hypothesis) -> None:
    assert colour_of(with_noise(task, 1.0, 0.0), hypothesis, (VISCOUS,)) == pytest.approx(1.0, abs=1e-6)


def test_gains_over_drawn_noise_are_as_large_as_said(task: Task, hypothesis: Hypothesis) -> None:
    coloured = with_noise(task, 0.5, 8.0)
    said = colour_of(coloured, hypothesis, (VISCOUS,))
    assert said > 2.0
    assert np.mean(drawn_gains(coloured, hypothesis)) == pytest.approx(said, rel=CHANCE)


def drawn_gains(task: Task, hypothesis: Hypothesis) -> np.ndarray:
    """Fall of the sum of squares of noise alone with one more column, ``(DRAWS,)``: two least-squares fits each."""
    columns, last = _columns(task, hypothesis)
    random, size = np.random.default_rng(4), task.problem.observations.experiment.times.shape[1]
    channels = task.problem.model.rig.channels
    rows = []
    for _ in range(DRAWS):
        waves = np.zeros((len(task.traces), len(channels), size))
        for r, trace in enumerate(task.traces):
            count, rate = len(trace.times), 1.0 / float(np.diff(trace.times).mean())
            for c, channel in enumerate(channels):
                noise = task.noise[channel]
                waves[r, c, :count] = noise.draw(count, rate, random) / noise.rms(count / rate, rate)
        rows.append(waves.ravel())
    noise = np.array(rows).T
    fewer = np.delete(columns, last, axis=1)
    left = [noise - basis @ (basis.T @ noise) for basis in (np.linalg.qr(fewer)[0], np.linalg.qr(columns)[0])]
    return np.sum(left[0] ** 2, axis=0) - np.sum(left[1] ** 2, axis=0)


def _columns(task: Task, hypothesis: Hypothesis) -> tuple[np.ndarray, int]:
    """Differences of the residuals for every free value, scaled, and which belongs to the effect."""
    problem = hypothesis.frame.problem
    layout = problem.layout
    names = list(layout.names)
    values = layout.pack({name: hypothesis.fit.local[:, j] for j, name in enumerate(names)})
    here, columns = residuals(problem, {}, values, {}), []
    for i in range(layout.size):
        moved = values.copy()
        moved[i] += 1e-6 * max(abs(values[i]), 1e-3)
        columns.append((residuals(problem, {}, moved, {}) - here).ravel())
    scaled = np.array(columns).T
    scaled = scaled / np.linalg.norm(scaled, axis=0)
    return scaled, layout.free_names.index("guide.viscous_friction.viscous_coefficient")


def test_noise_is_strongest_where_an_effect_acts_most_slowly() -> None:
    white, pink = Noise(1e-4, 0.0, 0.0, 0), Noise(1e-4, 1e-2, 0.0, 0)
    rates = {"force": 2000.0, "position": 2000.0}
    assert slowest({"force": white, "position": white}, rates, 2.0) == 1.0
    both = {"force": white, "position": pink}
    # The channel that wanders counts by itself, and the longer a record, the more it wanders in it.
    assert slowest(both, rates, 2.0) > 2.0 * colour(both, rates, 2.0) > 2.0
    assert slowest(both, rates, 20.0) > 5.0 * slowest(both, rates, 2.0)
