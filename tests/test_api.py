"""The package as Python sees it."""

from __future__ import annotations

import importlib
import inspect
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import fibrefit

ROOT = Path(__file__).resolve().parents[1]
SERIES = ROOT / "configs" / "drop_series"
HEAVY = {"jax", "numpy", "pandas", "matplotlib", "scipy", "pydantic", "pint", "h5py"}


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert run(f"import sys, fibrefit; print(sorted({HEAVY!r} & set(sys.modules)))").strip() == "[]"


def test_a_study_is_loaded_without_jax() -> None:
    code = "import sys, fibrefit; fibrefit.load_study('configs/drop_series'); print('jax' in sys.modules)"
    assert run(code).strip() == "False"


def test_a_fit_and_its_files_load_no_sampler_and_no_pictures() -> None:
    """Statistics of SciPy, which the sampler loads, cost a third of a second; pictures come after the report."""
    code = "import sys, fibrefit.workflow.fit, fibrefit.workflow.fit_files, fibrefit.fitting.identify, fibrefit.store"
    not_wanted = {"emcee", "scipy.stats", "matplotlib"}
    assert run(f"{code}; print(sorted({not_wanted!r} & set(sys.modules)))").strip() == "[]"


@pytest.mark.parametrize("name", fibrefit.__all__)
def test_what_is_offered_is_documented_with_an_example(name: str) -> None:
    offered = getattr(fibrefit, name)
    text = inspect.getdoc(offered) or ""
    assert not inspect.signature(offered).parameters or "Parameters" in text
    assert "Returns\n-------" in text
    assert not inspect.signature(offered).parameters or "Raises\n------" in text
    assert "Examples\n--------" in text
    assert ">>>" in text
    for parameter in inspect.signature(offered).parameters:
        told = text.partition("Parameters\n----------")[2].partition("\n\nReturns")[0]
        types = re.search(rf"^\**(\w+, \**)*{parameter}\b.* : (.*)$", told, re.MULTILINE)
        assert types is not None, parameter
        assert types.group(2) != "optional", f"{parameter} has no type"


RESULTS = re.findall(r"autoclass:: (\S+)", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", RESULTS)
def test_methods_of_results_say_what_they_take_and_return(name: str) -> None:
    module, _, of = name.rpartition(".")
    result = getattr(importlib.import_module(module), of)
    for called in [one for one in dir(result) if not one.startswith(("_", "write"))]:
        method = inspect.getattr_static(result, called)
        method = method.fget if isinstance(method, property) else method
        if not inspect.isfunction(method) or not method.__module__.startswith("fibrefit"):
            continue
        text, taken = inspect.getdoc(method) or "", set(inspect.signature(method).parameters) - {"self"}
        assert text, called
        assert all(re.search(rf"^\**(\w+, \**)*{one}\b.* : ", text, re.MULTILINE) for one in taken), called
        assert not taken or "Returns\n-------" in text or inspect.signature(method).return_annotation == "None", called


def test_no_package_has_the_name_of_what_is_offered() -> None:
    packages = {path.name for path in Path(fibrefit.__file__).parent.iterdir() if path.is_dir()}
    assert not packages & {*fibrefit.__all__, "simulate", "discover"}
    code = "import fibrefit, fibrefit.fitting.identify, fibrefit.laws.contract; print(callable(fibrefit.effects))"
    assert run(code).strip() == "True"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'fitt'"):
        fibrefit.fitt  # noqa: B018


def test_a_study_and_a_record_are_read() -> None:
    study = fibrefit.load_study(SERIES, ['rig.weight_mass="3.1 kg"'])
    assert study.records[0].weight_mass == pytest.approx(3.1)
    record = fibrefit.read_record(SERIES / "drop_5mm_90deg.csv", rate=None)
    assert set(record.channels) == {"force", "position"}


def test_the_version_is_that_of_the_package() -> None:
    assert fibrefit.__version__ == version("fibrefit")


def test_types_are_shipped() -> None:
    assert (ROOT / "fibrefit" / "py.typed").exists()


def test_distinguish_and_confuse_are_one() -> None:
    assert fibrefit.distinguish is fibrefit.confuse
