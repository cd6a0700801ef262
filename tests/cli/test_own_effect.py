"""An effect of a user's own, in a file beside the study: fitted, reported, kept with the result."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Run

MINE = '''"""My guide."""
from typing import ClassVar

import jax

from fibrefit.laws.law import GuideLaw, quantity


class Brush(GuideLaw):
    """A brush that drags where the weight has not been yet.

    Law
    ---
    Force ``c_b v`` while ``u > 0``.

    Parameters
    ----------
    brush_coefficient : () in N s/m

    Valid range
    -----------
    Any.

    Source
    ------
    Mine.
    """

    name: ClassVar[str] = "guide.brush"
    brush_coefficient: jax.Array = quantity("N s/m", "drag of the brush", 5.0, lower=0.0)

    def force(self, position, velocity):
        return jax.numpy.where(position > 0.0, self.brush_coefficient * velocity, 0.0)
'''


@pytest.fixture
def mine(fibrefit: Run) -> Path:
    """The demonstration, with an effect of its own."""
    assert fibrefit("init", "study").code == 0
    folder = Path("study")
    (folder / "mine.py").write_text(MINE, encoding="utf-8")
    text = (folder / "study.toml").read_text(encoding="utf-8")
    assert "effects = []" in text
    text = text.replace("effects = []", 'effects = ["mine.py:Brush"]')
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return folder


def test_it_is_fitted_and_kept_with_the_result(fibrefit: Run, mine: Path) -> None:
    done = fibrefit("fit", str(mine), "--trust", "--starts", "2", "--out", "out", "--json")
    assert done.code in (0, 5), done.err
    document = done.document
    estimate = document["parameters"]["guide.brush.brush_coefficient"]
    assert estimate["unit"] == "N s/m"
    assert estimate["free"]
    assert any(path.endswith("mine.py") for path in document["provenance"]["inputs"])
    # The result's own study finds the file again from where it lies.
    assert "mine.py:Brush" in (Path("out") / "study.toml").read_text(encoding="utf-8")
    assert fibrefit("simulate", "out/study.toml", "--trust", "--out", "again").code == 0


def test_it_has_a_page(fibrefit: Run, mine: Path) -> None:
    page = fibrefit("effects", str(mine / "mine.py:Brush")).out
    assert "guide.brush" in page
    assert "drag of the brush" in page


def test_a_fault_in_it_is_the_users(fibrefit: Run, mine: Path) -> None:
    (mine / "mine.py").write_text("import nothing_of_the_kind", encoding="utf-8")
    done = fibrefit("fit", str(mine), "--trust")
    assert done.code == 4
    assert "mine.py fails with ModuleNotFoundError" in done.err
    assert "Traceback" not in done.err
