"""Converged trajectories of an independent simulator, and the conditions they were made under."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

DIRECTORY = Path(__file__).resolve().parent.parent / "data" / "reference"

#: Largest deviation from the reference, root mean square over the range of the channel.
FORCE, POSITION = 5e-4, 5e-5
#: Largest deviation of a derivative, root mean square over that of the reference.
DERIVATIVE = 2e-2


@cache
def index() -> dict[str, Any]:
    return json.loads((DIRECTORY / "index.json").read_text(encoding="utf-8"))


def names(start: str) -> list[str]:
    return [name for name in index() if name.startswith(start)]


def table(name: str) -> dict[str, np.ndarray]:
    """Columns by their header without unit; the first sample is one step after the start."""
    path = DIRECTORY / f"{name}.csv.gz"
    values = np.loadtxt(path, delimiter=",", skiprows=1)
    import gzip

    with gzip.open(path, "rt", encoding="utf-8") as file:
        header = file.readline().strip().split(",")
    return {bare(title): column for title, column in zip(header, values.T, strict=True)}


def bare(title: str) -> str:
    return re.sub(r" \[.*\]", "", title)


def effect_values(name: str) -> dict[str, float]:
    """Values of the effect's parameters under their dotted names."""
    entry = index()[name]
    return {f"{entry['effect']}.{bare(title)}": value for title, value in entry["effect_parameters"].items()}
