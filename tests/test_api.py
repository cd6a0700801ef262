"""The package as Python sees it."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import fibrefit
import fibrefit.workflow as workflow

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


@pytest.mark.parametrize("name", fibrefit.__all__)
def test_what_is_offered_is_documented_with_an_example(name: str) -> None:
    offered = getattr(fibrefit, name)
    text = inspect.getdoc(offered) or ""
    assert inspect.isfunction(offered)
    assert "Parameters" in text
    assert "Returns" in text
    assert ">>>" in text


def test_packages_never_take_the_place_of_what_is_offered() -> None:
    code = (
        "import fibrefit; import fibrefit.fit.identify, fibrefit.simulate.model; from fibrefit.fit import judge;"
        "print(fibrefit.fit.__name__, fibrefit.simulate.__name__, callable(fibrefit.fit), judge.__name__)"
    )
    assert run(code).split() == ["fit", "simulate", "True", "fibrefit.fit.judge"]


def test_other_names_can_still_be_set() -> None:
    code = "import fibrefit, types; fibrefit.mine = types; fibrefit.fit = len; print(fibrefit.fit([1]), fibrefit.mine)"
    assert run(code).startswith("1 <module")


def test_the_options_are_those_of_the_workflow() -> None:
    """All but how an interruption is heard of, which a person at a prompt or in a notebook has no need of."""
    here, there = inspect.signature(fibrefit.fit), inspect.signature(workflow.fit_study)
    assert [(p.name, p.default, p.kind) for p in here.parameters.values()] == [
        (p.name, p.default, p.kind) for p in there.parameters.values() if p.name != "stop"
    ]


def test_a_study_and_a_record_are_read() -> None:
    study = fibrefit.load_study(SERIES, ['rig.weight_mass="3.1 kg"'])
    assert study.records[0].weight_mass == pytest.approx(3.1)
    record = fibrefit.read_record(SERIES / "drop_5mm_90deg.csv", rate=None)
    assert set(record.channels) == {"force", "position"}


def test_types_are_shipped() -> None:
    assert (ROOT / "fibrefit" / "py.typed").exists()
