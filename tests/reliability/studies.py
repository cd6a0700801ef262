"""Small studies for whole commands that are run many times."""

from __future__ import annotations

import shutil
from pathlib import Path

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def copied(study: str, folder: Path, *, records: int | None = None) -> Path:
    """A study of the project in a folder of its own there, with its first records or with all of them."""
    place = Path(shutil.copytree(CONFIGS / study, folder / study))
    if records is not None:
        file = place / "study.toml"
        file.write_text("[[records]]".join(file.read_text("utf-8").split("[[records]]")[: records + 1]), "utf-8")
    return place
