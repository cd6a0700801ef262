"""Readings in coarse steps: a search weighs them by the step they lie in, with the programs it has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest

from fibrefit.discovery.engine.common_noise import common_noise_of, steps_at
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.supermodel import supermodel_of
from fibrefit.problem.inputs.sensitivities import StepLikelihood
from fibrefit.problem.noise.rounding import with_noise_before_rounding, with_steps
from fibrefit.problem.noise.whittle import noise_of_residuals
from fibrefit.problem.task import Task
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.discovery.conftest import DATA

STEPS = {"force [N]": 2.0, "position [mm]": 0.2}


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """The short drops, as a logger with coarse steps would have read them."""
    folder = tmp_path_factory.mktemp("coarse")
    for file in Path(DATA / "viscous").iterdir():
        if file.suffix == ".csv":
            table = pd.read_csv(file)
            for column, step in STEPS.items():
                table[column] = np.round(table[column] / step) * step
            table.to_csv(folder / file.name, index=False, float_format="%.6g")
    (folder / "study.toml").write_text((DATA / "viscous" / "study.toml").read_text(encoding="utf-8"), encoding="utf-8")
    return task_of(load_study(folder))


@pytest.mark.slow
def test_a_search_sees_both_readings_as_the_last_step_of_a_fit_does(coarse: Task) -> None:
    assert set(coarse.steps) == {"force", "position"}
    problem, values = coarse.problem, jnp.asarray(coarse.start)
    local, supermodel = np.asarray(problem.layout.local(values)), supermodel_of(coarse, ())
    shape = (len(local), 2, -1)
    fine = np.asarray(problem.residuals(values))
    np.testing.assert_allclose(
        np.asarray(supermodel.residuals(local, coarse.counts[-1])).reshape(shape), fine, rtol=1e-6, atol=1e-9
    )
    in_steps = steps_at(supermodel, local, coarse.counts[-1])
    assert in_steps is not None
    whole = with_noise_before_rounding(with_steps(problem, dict(coarse.steps)), local)
    for channel, known in whole.observations.steps.items():
        np.testing.assert_allclose(in_steps.steps[channel].noise, known.noise, rtol=1e-6)
    stepped = replace(supermodel, in_steps=in_steps)
    seen = np.asarray(stepped.residuals(local, coarse.counts[-1])).reshape(shape)
    np.testing.assert_allclose(seen, np.asarray(whole.residuals(values)), rtol=1e-6, atol=1e-9)
    place = supermodel.names.index("friction")
    columns, targets = np.array([place]), local[:, [place]] * (1.0 + 1e-6)
    change = np.asarray(stepped.rows(local, columns, targets, coarse.counts[-1]))[:, 1].reshape(shape)
    free = np.asarray(problem.layout.local_free)
    slopes = np.asarray(whole.linearised(values).slopes)[..., int(np.flatnonzero(free == place)[0])]
    there = slopes * (targets - local[:, [place]])[:, None]
    assert np.linalg.norm(change - there) < 1e-4 * np.linalg.norm(there)


def test_noise_before_rounding_is_settled_where_it_is_the_most_probable_one(coarse: Task) -> None:
    """About a place it is that found there; elsewhere, and of readings that are taken for fine ones, it is another."""
    supermodel, counts = supermodel_of(coarse, ()), coarse.counts[-1]
    local = np.asarray(coarse.problem.layout.local(jnp.asarray(coarse.start)))
    noise = [coarse.noise[channel] for channel in coarse.problem.model.rig.channels]
    context: Any = SimpleNamespace(whole=counts)
    away = local.copy()
    away[:, supermodel.names.index("position_zero")] += 1e-4

    def settled(in_steps: StepLikelihood | None, at: np.ndarray) -> bool:
        fitted: Any = SimpleNamespace(supermodel=supermodel, local=at)
        return LaplaceInference(context, {}, common_noise_of(supermodel, noise, in_steps)).settled_about(fitted)

    here = steps_at(supermodel, local, counts)
    assert settled(here, local)
    assert not settled(here, away)
    assert not settled(None, local)


def test_noise_of_coarse_channels_is_white_whatever_is_said_of_it(coarse: Task) -> None:
    supermodel, channels = supermodel_of(coarse, ()), coarse.problem.model.rig.channels
    steps = coarse.steps
    in_steps = StepLikelihood(channels, steps)
    common_noise = common_noise_of(supermodel, [coarse.noise[channel] for channel in channels], in_steps)
    residuals = np.random.default_rng(0).standard_normal(np.asarray(coarse.problem.residuals(coarse.start)).shape)
    found = noise_of_residuals(with_steps(supermodel.problem, dict(steps)), residuals)
    assert [noise.white for noise in common_noise.noise] == [noise.white for noise in found]
    white = np.asarray(common_noise.whitening.whiten_rows(jnp.asarray(residuals)[None])[0])
    counted = np.stack([np.asarray(w) > 0.0 for w in supermodel.problem.observations.weight.values()], axis=1)
    np.testing.assert_allclose(white[counted], residuals[counted], rtol=1e-6)
