"""How fast the posterior is: densities a second, effective draws a second, growth with walkers and records.

Against: emcee with a pool of one process a core over SciPy's LSODA, on the same records.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emcee import EnsembleSampler

from fibrefit.problem.task import Task
from fibrefit.sampling.density.log_posterior import LogPosterior, noise_priors
from fibrefit.sampling.density.prior import Density, Priors
from fibrefit.sampling.sample import (
    ChainStart,
    PosteriorRequest,
    batched,
    coordinates_of,
    noise_model_of,
    sample_posterior,
)
from fibrefit.sampling.settings import Settings
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.benchmarks import scipy_drop
from tests.sampling.drops import fitted

STUDY = Path(__file__).resolve().parents[2] / "configs" / "drop_series" / "study.toml"
ASKED = 60.0
"""Times the log densities a second of the SciPy way."""


@pytest.fixture(scope="module")
def measured() -> tuple[Task, np.ndarray]:
    task = task_of(load_study(STUDY))
    return task, fitted(task)


def median_of(run: Callable[[], object], times: int) -> float:
    """Seconds of the middle one of several runs."""
    run()
    took = []
    for _ in range(times):
        began = time.perf_counter()
        run()
        took.append(time.perf_counter() - began)
    return float(np.median(took))


def density(task: Task, values: np.ndarray, noise: str) -> tuple[Callable[[np.ndarray], np.ndarray], np.ndarray]:
    linear = jax.tree.map(np.asarray, task.problem.linearised(jnp.asarray(values)))
    model = noise_model_of(task, task.problem, linear, PosteriorRequest(noise))
    priors = Priors.of(task.problem.layout, task.problem.model, values, {})
    noise_prior = Density.of(noise_priors(model.likelihood))
    posterior = LogPosterior(task.problem, priors.density, noise_prior, model.likelihood)
    return batched(posterior, 16), coordinates_of(posterior, values)


def rate(evaluate: Callable[[np.ndarray], np.ndarray], point: np.ndarray, count: int) -> float:
    """Log densities a second, one thread a core, as the ensembles use them."""
    points = point + 1e-6 * np.random.default_rng(0).standard_normal((count, len(point)))
    cores = os.cpu_count() or 1
    with ThreadPoolExecutor(cores) as pool:
        seconds = median_of(lambda: list(pool.map(evaluate, np.array_split(points, cores))), 5)
    return count / seconds


def scipy_rate(task: Task, values: np.ndarray, steps: int = 1) -> float:
    """Log densities a second of emcee with a process pool over LSODA."""
    scipy_drop.RECORDS[:] = [
        scipy_drop.Record(
            t.times,
            t.channels["force"],
            t.channels["position"],
            t.conditions["weight_mass"],
            t.conditions["inclination"],
            t.conditions["lift"],
        )
        for t in task.traces
    ]
    centre = np.concatenate([np.log(values[:3]), values[3:]])
    random = np.random.default_rng(0)
    start = centre + 1e-6 * random.standard_normal((32, len(centre)))
    # The workers need the records and nothing of JAX, whose threads a fork would not survive.
    with multiprocessing.get_context("spawn").Pool(
        os.cpu_count(), scipy_drop.receive, (list(scipy_drop.RECORDS),)
    ) as pool:
        sampler = EnsembleSampler(32, len(centre), scipy_drop.log_density, pool=pool)
        state = sampler.run_mcmc(start, 1)
        began = time.perf_counter()
        sampler.run_mcmc(state, steps)
        return 32 * steps / (time.perf_counter() - began)


def test_densities_a_second(measured: tuple[Task, np.ndarray]) -> None:
    task, values = measured
    slow = scipy_rate(task, values)
    print(f"\nlog densities a second, {len(task.traces)} records of about {len(task.traces[0].times)} samples")
    print(f"  emcee, process pool, SciPy LSODA      {slow:9.1f}")
    found = {}
    for noise in ("white", "coloured", "autoregressive"):
        evaluate, point = density(task, values, noise)
        found[noise] = rate(evaluate, point, 128)
        print(f"  fibrefit, {noise:15}             {found[noise]:9.1f}   {found[noise] / slow:6.1f} times")
    assert found["white"] > ASKED * slow


def test_growth_with_walkers(measured: tuple[Task, np.ndarray]) -> None:
    task, values = measured
    evaluate, point = density(task, values, "coloured")
    print("\nlog densities a second by points at once")
    for count in (16, 64, 256, 1024):
        print(f"  {count:5d}  {rate(evaluate, point, count):9.1f}")


def test_growth_with_records() -> None:
    study = load_study(STUDY)
    print("\nlog densities a second by records, times the records")
    for count in (1, 2, 5):
        task = task_of(study.model_copy(update={"records": study.records[:count]}))
        evaluate, point = density(task, fitted(task), "coloured")
        found = rate(evaluate, point, 64)
        print(f"  {count:5d}  {found:9.1f}  {count * found:9.1f}")


def test_effective_draws_a_second(measured: tuple[Task, np.ndarray]) -> None:
    task, values = measured
    sample_posterior(task, ChainStart(values), PosteriorRequest(settings=Settings(max_steps=5)))
    began = time.perf_counter()
    found = sample_posterior(task, ChainStart(values), PosteriorRequest(settings=Settings(seed=1)))
    seconds = time.perf_counter() - began
    ess = float(min(found.course.mixing.ess_bulk.min(), found.course.mixing.ess_tail.min()))
    print(f"\nwhole way, warm: {seconds:.1f} s, of it chains {found.course.seconds:.1f} s; ", end="")
    print(f"{ess:.0f} effective draws, {ess / seconds:.1f} a second")
    assert found.status == "ok"
