"""The site builds without a warning, and its pages hold what they promise."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS / "_ext"))

from command_pages import command_page  # noqa: E402
from effect_pages import write_effects  # noqa: E402
from schema_pages import result_page, study_page  # noqa: E402

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


def test_every_effect_has_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import effect_pages

    from fibrefit.effects.catalogue import CATALOGUE

    monkeypatch.setattr(effect_pages, "_drawn", lambda effect, folder: False)
    pages: dict[str, str] = {}
    write_effects(tmp_path, lambda path, text: pages.update({path.stem: text}))
    for effect in CATALOGUE.values():
        page = pages[effect.name.replace(".", "_").replace("@", "_")]
        assert all(f"## {title}\n" in page for title in ("Law", "Parameters", "Source")), effect.name
        assert all(f".{parameter.name}`" in page for parameter in effect.parameters)


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if "generated/" not in target:
            assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("sphinx") is None or find_spec("myst_nb") is None, reason="the extra docs is not installed"
)
def test_it_builds_without_a_warning(tmp_path: Path) -> None:
    words = [
        sys.executable,
        "-m",
        "sphinx",
        "-W",
        "--keep-going",
        "-q",
        "-b",
        "html",
        str(DOCS),
        str(tmp_path / "html"),
    ]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name in ("index", "tutorial", "api", "generated/study_file", "generated/effects/index"):
        assert (tmp_path / "html" / f"{name}.html").is_file()
    assert len(list((tmp_path / "html" / "generated" / "effects").glob("*.html"))) > 50
