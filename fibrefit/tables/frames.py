"""Numbers of a result as data frames of pandas: of most its parameters, of others what they found instead."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from fibrefit.core.errors import DataError
from fibrefit.core.matrices import correlation_matrix
from fibrefit.core.paths import read_plain_file, shown_path
from fibrefit.study.summaries.discovery import DistinguishSummary, PlanSummary
from fibrefit.study.summaries.part import Z_95, Groups, Part
from fibrefit.study.summaries.results import SweepSummary
from fibrefit.study.summaries.series import SeriesSummary

#: Columns of a table of parameters.
COLUMNS = ("name", "record", "value", "std_error", "low", "high", "unit")


def parameter_frame(summary: Any) -> pd.DataFrame:
    """Every parameter of a result, one row a value.

    Parameters
    ----------
    summary : Part
        Content of a ``summary.json``.

    Returns
    -------
    pandas.DataFrame
        ``name``; ``record`` (missing where all records share the value; the item of a batch); ``value``, ``std_error``,
        ``low`` and ``high`` in ``unit``. Of a posterior they are mean, standard deviation and the ends of its interval.
    """
    found = [(name, None, value) for name, value in getattr(summary, "parameters", {}).items()]
    for parts in (getattr(summary, "records", {}), getattr(summary, "items", {})):
        for record, part in parts.items() if isinstance(parts, dict) else ():
            own = part if isinstance(part, dict) else getattr(part, "parameters", {})
            found += [(name, record, value) for name, value in own.items()]
    rows: list[tuple[Any, ...]] = []
    for name, record, value in found:
        if isinstance(value, float):
            rows.append((name, record, value, None, None, None, None))
        elif hasattr(value, "mean"):
            rows.append((name, record, value.mean, value.sd, *value.interval, value.unit))
        else:
            rows.append((name, record, value.value, value.std_error, *(value.interval_95 or (None, None)), value.unit))
    numbers = dict.fromkeys(("value", "std_error", "low", "high"), float)
    return pd.DataFrame(rows, columns=list(COLUMNS)).astype(numbers)


def inspection_frame(document: Mapping[str, Any]) -> pd.DataFrame:
    """What was understood of files, one row a column of a file.

    Parameters
    ----------
    document : mapping
        What ``inspect`` tells programs.

    Returns
    -------
    pandas.DataFrame
        ``file``, ``header``, ``name``, ``unit``, ``si``, ``samples``, ``valid``, ``masked``, ``minimum``, ``maximum``
        in `si`, and so on. A file that was not understood has no row.
    """
    rows = [{"file": one["file"], **column} for one in document["files"] for column in one.get("columns", ())]
    return pd.DataFrame(rows)


def covariance_frame(groups: Groups) -> pd.DataFrame:
    """Covariance of all free values, in the products of their SI units, labelled on both sides.

    Parameters
    ----------
    groups : mapping
        Of a fit or of a discovery.
    """
    estimate = groups["estimate"]
    names = pd.Index([str(name) for name in estimate["parameter"].values], name="name")
    return pd.DataFrame(np.asarray(estimate["covariance"].values), index=names, columns=names)


def draw_frame(groups: Groups) -> pd.DataFrame:
    """Draws of a posterior, one column a value, one row a draw by ``chain`` and ``draw``; SI units.

    What records share comes first. Within that columns go by name: a file gives them back in no other order.
    """
    posterior = groups["posterior"]
    columns: dict[str, np.ndarray] = {}
    shape = (0, 0)
    for name, variable in posterior.items():
        if variable.dims[:2] != ("chain", "draw"):
            continue
        shape = np.shape(variable.values)[:2]
        values = np.asarray(variable.values).reshape(-1, *np.shape(variable.values)[2:])
        if variable.dims[2:] == ("record",):
            records = posterior["record"].values
            columns |= {f"{name}[{record}]": values[:, i] for i, record in enumerate(records)}
        elif values.ndim == 1:
            columns[name] = values
    columns = {name: columns[name] for name in sorted(columns, key=lambda name: ("[" in name, name.partition("[")[0]))}
    return pd.DataFrame(columns, index=pd.MultiIndex.from_product(map(range, shape), names=["chain", "draw"]))


def correlation_of(covariance: pd.DataFrame) -> pd.DataFrame:
    """Correlations from covariances; missing where the records say nothing of a value."""
    known = correlation_matrix(covariance.to_numpy())
    return pd.DataFrame(known, index=covariance.index, columns=covariance.columns)


def residual_frame(groups: Groups, counted: Mapping[str, int | None]) -> pd.DataFrame:
    """Measured and simulated samples side by side.

    Parameters
    ----------
    groups : mapping
        With ``observed_data`` and ``predictions``, and ``residuals`` where there are any.
    counted : mapping of record to int or None
        Samples of each record; None counts them by what was measured.

    Returns
    -------
    pandas.DataFrame
        One row a sample and channel: ``record``, ``channel``, ``time`` in s, ``phase``, ``measured`` and ``simulated``
        in SI units, ``residual`` (measured minus simulated over the noise). Masked samples have no ``measured`` and no
        ``residual``. ``attrs["units"]`` holds the unit of each channel.
    """
    observed, predicted = groups["observed_data"], groups["predictions"]
    channels = [name for name in observed if name in predicted and observed[name].dims == ("record", "sample")]
    channels = [name for name in channels if name not in ("time", "phase")]
    phases = None
    if (variable := predicted.get("phase")) is not None:
        # Names of the phases, from the numbers and what they stand for.
        stand = variable.doc.split(": ")
        names = np.array([part.rpartition(", ")[0] for part in stand[1:-1]] + [stand[-1]], dtype=object)
        phases = names[np.asarray(variable.values, dtype=int)]
    parts = []
    for r, record in enumerate(observed["record"].values):
        # A record with gaps has more ticks than samples, one that ends masked more samples than seen.
        seen = np.flatnonzero(np.any(np.isfinite([observed[c].values[r] for c in channels]), axis=0))
        n = max(counted.get(str(record)) or 0, int(seen[-1]) + 1 if seen.size else 0)
        for channel in channels:
            measured = observed[channel].values[r]
            found = groups.get("residuals", {}).get(channel)
            # Measured minus simulated, as every table and figure has it; the solver and the file count the other way.
            rows = np.full(measured.shape, np.nan) if found is None else -np.asarray(found.values[r])
            columns = {
                "record": str(record),
                "channel": channel,
                "time": observed["time"].values[r, :n],
                "phase": phases[r][:n] if phases is not None else None,
                "measured": measured[:n],
                "simulated": predicted[channel].values[r, :n],
                "residual": np.where(np.isfinite(measured), rows, np.nan)[:n],
            }
            parts.append(pd.DataFrame(columns))
    frame = pd.concat(parts, ignore_index=True)
    for column in ("record", "channel", "phase"):
        frame[column] = frame[column].astype("category")
    frame.attrs["units"] = {channel: observed[channel].unit for channel in channels}
    return frame


def batch_frame(path: Path) -> pd.DataFrame:
    """``results.csv`` of a batch: one row an item, with its conditions, status, gap, values and errors.

    Returns
    -------
    pandas.DataFrame
        Indexed by item, whose names are text whatever they look like; headers carry the SI unit, as in the file.

    Raises
    ------
    DataError
        If there is no such file, or it is no such table.
    """
    content = read_plain_file(path, "the folder of a batch, with its results.csv", DataError)
    try:
        table = pd.read_csv(io.BytesIO(content), dtype={"item": str}, keep_default_na=False, na_values=[""])
        if table["item"].isna().any():
            raise ValueError("a row without the name of its item")
        return table.set_index("item")
    except (ValueError, KeyError) as error:
        raise DataError(shown_path(path), f"no table of a batch: {error}", "what fibrefit has written") from None


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
    if isinstance(summary, DistinguishSummary):
        return pd.DataFrame([one.model_dump() for one in summary.effects])
    if isinstance(summary, PlanSummary):
        # Conditions in which each record differs, its cost, and by what factors errors and limits would fall.
        rows = [
            {
                "like": one.like,
                **one.conditions,
                **one.model_dump(include={"pace", "size", "minutes", "probability_distinguished", "looked_into"}),
                **{f"error of {name}": factor for name, factor in one.errors.items()},
                **{f"limit of {name}": factor for name, factor in one.limits.items()},
            }
            for one in summary.further
        ]
        return pd.DataFrame(rows)
    if isinstance(summary, SeriesSummary):
        rows = [
            {"record": record, "parameter": name, **own.model_dump(), **found.conditions}
            for record, found in summary.records.items()
            for name, own in found.parameters.items()
        ]
        return values_frame(pd.DataFrame(rows))
    frame = parameter_frame(summary)
    if not isinstance(summary, SweepSummary):
        return frame
    # Values that a study states are bare: their units are those of the rig and of the catalogue.
    from fibrefit.laws.catalogue import CATALOGUE
    from fibrefit.rigs.catalogue import rig_of

    units = {one.name: one.unit for one in rig_of(summary.rig).parameters}
    for effect in (CATALOGUE[name] for name in summary.effects if name in CATALOGUE):
        units |= {f"{effect.name}.{one.name}": one.unit for one in effect.parameters}
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
