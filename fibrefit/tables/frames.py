"""Numbers of a result as data frames of pandas."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from fibrefit.core.errors import DataError
from fibrefit.core.paths import read_plain_file, shown_path
from fibrefit.problem.statement.matrices import correlation_matrix

#: Columns of a table of parameters.
COLUMNS = ("name", "record", "value", "std_error", "low", "high", "unit")

Groups = Mapping[str, Mapping[str, Any]]
"""Group to name to an array with ``values``, ``dims``, ``unit`` and ``doc``, as ``result.h5`` holds them."""


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
    rows = [(name, record, *_numbers(found)) for name, record, found in _found(summary)]
    frame = pd.DataFrame(rows, columns=list(COLUMNS))
    numbers = ["value", "std_error", "low", "high"]
    return frame.astype(dict.fromkeys(numbers, float))


def _found(summary: Any) -> Iterator[tuple[str, str | None, Any]]:
    for name, found in getattr(summary, "parameters", {}).items():
        yield name, None, found
    parts = {**_mapping(summary, "records"), **_mapping(summary, "items")}
    for record, part in parts.items():
        for name, found in (part if isinstance(part, dict) else getattr(part, "parameters", {})).items():
            yield name, record, found


def _mapping(summary: Any, name: str) -> dict[str, Any]:
    found = getattr(summary, name, {})
    return found if isinstance(found, dict) else {}


def _numbers(found: Any) -> tuple[Any, ...]:
    """Value, error, both ends of the interval and unit, of a fit, of a posterior, or of a bare number."""
    if isinstance(found, float):
        return found, None, None, None, None
    if hasattr(found, "mean"):
        return found.mean, found.sd, *found.interval, found.unit
    return found.value, found.std_error, *(found.interval_95 or (None, None)), found.unit


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
    phases = _phases(predicted.get("phase"))
    parts = []
    for r, record in enumerate(observed["record"].values):
        for channel in channels:
            measured = observed[channel].values[r]
            n = _samples(counted.get(str(record)), [observed[c].values[r] for c in channels])
            parts.append(
                pd.DataFrame(
                    {
                        "record": str(record),
                        "channel": channel,
                        "time": observed["time"].values[r, :n],
                        "phase": phases[r][:n] if phases is not None else None,
                        "measured": measured[:n],
                        "simulated": predicted[channel].values[r, :n],
                        "residual": _residual(groups, channel, r, measured)[:n],
                    }
                )
            )
    frame = pd.concat(parts, ignore_index=True)
    for column in ("record", "channel", "phase"):
        frame[column] = frame[column].astype("category")
    frame.attrs["units"] = {channel: observed[channel].unit for channel in channels}
    return frame


def _samples(counted: int | None, channels: list[np.ndarray]) -> int:
    """Rows of a record: a record with gaps has more ticks than samples, one that ends masked more samples than seen."""
    seen = np.flatnonzero(np.any(np.isfinite(channels), axis=0))
    return max(counted or 0, int(seen[-1]) + 1 if seen.size else 0)


def _residual(groups: Groups, channel: str, record: int, measured: np.ndarray) -> np.ndarray:
    """Measured minus simulated, as every table and figure has it; the solver and the file count the other way."""
    found = groups.get("residuals", {}).get(channel)
    rows = np.full(measured.shape, np.nan) if found is None else np.asarray(found.values[record])
    return np.where(np.isfinite(measured), -rows, np.nan)


def _phases(variable: Any) -> np.ndarray | None:
    """Names of the phases ``(n_record, n_sample)``, from the numbers and what they stand for."""
    if variable is None:
        return None
    parts = variable.doc.split(": ")
    names = [part.rpartition(", ")[0] for part in parts[1:-1]] + [parts[-1]]
    return np.array(names, dtype=object)[np.asarray(variable.values, dtype=int)]


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
