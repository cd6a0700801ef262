"""Where a key of a study stands, for messages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Places:
    """Finds a key in the study file, in its table of records, or on the command line.

    Parameters
    ----------
    source : pathlib.Path
        The study file.
    table : pathlib.Path or None
        The table of records, where there is one.
    changed : mapping of str to str
        Key path of every override, and the override as it was typed.
    """

    source: Path
    table: Path | None = None
    changed: Mapping[str, str] = field(default_factory=dict)

    def __call__(self, key: str) -> str:
        """Place of the key, such as ``study.toml, records[1].lift``."""
        for changed, override in self.changed.items():
            if key == changed or key.startswith((f"{changed}.", f"{changed}[")):
                return override
        row = re.fullmatch(r"records\[(\d+)\]\.?(.*)", key)
        if self.table is not None and row:
            return f"{self.table}, record {int(row[1]) + 1}" + (f', column "{row[2]}"' if row[2] else "")
        return f"{self.source}, {key}" if key else str(self.source)
