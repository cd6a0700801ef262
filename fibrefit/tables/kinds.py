"""Every kind of result as a data frame: of most its parameters, of others what they found instead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from fibrefit.study.summaries.discovery import DistinguishSummary, PlanSummary
from fibrefit.study.summaries.part import Z_95, Part
from fibrefit.study.summaries.results import SweepSummary
from fibrefit.study.summaries.series import SeriesSummary
from fibrefit.tables.frames import COLUMNS, parameter_frame


def result_frame(summary: Part) -> pd.DataFrame:
    """What a result found, as a table.

    Parameters
    ----------
    summary : Part
        Content of a ``summary.json``.

    Returns
    -------
    pandas.DataFrame
        Of a fit, a discovery, a posterior, a prediction, a batch or a sweep one row a value, see
        `parameter_frame`; of ``distinguish`` one row an effect, of ``plan`` one row a further record,
        of a series one row a record and parameter, see `values_frame`.
    """
    return FRAMES.get(type(summary), parameter_frame)(summary)


def _effects(summary: DistinguishSummary) -> pd.DataFrame:
    """``effect``, ``parameter``, ``smallest_detectable`` in ``unit`` (missing where none shows), ``unique``."""
    return pd.DataFrame([one.model_dump() for one in summary.effects])


def _further(summary: PlanSummary) -> pd.DataFrame:
    """Conditions in which each record differs, its cost, and by what factors errors and limits would fall."""
    rows = [
        {
            "like": one.like,
            **one.conditions,
            "pace": one.pace,
            "size": one.size,
            "minutes": one.minutes,
            "probability_distinguished": one.probability_distinguished,
            "looked_into": one.looked_into,
            **{f"error of {name}": factor for name, factor in one.errors.items()},
            **{f"limit of {name}": factor for name, factor in one.limits.items()},
        }
        for one in summary.further
    ]
    return pd.DataFrame(rows)


def _records(summary: SeriesSummary) -> pd.DataFrame:
    """As `values_frame`, of the summary alone."""
    rows = [
        {
            "record": record,
            "parameter": name,
            "value": own.value,
            "std_error": own.std_error,
            "common_error": own.common_error,
            "unit": own.unit,
            "shrunk": own.shrunk,
            "shrunk_error": own.shrunk_error,
            **found.conditions,
        }
        for record, found in summary.records.items()
        for name, own in found.parameters.items()
    ]
    return values_frame(pd.DataFrame(rows))


def _stated(summary: SweepSummary) -> pd.DataFrame:
    """As `parameter_frame`, with the units of the rig and of the catalogue: values that a study states are bare."""
    from fibrefit.laws.catalogue import CATALOGUE
    from fibrefit.rigs.catalogue import rig_of

    units = {one.name: one.unit for one in rig_of(summary.rig).parameters}
    for effect in (CATALOGUE[name] for name in summary.effects if name in CATALOGUE):
        units |= {f"{effect.name}.{one.name}": one.unit for one in effect.parameters}
    frame = parameter_frame(summary)
    return frame.assign(unit=frame["name"].map(units))


def values_frame(tidy: pd.DataFrame) -> pd.DataFrame:
    """Values of single records as any result tells its values, conditions behind them.

    Parameters
    ----------
    tidy : pandas.DataFrame
        One row a record and parameter: ``record``, ``parameter``, ``value``, ``std_error``, ``common_error``, ``unit``
        and conditions.

    Returns
    -------
    pandas.DataFrame
        The columns of `parameter_frame`, of which ``low`` and ``high`` are the ends of the 95 % interval of a normal
        law with both errors, then the conditions.
    """
    # Tables that were written before they told it have none.
    half = Z_95 * np.hypot(tidy["std_error"], tidy.get("common_error", 0.0))
    table = tidy.rename(columns={"parameter": "name"}).assign(low=tidy["value"] - half, high=tidy["value"] + half)
    return table[[*COLUMNS, *(name for name in table.columns if name not in COLUMNS)]]


FRAMES: dict[type[Part], Callable[[Any], pd.DataFrame]] = {
    DistinguishSummary: _effects,
    PlanSummary: _further,
    SeriesSummary: _records,
    SweepSummary: _stated,
}
