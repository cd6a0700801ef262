"""The site builds without a warning, and its pages hold what they promise."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS, JOURNAL = ROOT / "docs", ROOT / "tests" / "validation" / "journal"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *JOURNAL.glob("*.md")])
sys.path.insert(0, str(DOCS / "_ext"))

from command_pages import command_page  # noqa: E402
from effect_pages import write_effects  # noqa: E402
from schema_pages import result_page, study_page  # noqa: E402
from threshold_pages import FLOORS, files_of, threshold_page, thresholds_in  # noqa: E402

FETCHED = re.compile(r"""(?:<(?:script|img|iframe)\b[^>]*\bsrc|<link\b[^>]*\bhref)=["'](https?:[^"']+)""")
"""What a page asks the net for as it is opened."""
COUNTED = re.compile(r"\d+ of \d+")
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")


def test_every_key_of_a_study_has_a_row() -> None:
    page = study_page(ROOT / "data_schemas" / "study.schema.json")
    kinds = json.loads((ROOT / "data_schemas" / "study.schema.json").read_text(encoding="utf-8"))["$defs"]
    for name, kind in kinds.items():
        for key in kind.get("properties", ()):
            assert f"| `{key}` |" in page.partition(f"### {name}\n")[2].partition("\n### ")[0], f"{name}.{key}"


def test_every_kind_of_result_has_a_section() -> None:
    page = result_page(ROOT / "data_schemas")
    kinds = {path.name.partition(".")[0] for path in (ROOT / "data_schemas").glob("*.json")} - {"study"}
    assert all(f"## {kind}\n" in page for kind in kinds)
    assert "| `status` |" in page


def test_every_command_has_its_help() -> None:
    from fibrefit.cli.main import COMMANDS

    page = command_page()
    assert all(f"## {name}\n" in page for name in COMMANDS)
    assert page.count("Usage: fibrefit ") == len(COMMANDS)


def test_every_effect_has_a_page(tmp_path: Path) -> None:
    from fibrefit.laws.catalogue import CATALOGUE

    pages: dict[str, str] = {}
    write_effects(tmp_path, lambda path, text: pages.update({path.stem: text}), with_pictures=False)
    for effect in CATALOGUE.values():
        page = pages[effect.name.replace(".", "_").replace("@", "_")]
        assert all(f"## {title}\n" in page for title in ("Law", "Parameters", "Source")), effect.name
        assert all(f".{parameter.name}`" in page for parameter in effect.parameters)


def test_every_number_that_decides_has_its_meaning() -> None:
    page, files = threshold_page(ROOT / "fibrefit"), files_of(ROOT / "fibrefit")
    assert files.keys() == FLOORS.keys()
    for one in (one for paths in files.values() for path in paths for one in thresholds_in(path.read_text("utf-8"))):
        assert one.meaning, one.name
        assert f"| `{one.name}` | `{one.value}` | " in page


def test_numbers_that_follow_each_other_share_a_meaning() -> None:
    code = 'A, B = 1.0, 2\nC = 3e-4\n"""What they\nare."""\nD = 4\n'
    found = [(one.name, one.value, one.meaning) for one in thresholds_in(code)]
    assert found == [("A", "1.0", "What they are."), ("B", "2", "What they are."), ("C", "0.0003", "What they are."),
                     ("D", "4", "")]  # fmt: skip


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if "generated/" not in target:
            assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent != JOURNAL], ids=lambda page: page.name)
def test_what_ships_leads_to_no_page_of_the_journal(page: Path) -> None:
    assert "journal" not in "".join(LINK.findall(page.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("page", "section", "tables"),
    [
        ("discovery", "## Figures", ("discovery_goals", "discovery_goals_together", "mistakes")),
        ("changes_and_plans", "Release 2026", ("plans",)),
    ],
)
def test_figures_of_a_page_are_those_of_the_journal(page: str, section: str, tables: tuple[str, ...]) -> None:
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8").partition(section)[2].partition("\n## ")[0]
    kept = "".join((JOURNAL / "tables" / f"{name}.csv").read_text(encoding="utf-8") for name in tables)
    shares = COUNTED.findall(text)
    assert len(shares) > 2
    assert not [share for share in shares if f"({share};" not in kept]


@pytest.fixture
def copy_of_docs(tmp_path: Path) -> Path:
    """The sources of the site beside what they read, so that a build leaves nothing in the checkout."""
    shutil.copytree(DOCS, tmp_path / "docs", ignore=shutil.ignore_patterns("_build", "generated", "__pycache__"))
    for name in ("fibrefit", "notebooks", "data_schemas", "configs"):
        (tmp_path / name).symlink_to(ROOT / name)
    for page in ROOT.glob("*.md"):
        shutil.copy(page, tmp_path)  # links in a page are followed from where it really lies
    return tmp_path / "docs"


@pytest.mark.slow
def test_it_builds_without_a_warning(copy_of_docs: Path) -> None:
    """As `make docs` does but for the pictures of the effects, which simulate; notebooks are shown as they were run."""
    for package in ("myst_nb", "latex2mathml"):
        pytest.importorskip(package, reason="the extra docs is not installed")
    built = copy_of_docs.parent / "html"
    words = ["-m", "sphinx", "-W", "--keep-going", "-q", "-D", "effect_pictures=0", str(copy_of_docs), str(built)]
    done = subprocess.run([sys.executable, *words], cwd=copy_of_docs, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name in ("index", "tutorial", "api", "generated/study_file", "generated/effects/index"):
        assert (built / f"{name}.html").is_file()
    assert len(list((built / "generated" / "effects").glob("*.html"))) > 50
    first = (built / "generated" / "notebooks" / "01_first_fit.html").read_text(encoding="utf-8")
    assert "<img" in first
    assert "<math" in first
    fetched = {page.name: FETCHED.findall(page.read_text(encoding="utf-8")) for page in built.rglob("*.html")}
    assert not any(fetched.values()), fetched


def test_a_formula_whose_command_nobody_knows_stops_the_build() -> None:
    pytest.importorskip("latex2mathml", reason="the extra docs is not installed")
    from formulas import mathml

    assert "<mfrac>" in mathml(r"\tfrac12\,x", "inline")
    with pytest.raises(ValueError, match="has no MathML"):
        mathml(r"\nothing{x}", "inline")


def test_a_warning_is_an_error(copy_of_docs: Path) -> None:
    """The negative control: a link that leads nowhere stops the build of a site of that page alone."""
    for package in ("myst_nb", "latex2mathml"):
        pytest.importorskip(package, reason="the extra docs is not installed")
    for page in (*copy_of_docs.rglob("*.md"), *copy_of_docs.rglob("*.ipynb")):
        page.unlink()
    (copy_of_docs / "index.md").write_text("# A page\n\n[nowhere](nowhere.md)\n", encoding="utf-8")
    conf = copy_of_docs / "conf.py"
    conf.write_text(conf.read_text(encoding="utf-8").replace('    "pages",\n', ""), encoding="utf-8")
    words = [sys.executable, "-m", "sphinx", "-W", "-q", str(copy_of_docs), str(copy_of_docs.parent / "html")]
    done = subprocess.run(words, cwd=copy_of_docs, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "nowhere.md" in done.stderr
