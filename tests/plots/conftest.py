"""Something to draw: a fit of two drops whose records have a hole, and the search it came from."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.problem.task import Task
from tests.fitting import made


@pytest.fixture(scope="session")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    first, second = made.records(share=0.5, seed=3)
    force = first.channels["force"].copy()
    force[600:640] = np.nan
    return made.task(tmp_path_factory.mktemp("drawn"), [made.replace(first, force=force), second])


@pytest.fixture(scope="session")
def found(task: Task) -> Identification:
    return identify(task, starts=made.STARTS)
