"""Pages that follow from the code: effects, keys of a study, commands, thresholds, notebooks; made before all else."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from command_pages import command_page
from effect_pages import write_effects
from schema_pages import result_page, study_page
from threshold_pages import threshold_page

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent


def write_if_new(path: Path, text: str) -> None:
    """Write a file unless it holds that text already: Sphinx reads again only what has changed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def write_all(app: Any) -> None:
    """Write every page below ``docs/generated``."""
    generated = Path(app.srcdir) / "generated"
    write_effects(generated / "effects", write_if_new, app.config.effect_pictures)
    schemas = ROOT / "data_schemas"
    write_if_new(generated / "study_file.md", study_page(schemas / "study.schema.json"))
    write_if_new(generated / "result_files.md", result_page(schemas))
    write_if_new(generated / "commands.md", command_page())
    write_if_new(generated / "thresholds.md", threshold_page(ROOT / "fibrefit"))
    notebooks = generated / "notebooks"
    notebooks.mkdir(parents=True, exist_ok=True)
    names = sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb"))
    for name in names:
        shutil.copy2(ROOT / "notebooks" / name, notebooks / name)
    listed = "\n".join(name.removesuffix(".ipynb") for name in names)
    text = (
        "# Notebooks\n\nEach runs from top to bottom in a checkout, in the folder `notebooks/`, as a notebook or as a "
        "plain script of the same name; `make notebooks` runs them"
        ", the one that reads a record of another laboratory with EMPS=FILE only.\n\n"
        f"```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n"
    )
    write_if_new(notebooks / "index.md", text)


def setup(app: Any) -> dict[str, Any]:
    """What Sphinx asks an extension for."""
    # A check of the text alone, `-D effect_pictures=0`, spares itself the simulations behind them.
    app.add_config_value("effect_pictures", True, "env", bool)
    app.connect("builder-inited", write_all)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
