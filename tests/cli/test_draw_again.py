"""``fibrefit show --figures``: a saved result is drawn again; and what figures a run writes."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import figure_formats
from tests.cli.conftest import Run
from tests.study.test_summaries import EXAMPLES


def saved(folder: Path, schema: str) -> str:
    folder.mkdir()
    (folder / "summary.json").write_text(EXAMPLES[schema].model_dump_json(by_alias=True))
    return str(folder)


def test_a_batch_is_drawn_again_in_any_format(fibrefit: Run, tmp_path: Path) -> None:
    done = fibrefit("show", saved(tmp_path / "batch", "fibrefit/batch/1"), "--figures", "pdf,svg", "--out", "drawn")
    assert (done.code, done.out.split()) == (0, [str(Path("drawn/parameters.pdf")), str(Path("drawn/parameters.svg"))])
    assert Path("drawn/parameters.pdf").read_bytes().startswith(b"%PDF")
    assert "The folder drawn did not exist and was made." in done.err


def test_figures_of_each_result_have_a_folder_of_their_own(fibrefit: Run, tmp_path: Path) -> None:
    """Where none is named: pictures of one result do not take the place of another's."""
    folders = [saved(tmp_path / name, "fibrefit/batch/1") for name in ("first", "second")]
    done = [fibrefit("show", folder, "--figures", "png").out.strip() for folder in folders]
    done.append(fibrefit("show", str(Path(folders[0], "summary.json")), "--figures", "svg").out.strip())
    expected = ["figures-first/parameters.png", "figures-second/parameters.png", "figures-first/parameters.svg"]
    assert done == [str(Path(name)) for name in expected]
    assert all(Path(name).is_file() for name in expected)
    assert "[figures-RESULT" in " ".join(fibrefit("show", "--help").out.split())


def test_pictures_that_are_there_are_replaced_only_if_asked(fibrefit: Run, tmp_path: Path) -> None:
    words = ("show", saved(tmp_path / "batch", "fibrefit/batch/1"), "--figures", "png", "--out", "drawn")
    Path("drawn").mkdir()
    picture = Path("drawn/parameters.png")
    picture.write_bytes(b"of another result")
    done = fibrefit(*words)
    assert done.code == 2
    said = "exists already; expected a folder without figures of these names."
    assert done.err == f"error: {picture}: {said} Add --force to replace it, or name another --out.\n"
    assert picture.read_bytes() == b"of another result"
    assert fibrefit(*words, "--force").code == 0
    assert picture.read_bytes() != b"of another result"


def test_force_alone_is_refused(fibrefit: Run, tmp_path: Path) -> None:
    done = fibrefit("show", saved(tmp_path / "batch", "fibrefit/batch/1"), "--force")
    assert (done.code, "--force: no figures to put there; expected --figures" in done.err) == (2, True)


def test_a_result_without_its_arrays_says_that_it_cannot_be_drawn(fibrefit: Run, tmp_path: Path) -> None:
    done = fibrefit("show", saved(tmp_path / "fit", "fibrefit/fit/1"), "--figures", "png")
    assert done.code == 2
    assert "cannot be drawn from what was saved" in done.err
    assert "Run it again" in done.err


@pytest.mark.parametrize(("text", "formats"), [("png", ("png",)), ("pdf, SVG,pdf", ("pdf", "svg")), ("none", ())])
def test_formats(text: str, formats: tuple[str, ...]) -> None:
    assert figure_formats(text) == formats


@pytest.mark.parametrize("text", ["", "jpg", "png,none", "pgn"])
def test_unknown_formats_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="expected png, pdf, svg, separated by commas, or none"):
        figure_formats(text)


def test_a_folder_that_cannot_be_made_is_told(fibrefit: Run, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    where = str(tmp_path / "file" / "figures")
    done = fibrefit("show", saved(tmp_path / "batch", "fibrefit/batch/1"), "--figures", "png", "--out", where)
    assert done.code == 2
    assert f"{where}: " in done.err
    assert "expected a folder that can be written" in done.err
