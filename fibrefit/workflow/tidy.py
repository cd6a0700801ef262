"""Tidy tables: the same rows as CSV for a person and as Parquet for a program."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fibrefit.store.csv_text import neutral
from fibrefit.store.files import write_whole

if TYPE_CHECKING:
    import pandas as pd


def tidy_frame(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    """Rows as a table; a number that is not known is missing."""
    import pandas

    return pandas.DataFrame(list(rows))


def write_table(stem: Path, frame: pd.DataFrame) -> None:
    """Write ``stem.csv`` and ``stem.parquet``.

    Parameters
    ----------
    stem : pathlib.Path
        Without an extension.
    frame : pandas.DataFrame
        What is missing is empty in the CSV and null in the Parquet; text that a spreadsheet would take for a formula
        gets an apostrophe before it in the CSV.
    """
    shown = frame.map(lambda cell: neutral(cell) if isinstance(cell, str) else cell)
    write_whole(stem.with_suffix(".csv"), shown.to_csv(index=False, float_format="%.9g", lineterminator="\n"))
    buffer = io.BytesIO()
    frame.to_parquet(buffer, index=False)
    write_whole(stem.with_suffix(".parquet"), buffer.getvalue())
