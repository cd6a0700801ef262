"""Groups of a result as a tree of xarray, which ArviZ reads as it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fibrefit.tables.frames import Groups

#: Groups that tell where a result comes from; their text stands in the summary too.
NO_ARRAYS = ("provenance",)
INSTANT = "instant"
"""Samples of a record beside a posterior: ArviZ lays chains and draws together and calls that ``sample``."""


def tree_of(groups: Groups, attributes: Mapping[str, Any]) -> xr.DataTree:
    """All groups of a result.

    Parameters
    ----------
    groups : mapping of group to name to Variable
    attributes : mapping
        Of the whole, such as ``schema``.

    Returns
    -------
    xarray.DataTree
        One data set a group; each variable carries ``units`` and ``long_name``. Where a posterior has the likelihood of
        some of its draws only, its draws are those: what ArviZ does with both needs the same ones.
    """
    sets = {name: _dataset(group) for name, group in groups.items() if name not in NO_ARRAYS and group}
    if "log_likelihood" in sets:
        sets |= _of_same_draws(sets)
        # ArviZ takes every variable of this group for a likelihood.
        said = [name for name, variable in sets["log_likelihood"].items() if "draw" not in variable.dims]
        sets["log_likelihood"] = _beyond_the_usual(sets["log_likelihood"].set_coords(said))
    if "posterior" in sets:
        sets = {name: one.rename({"sample": INSTANT}) if "sample" in one.dims else one for name, one in sets.items()}
    tree: xr.DataTree = xr.DataTree.from_dict(sets)
    tree.attrs.update(attributes)
    return tree


def _beyond_the_usual(likelihood: xr.Dataset) -> xr.Dataset:
    """Log likelihoods without what any model of the same readings has: ArviZ takes their exponential for weights."""
    return likelihood.assign(
        readings=(likelihood["readings"] - likelihood["usual"]).assign_attrs(likelihood["readings"].attrs)
    )


def _of_same_draws(sets: Mapping[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    scored = sets["log_likelihood"]["draw"].values
    return {name: sets[name].sel(draw=scored) for name in ("posterior", "sample_stats") if name in sets}


def _dataset(group: Mapping[str, Any]) -> xr.Dataset:
    variables = {
        name: (variable.dims, np.asarray(variable.values), _attributes(variable))
        for name, variable in zip(_names(group), group.values(), strict=True)
    }
    sizes = {dim: size for dims, values, _ in variables.values() for dim, size in zip(dims, values.shape, strict=True)}
    own = {name: variables.pop(name) for name in [n for n, variable in variables.items() if variable[0] == (n,)]}
    counted = {dim: (dim, np.arange(size)) for dim, size in sizes.items() if dim not in own}
    return xr.Dataset(variables, coords={**counted, **own})


def _names(group: Mapping[str, Any]) -> list[str]:
    """Names as a tree takes them: it has a slash, as in the path of a record, for the way to another group."""
    found: list[str] = []
    for name in group:
        plain = name.replace("/", "_")
        while plain != name and (plain in group or plain in found):
            plain += "_"
        found.append(plain)
    return found


def _attributes(variable: Any) -> dict[str, str]:
    return {"units": variable.unit, **({"long_name": variable.doc} if variable.doc else {})}
