"""One small series and what is found in it, made once."""

from __future__ import annotations

import pytest

from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.problem.task import Task
from tests.fitting import made


@pytest.fixture(scope="session")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """Two drops with a logger's noise."""
    return made.task(tmp_path_factory.mktemp("made"), made.records(share=0.5, seed=3))


@pytest.fixture(scope="session")
def found(task: Task) -> Identification:
    """What a search from eight starts finds."""
    return identify(task, starts=made.STARTS)
