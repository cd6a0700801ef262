"""A small study on disk, and its fit, made once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from statsmodels.stats import multitest

from fibrefit.study import Study, load_study
from fibrefit.workflow.fit import Fit, fit_study
from tests.fitting import made


@pytest.fixture(scope="session", autouse=True)
def seldom_collected() -> Iterator[None]:
    """Holm's correction of statsmodels looks for garbage each time: half a second where many programs are compiled."""
    correct = multitest.multipletests

    def without(*given: Any, **how: Any) -> Any:
        with patch("gc.collect"):
            return correct(*given, **how)

    with patch.object(multitest, "multipletests", without):
        yield


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two drops as CSV files with their study."""
    where = tmp_path_factory.mktemp("series")
    made.study(where)
    made.write(where, made.records(share=0.5, seed=3))
    return where


@pytest.fixture(scope="session")
def study(folder: Path) -> Study:
    return load_study(folder)


@pytest.fixture(scope="session")
def fit(study: Study) -> Fit:
    return fit_study(study, starts=made.STARTS)


@pytest.fixture(scope="session")
def saved(fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files of the fit."""
    return fit.save(tmp_path_factory.mktemp("results") / "out")
