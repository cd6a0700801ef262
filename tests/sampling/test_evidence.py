"""The weight of modes against integrals that are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.sampling import evidence as several
from fibrefit.sampling.chains import run_ensembles
from fibrefit.sampling.evidence import LOOK_STEPS, Evidence, bridge, distinct, sample_modes
from fibrefit.sampling.settings import Settings
from tests.sampling.targets import around, correlated, normal, target

SURE = 4.0
"""Standard errors."""


def test_a_normal_density_has_its_integral() -> None:
    centre, covariance = correlated(6, 1)
    density = normal(centre, covariance, log_mass=-1234.5)
    approximation = around(density, centre, covariance)
    assert approximation.log_evidence == pytest.approx(-1234.5, abs=1e-8)
    course = run_ensembles(target(density, 6), approximation, Settings(seed=1))
    found = bridge(density, course, seed=0)
    assert found is not None
    assert found.error < 0.02
    assert abs(found.log_value + 1234.5) < max(SURE * found.error, 1e-6)


def test_a_skewed_density_has_its_integral_where_laplace_errs() -> None:
    def gamma(x: np.ndarray) -> np.ndarray:
        """Logarithms of two gamma variables of shape 3: the integral is Gamma(3)^2 = 4."""
        return np.sum(3.0 * x - np.exp(x), axis=1)

    approximation = around(gamma, np.full(2, np.log(3.0)), np.eye(2) / 3.0)
    course = run_ensembles(target(gamma, 2), approximation, Settings(seed=1))
    found = bridge(gamma, course, seed=0)
    assert found is not None
    assert abs(found.log_value - np.log(4.0)) < SURE * found.error
    assert abs(approximation.log_evidence - np.log(4.0)) > SURE * found.error


def test_modes_are_weighed() -> None:
    a, b = np.zeros(2), np.array([30.0, 0.0])
    parts = normal(a, np.eye(2), np.log(0.3)), normal(b, np.diag([4.0, 0.25]), np.log(0.7))
    density = lambda x: np.logaddexp(parts[0](x), parts[1](x))  # noqa: E731
    found = [
        around(density, a, np.eye(2)),
        around(density, b, np.diag([4.0, 0.25])),
        around(density, b + 0.1, np.eye(2)),
    ]
    assert len(distinct(found)) == 2
    modes = sample_modes(target(density, 2), distinct(found), Settings(seed=0))
    assert [round(mode.approximation.centre[0]) for mode in modes] == [30, 0]
    assert modes[0].weight == pytest.approx(0.7, abs=0.02)
    assert modes[0].weight + modes[1].weight == pytest.approx(1.0)


def test_a_mode_of_no_weight_is_named_and_not_sampled() -> None:
    parts = normal(np.zeros(2), np.eye(2)), normal(np.array([30.0, 0.0]), np.eye(2), np.log(1e-6))
    density = lambda x: np.logaddexp(parts[0](x), parts[1](x))  # noqa: E731
    found = distinct([around(density, np.array([c, 0.0]), np.eye(2)) for c in (0.0, 30.0)])
    modes = sample_modes(target(density, 2), found, Settings(seed=0))
    assert modes[1].course is None
    assert modes[1].weight < 1e-4
    assert modes[0].weight > 0.9999


def test_two_starts_of_one_mode_are_not_counted_twice() -> None:
    """Both approximations are poor, so they look distinct; the walkers show that they are not."""
    density = normal(np.zeros(2), np.eye(2))
    poor = [around(density, np.array([c, 0.0]), 0.09 * np.eye(2)) for c in (-1.0, 1.0)]
    modes = sample_modes(target(density, 2), distinct(poor), Settings(seed=0))
    assert len(modes) == 2
    assert [mode.absorbed for mode in modes] == [False, True]
    assert modes[0].weight == 1.0


def test_a_mode_that_laplace_underrates_is_sampled_like_any_other() -> None:
    """Two modes of one width by Laplace; the second has wide shoulders that hold nine tenths of the mass."""
    near, far, broad = (
        normal(np.array([place, 0.0]), width * np.eye(2), np.log(mass))
        for place, width, mass in ((0.0, 1.0, 0.1), (60.0, 1.0, 0.09), (60.0, 36.0, 0.81))
    )
    density = lambda x: np.logaddexp(near(x), np.logaddexp(far(x), broad(x)))  # noqa: E731
    found = [around(density, np.array([place, 0.0]), np.eye(2)) for place in (0.0, 60.0)]
    found = [found[0], replace(found[1], log_density=found[0].log_density - 1.0)]
    settings = Settings(seed=0)
    modes = sample_modes(target(density, 2), found, settings)
    assert round(modes[0].approximation.centre[0]) == 60
    assert modes[0].weight == pytest.approx(0.9, abs=0.05)
    assert modes[0].course is not None
    assert modes[0].course.converged
    assert modes[0].course.mixing.ess_bulk.min() > settings.ess


def test_a_look_at_a_mode_has_chains_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the whole run are longer: a run that goes on would weigh the mode by them, and do something else."""
    seen: list[tuple[str, int]] = []

    def run(aim: Any, approximation: Any, settings: Settings, file: Path, progress: Any) -> Any:
        seen.append((file.name, settings.max_steps))
        points = np.broadcast_to(approximation.centre, (1, 1, 1, 2))
        return SimpleNamespace(points=points, kept=points)

    monkeypatch.setattr(several, "run_ensembles", run)
    monkeypatch.setattr(
        several, "bridge", lambda density, course, seed: Evidence(float(course.points[..., 0].max()), 0.1)
    )
    density = normal(np.zeros(2), np.eye(2))
    found = [replace(around(density, np.array([place, 0.0]), np.eye(2)), log_density=0.0) for place in (0.0, 60.0)]
    modes = sample_modes(target(density, 2), found, Settings(seed=0), tmp_path / "chains.npz")
    assert seen == [("chains.npz", 4000), ("chains-2-look.npz", LOOK_STEPS), ("chains-2.npz", 4000)]
    assert modes[0].approximation.centre[0] == 60.0


def test_a_run_of_one_step_has_laplace_to_tell_of() -> None:
    density = normal(np.zeros(2), np.eye(2), -3.0)
    modes = sample_modes(target(density, 2), [around(density, np.zeros(2), np.eye(2))], Settings(seed=0, max_steps=1))
    assert modes[0].course is not None
    assert modes[0].evidence.log_value == pytest.approx(-3.0)
    assert not np.isfinite(modes[0].evidence.error)
