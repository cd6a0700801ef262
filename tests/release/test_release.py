"""Wheel and sdist install into an empty environment outside the checkout, and what was installed is what runs.

Tools of building make the wheel from the sdist, so the suite is run against the wheel alone: the other would be run
against the same files again.
"""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
BUILT = sorted((ROOT / "dist").glob("fibrefit-*.whl")) + sorted((ROOT / "dist").glob("fibrefit-*.tar.gz"))
#: Tests that use the program as a user does, from its public functions and commands.
SUITE = ("tests/test_api.py", "tests/cli", "tests/study", "tests/records", "tests/laws")


def said(words: list[str], cwd: Path, **more: str) -> str:
    """What a command prints; a failure shows all of it."""
    plain = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False, env=plain | more)
    assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def test_something_was_built() -> None:
    assert [path.suffix for path in BUILT] == [".whl", ".gz"], "make dist comes first"


@pytest.fixture(scope="module", params=BUILT, ids=lambda path: path.suffix)
def installed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the programs of an empty environment into which one of the two was installed."""
    place = tmp_path_factory.mktemp("installed")
    venv.create(place / "env", with_pip=True)
    programs = place / "env" / ("Scripts" if sys.platform == "win32" else "bin")
    said([str(programs / "python"), "-m", "pip", "install", "--quiet", str(request.param)], place)
    return programs


def files_of(environment: Path) -> set[str]:
    """What was installed of the package, below its folder."""
    where = "import fibrefit, pathlib; print(pathlib.Path(fibrefit.__file__).parent)"
    package = Path(said([str(environment / "python"), "-c", where], environment).strip())
    return {path.relative_to(package).as_posix() for path in package.rglob("*") if path.suffix not in {"", ".pyc"}}


def test_all_of_the_package_is_there(installed: Path) -> None:
    here = {path.relative_to(ROOT / "fibrefit") for path in (ROOT / "fibrefit").rglob("*") if path.suffix != ".pyc"}
    studies = {Path("shipped_studies") / path.relative_to(ROOT / "configs") for path in (ROOT / "configs").rglob("*")}
    expected = {path.as_posix() for path in here | studies if path.suffix} | {"glossary.md"}
    assert files_of(installed) == expected


def test_it_is_used_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    program = str(installed / "fibrefit")
    assert "Commands" in said([program, "--help"], tmp_path)
    said([program, "init", "demo"], tmp_path)
    assert "stiffness" in said([program, "fit", "demo", "--starts", "4"], tmp_path)
    where = "import fibrefit; print(fibrefit.__file__, *fibrefit.examples(), fibrefit.example('drop_series'))"
    printed = said([str(installed / "python"), "-c", where], tmp_path)
    assert str(installed.parent) in printed
    assert str(ROOT) not in printed
    assert "drop_series" in printed
    assert said([program, "glossary", "gap"], tmp_path).startswith("Residuals and noise")


def test_nothing_is_required_that_is_not_there(installed: Path, tmp_path: Path) -> None:
    assert "No broken requirements" in said([str(installed / "python"), "-m", "pip", "check"], tmp_path)


@pytest.mark.parametrize(("shell", "holds"), [("bash", "complete"), ("zsh", "compdef"), ("fish", "complete")])
def test_shells_complete_its_words(installed: Path, tmp_path: Path, shell: str, holds: str) -> None:
    script = said([str(installed / "fibrefit")], tmp_path, _FIBREFIT_COMPLETE=f"{shell}_source")
    assert holds in script


def test_pipx_runs_it_without_installing(tmp_path: Path) -> None:
    venv.create(tmp_path / "env", with_pip=True)
    python = str(tmp_path / "env" / ("Scripts" if sys.platform == "win32" else "bin") / "python")
    said([python, "-m", "pip", "install", "--quiet", "pipx"], tmp_path)
    places = {"PIPX_HOME": str(tmp_path / "home"), "PIPX_BIN_DIR": str(tmp_path / "programs")}
    words = [python, "-m", "pipx", "run", "--spec", str(BUILT[0]), "fibrefit"]
    assert said([*words, "--version"], tmp_path, **places).startswith("fibrefit ")
    said([*words, "init", "demo"], tmp_path, **places)
    assert (tmp_path / "demo" / "study.toml").is_file()


DRAWN = """
import warnings
import arviz_stats, fibrefit
with warnings.catch_warnings():
    warnings.simplefilter("ignore", FutureWarning)
    import arviz_plots
tree = fibrefit.load_result("posterior").to_datatree()
print("elpd", arviz_stats.loo(tree).elpd)
for plot in (arviz_plots.plot_trace_dist, arviz_plots.plot_forest, arviz_plots.plot_ess):
    plot(tree, var_names=["stiffness", "friction"], backend="matplotlib").savefig(f"{plot.__name__}.png")
arviz_plots.plot_ppc_dist(tree, var_names=["force"], num_samples=10, backend="matplotlib").savefig("plot_ppc_dist.png")
"""


@pytest.mark.parametrize("installed", BUILT[:1], indirect=True, ids=lambda path: path.suffix)
def test_arviz_draws_a_posterior_by_the_extra(installed: Path, tmp_path: Path) -> None:
    said([str(installed / "python"), "-m", "pip", "install", "--quiet", f"{BUILT[0]}[arviz]"], tmp_path)
    said([str(installed / "fibrefit"), "init", "demo"], tmp_path)
    said([str(installed / "fibrefit"), "sample", "demo", "--out", "posterior", "--figures", "none"], tmp_path)
    assert "elpd" in said([str(installed / "python"), "-c", DRAWN], tmp_path)
    assert all(path.stat().st_size > 5000 for path in tmp_path.glob("*.png"))
    assert len(list(tmp_path.glob("*.png"))) == 4


@pytest.mark.parametrize("installed", BUILT[:1], indirect=True, ids=lambda path: path.suffix)
def test_the_suite_passes_against_it(installed: Path, tmp_path: Path) -> None:
    python = str(installed / "python")
    said([python, "-m", "pip", "install", "--quiet", f"{BUILT[0]}[test]"], tmp_path)
    # Only the tests and what they read: the package itself must come from the environment.
    for name in ("tests", "configs", "data_schemas", "docs", "notebooks", "pyproject.toml", "README.md"):
        (tmp_path / name).symlink_to(ROOT / name)
    said([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-o", "pythonpath=", *SUITE], tmp_path)
