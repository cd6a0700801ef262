"""One small task and its fit, made once."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.problem.task import Task
from tests.sampling.drops import fitted, series, task_of


@pytest.fixture(scope="session")
def small() -> tuple[Task, np.ndarray]:
    """A task with half pink noise and its fit."""
    task = task_of(series(np.random.default_rng(1)))
    return task, fitted(task)
