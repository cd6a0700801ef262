"""``fibrefit report``: folders in, one page out."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.report.test_page import PNG
from tests.study.test_summaries import EXAMPLES


@pytest.fixture
def results(tmp_path: Path) -> list[str]:
    """Folders of a fit and of a posterior."""
    made = []
    for name in ("fit", "posterior"):
        folder = tmp_path / name
        (folder / "figures").mkdir(parents=True)
        (folder / "summary.json").write_text(EXAMPLES[f"fibrefit/{name}/1"].model_dump_json(by_alias=True))
        for figure in ("overview", "record_drop_5mm", "corner"):
            (folder / "figures" / f"{figure}.png").write_bytes(PNG)
        made.append(str(folder))
    return made


def test_it_writes_one_page_and_says_where(fibrefit: Run, results: list[str]) -> None:
    done = fibrefit("report", *results)
    assert (done.code, done.out) == (0, "report.html\n")
    text = Path("report.html").read_text(encoding="utf-8")
    captions = [line for line in text.splitlines() if line.startswith("<figcaption>")]
    # The page of a fit begins with its overview, that of a posterior with its corner plot; records are drawn from data.
    assert captions == ["<figcaption>overview</figcaption>", "<figcaption>corner</figcaption>"]


def test_an_earlier_page_is_not_replaced_unasked(fibrefit: Run, results: list[str]) -> None:
    fibrefit("report", results[0], "--out", "page.html")
    before = Path("page.html").read_text(encoding="utf-8")
    done = fibrefit("report", results[1], "--out", "page.html")
    assert done.code == 2
    assert "page.html: exists already; expected a new file. Add --force to replace it" in done.err
    assert Path("page.html").read_text(encoding="utf-8") == before
    assert fibrefit("report", results[1], "--out", "page.html", "--force").code == 0


@pytest.mark.parametrize("there", ["file", "folder", "link", "dangling"])
def test_what_is_no_page_of_ours_is_not_replaced(fibrefit: Run, results: list[str], there: str) -> None:
    out, thesis = Path("page.html"), Path("thesis.html")
    thesis.write_text("mine", encoding="utf-8")
    if there == "file":
        thesis.rename(out)
    elif there == "folder":
        (out / "report.html").mkdir(parents=True)
    else:
        out.symlink_to(thesis if there == "link" else Path("nowhere.html"))
    done = fibrefit("report", results[0], "--out", "page.html", "--force")
    assert done.code == 2
    assert ("does not exist" if there == "dangling" else "is no page of this program") in done.err
    assert there == "folder" or (out if there == "file" else thesis).read_text(encoding="utf-8") == "mine"


def test_a_page_behind_a_link_is_written_through(fibrefit: Run, results: list[str]) -> None:
    fibrefit("report", results[0], "--out", "real.html")
    Path("page.html").symlink_to("real.html")
    assert fibrefit("report", results[1], "--out", "page.html", "--force").code == 0
    assert Path("page.html").is_symlink()
    assert Path("real.html").stat().st_size > 10_000


@pytest.mark.parametrize(("size", "there"), [(40, True), (0, True), (None, False)])
def test_a_figure_that_is_damaged_is_named(fibrefit: Run, results: list[str], size: int | None, there: bool) -> None:
    figure = Path(results[0], "figures", "overview.png")
    figure.write_bytes(figure.read_bytes()[:size])
    if not there:
        figure.unlink()
        figure.mkdir()
    done = fibrefit("report", results[0])
    assert done.code == 3
    got = "is damaged, or no picture" if there else "Is a directory"
    assert done.err == f"error: {figure}: {got}; expected a figure of a result. Remove that file.\n"
    assert not Path("report.html").exists()


def test_json_names_the_page(fibrefit: Run, results: list[str]) -> None:
    assert fibrefit("report", *results, "--out", "pages", "--json").document["file"] == str(Path("pages/report.html"))


def test_a_folder_without_a_result_is_refused(fibrefit: Run, tmp_path: Path) -> None:
    done = fibrefit("report", str(tmp_path))
    assert done.code == 3
    assert "no such file" in done.err
    assert not Path("report.html").exists()


def test_a_folder_that_had_to_be_made_is_said(fibrefit: Run, results: list[str]) -> None:
    done = fibrefit("report", results[0], "--out", "misspelt/pages/page.html")
    assert (done.code, done.out) == (0, "misspelt/pages/page.html\n")
    assert "The folder misspelt did not exist and was made." in done.err
    assert "made" not in fibrefit("report", results[0], "--out", "misspelt/again.html").err
    assert "The folder other did" in fibrefit("report", results[0], "--out", "other").err
