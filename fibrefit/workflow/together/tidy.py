"""Tidy tables: the same rows as CSV for a person and as Parquet for a program."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fibrefit.core.paths import write_whole
from fibrefit.store.csv_text import headed, neutral

if TYPE_CHECKING:
    import pandas as pd

    from fibrefit.series.meta_analysis import Quantity
    from fibrefit.study.summaries.part import Measure


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


def tidy_rows(
    names: Sequence[str],
    parameters: Sequence[Quantity],
    conditions: Sequence[Quantity],
    shrunk: Mapping[str, Mapping[str, Measure]],
) -> list[dict[str, object]]:
    """One row a record and parameter: value, errors, unit, every condition, and errors of those that have one.

    The standard error is that of the record alone; the common one is the same in all of them.

    Parameters
    ----------
    names : sequence of str
        Of the records.
    parameters, conditions : sequence of Quantity
        In that order.
    shrunk : mapping of record to mapping of parameter to Measure
        Values drawn to the mean of all; missing where there is no population.
    """
    return [
        {
            "record": name,
            "parameter": parameter.name,
            "value": float(parameter.values[r]),
            "std_error": float(parameter.errors[r]),
            "common_error": parameter.common,
            "unit": parameter.unit,
            **_drawn(shrunk.get(name, {}).get(parameter.name)),
            **{headed(one.name, one.unit): float(one.values[r]) for one in conditions},
            **{headed(f"{x.name} std_error", x.unit): float(x.errors[r]) for x in conditions if x.errors.any()},
        }
        for r, name in enumerate(names)
        for parameter in parameters
    ]


def _drawn(found: Measure | None) -> dict[str, float]:
    return {
        "shrunk": math.nan if found is None else found.value,
        "shrunk_error": math.nan if found is None else found.error,
    }
