"""What every result offers in Python, whether it was just found or read again: tables, a tree for ArviZ, a picture."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import UsageError
from fibrefit.core.formatting import Card, Shown

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from fibrefit.plots.figures import Figures

KINDS = {
    "fit": "Fit",
    "discovery": "Discovery",
    "posterior": "Posterior",
    "batch": "Batch",
    "sweep": "Sweep",
    "series": "Series",
    "prediction": "Prediction",
    "distinguish": "Comparison of effects",
    "plan": "Plan",
}
"""Word for each kind of result, by the middle of its schema."""

HOLDERS = {
    "estimate": "that of fit or discover, or draws as of sample",
    "predictions": "those of fit, discover, predict",
    "posterior": "that of sample",
}
"""Which results hold a group of arrays."""
MOST_ROWS = 12
"""Rows a notebook shows; the others are counted."""


class AnyResult(Shown, ABC):
    """A result with a summary and groups of arrays; all else is made of these two."""

    @abstractmethod
    def summary(self) -> Any:
        """Content of ``summary.json``.

        Returns
        -------
        pydantic.BaseModel
            Its attributes are the keys of the file; ``model_dump()`` makes a dictionary of them.

        Examples
        --------
        >>> result.summary().gap.total < 1.05
        True
        """

    def groups(self) -> Mapping[str, Mapping[str, Any]]:
        """Arrays of ``result.h5`` as they are kept; `residuals`, `covariance` and `to_datatree` say more.

        Returns
        -------
        mapping of str to mapping of str to Variable
            By group and name, with ``values``, ``dims``, ``unit`` and ``doc``; empty where the summary is all.

        Examples
        --------
        >>> force = result.groups()["observed_data"]["force"]
        >>> force.dims, force.values.shape[0], force.unit
        (('record', 'sample'), 5, 'N')
        """
        return {}

    @property
    def status(self) -> str:
        """``ok``, ``suspect`` or ``failed``.

        Examples
        --------
        >>> result.status
        'ok'
        """
        return str(self.summary().status)

    def report(self) -> str:
        """The terminal report.

        Returns
        -------
        str
            Lines of at most 80 columns.

        Examples
        --------
        >>> "stiffness" in result.report()
        True
        """
        from fibrefit.report.any import report_of

        return report_of(self.summary())

    def plot(self) -> Figures:
        """Figures by name, drawn from ``summary()`` and ``groups()`` alone: those of a result read again are the same.

        Returns
        -------
        Figures
            A dictionary of matplotlib figures by name, which a notebook shows; ``only(*names)`` picks some.

        Raises
        ------
        UsageError
            If what it is drawn from is gone.

        Examples
        --------
        >>> {"overview", "correlation"} <= set(result.plot())
        True
        """
        from fibrefit.workflow.outcome.draw import saved_figures

        return saved_figures(self.summary(), self.groups(), self._place())

    def to_dataframe(self) -> pd.DataFrame:
        """Every parameter, one row a value; of a plan the further records, of ``distinguish`` the effects.

        Returns
        -------
        pandas.DataFrame
            Columns ``name``, ``record`` (missing where all records share it), ``value``, ``std_error``, ``low``,
            ``high``, ``unit``. Of a posterior they are mean, standard deviation and ends of the interval; of a series
            the conditions of each record follow. Of a plan one row a further record: ``like`` which it is, the
            conditions that differ, ``minutes`` it costs, and by what factors errors and detection limits would fall.
            Of ``distinguish`` ``effect``, ``parameter``, ``smallest_detectable``, ``unit`` and ``unique``.

        Examples
        --------
        >>> table = result.to_dataframe().set_index(["name", "record"])
        >>> table.loc["stiffness", "unit"].item()
        'N/m'
        """
        from fibrefit.tables.frames import result_frame

        return result_frame(self.summary())

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of all free values; of a posterior that of its draws.

        Returns
        -------
        pandas.DataFrame
            ``(n_free, n_free)``, in the products of their SI units, labelled on both sides: what records share by its
            name, what a record has of its own as ``name[record]``.

        Raises
        ------
        UsageError
            If the result is of a kind that has none.

        Examples
        --------
        >>> error = float(result.covariance.loc["stiffness", "stiffness"]) ** 0.5
        >>> bool(abs(error / result.parameters["stiffness"].std_error - 1.0) < 1e-6)
        True
        """
        from fibrefit.tables.frames import covariance_frame, draw_frame

        groups = self.groups()
        if "posterior" in groups:
            return draw_frame(groups).cov()
        self._need(groups, "estimate")
        return covariance_frame(groups)

    @property
    def correlation(self) -> pd.DataFrame:
        """Correlation of all free values; of a posterior that of its draws.

        Returns
        -------
        pandas.DataFrame
            ``(n_free, n_free)``, without unit, labelled as `covariance`; missing where records say nothing of a value.

        Raises
        ------
        UsageError
            If the result is of a kind that has none.

        Examples
        --------
        >>> bool(result.correlation.loc["damping", "friction"] < 0.0)
        True
        """
        from fibrefit.tables.frames import correlation_of

        return correlation_of(self.covariance)

    @property
    def residuals(self) -> pd.DataFrame:
        """Measured against simulated, one row a sample and channel.

        Returns
        -------
        pandas.DataFrame
            ``record``, ``channel``, ``time`` [s], ``phase``, ``measured`` and ``simulated`` (SI units, in
            ``attrs["units"]``), ``residual`` (measured minus simulated over the noise).

        Raises
        ------
        UsageError
            If the result is of a kind that has none.

        Examples
        --------
        >>> spread = result.residuals.groupby("channel", observed=True)["residual"].std()
        >>> spread.round(1).to_dict()
        {'force': 1.0, 'position': 1.0}
        """
        from fibrefit.tables.frames import residual_frame

        groups = self.groups()
        self._need(groups, "predictions")
        return residual_frame(groups, {n: getattr(r, "samples", None) for n, r in self.summary().records.items()})

    @property
    def draws(self) -> pd.DataFrame:
        """Draws of a posterior, one column a value, SI units: those that ``result.h5`` keeps, found now or loaded.

        Returns
        -------
        pandas.DataFrame
            One row a draw, by ``chain`` (an ensemble of walkers) and ``draw``; a value that each record has of its own
            is a column ``name[record]``.

        Raises
        ------
        UsageError
            If the result is no posterior.

        Examples
        --------
        >>> posterior.draws.index.names, posterior.draws["stiffness"].mean().round(-3).item()
        (FrozenList(['chain', 'draw']), 11000.0)
        """
        from fibrefit.tables.frames import draw_frame

        groups = self.groups()
        self._need(groups, "posterior")
        return draw_frame(groups)

    def to_datatree(self) -> xr.DataTree:
        """All arrays as a tree of xarray data sets, in the groups in which ArviZ looks for them.

        Returns
        -------
        xarray.DataTree
            ``posterior``, ``sample_stats``, ``log_likelihood``, ``observed_data`` and so on; of a fit ``estimate``,
            ``observed_data``, ``predictions``, ``residuals`` (simulated minus measured, over the noise). A posterior is
            thinned to the draws whose likelihood is known; ``draws`` and ``result.h5`` hold the others too. Its samples
            of a record are the dimension ``instant``: what ArviZ calls ``sample`` is a chain and draw.

        Raises
        ------
        UsageError
            If the result is of a kind without arrays.

        Notes
        -----
        ``arviz_stats.loo(tree)`` and ``arviz_stats.compare({"a": tree, "b": other})`` take it as it is, as does
        ``arviz_plots``; ArviZ before 1.0 takes ``arviz.from_datatree(tree)``. What is left out in turn is a block of
        samples; its log likelihood is given beyond ``usual``, that of noise which scatters as neighbouring readings do,
        as their density in SI units is larger than ArviZ can weigh models by.

        Examples
        --------
        >>> dict(posterior.to_datatree()["posterior"]["stiffness"].sizes)["chain"]
        4
        """
        try:
            from fibrefit.tables.trees import tree_of
        except ModuleNotFoundError as error:
            do = "Install it with: pip install 'fibrefit[arviz]'"
            raise UsageError("to_datatree", f"{error.name} is not installed", "the extra arviz", do) from None
        groups = self.groups()
        if not groups:
            raise UsageError("to_datatree", f"a result of kind {self._kind()}", "one with arrays", "Take to_dataframe.")
        return tree_of(groups, {"schema": self.summary().schema_name})

    def _need(self, groups: Mapping[str, Any], name: str) -> None:
        if name not in groups:
            raise UsageError(f"{name} of a result", f"none in one of kind {self._kind()}", HOLDERS[name], "")

    def _kind(self) -> str:
        return str(self.summary().schema_name).split("/")[1]

    def _place(self) -> str:
        return f"a result of kind {self._kind()}"

    def _card(self) -> Card:
        from fibrefit.report.any import sentence_of

        summary = self.summary()
        named = getattr(summary, "study", None) or getattr(summary, "name", "")
        title = f'{KINDS.get(self._kind(), self._kind().capitalize())} of "{named}": {_verdict(summary)}'
        rows = _rows(summary)
        line = "; ".join(" ".join(_spoken(row)) for row in rows[:MOST_ROWS]) or sentence_of(summary)
        return Card(title, line, ("name", "value", "+/-", "unit", "interval"), rows[:MOST_ROWS])


def _verdict(summary: Any) -> str:
    """Status, verdict and gap, as far as a result has them."""
    said = [summary.status]
    if getattr(summary, "verdict", None):
        said = [f"{summary.verdict} {', '.join(getattr(summary, 'added', ()))}".strip(), summary.status]
    gap = getattr(getattr(summary, "gap", None), "total", None)
    if isinstance(gap, float):
        said.append(f"gap {gap:.2f}")
    for part in ("records", "items"):
        if isinstance(found := getattr(summary, part, None), dict) and found:
            said.append(f"{len(found)} {part if len(found) > 1 else part[:-1]}")
    return ", ".join(said)


def _rows(summary: Any) -> list[tuple[str, ...]]:
    """Name, value, error, unit and interval of what all records share."""
    from fibrefit.report.text import parameter_row, with_error

    rows: list[tuple[str, ...]] = []
    for name, found in getattr(summary, "parameters", {}).items():
        if isinstance(found, float):
            rows.append((name, f"{found:.5g}", "", "", ""))
        elif hasattr(found, "mean"):
            value, error, unit = with_error(found.mean, found.sd, found.unit)
            rows.append((name, value, error, unit, ""))
        else:
            rows.append(parameter_row(name, found))
    return rows


def _spoken(row: tuple[str, ...]) -> list[str]:
    name, value, error, unit, _ = row
    return [part for part in (name, value, f"+/- {error}" if error else "", unit) if part and part != "-"]
