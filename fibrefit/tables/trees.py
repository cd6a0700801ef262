"""Groups of a result as a tree of xarray, which ArviZ reads as it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fibrefit.study.summaries.part import Groups

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
    sets: dict[str, xr.Dataset] = {}
    for key, group in groups.items():
        if key in NO_ARRAYS or not group:
            continue
        variables: dict[str, tuple[Any, np.ndarray, dict[str, str]]] = {}
        for name, variable in group.items():
            # A tree has a slash, as in the path of a record, for the way to another group.
            plain = name.replace("/", "_")
            while plain != name and (plain in group or plain in variables):
                plain += "_"
            described = {"units": variable.unit, **({"long_name": variable.doc} if variable.doc else {})}
            variables[plain] = (variable.dims, np.asarray(variable.values), described)
        sizes = {
            dim: size for dims, values, _ in variables.values() for dim, size in zip(dims, values.shape, strict=True)
        }
        own = {name: variables.pop(name) for name in [n for n, variable in variables.items() if variable[0] == (n,)]}
        counted = {dim: (dim, np.arange(size)) for dim, size in sizes.items() if dim not in own}
        sets[key] = xr.Dataset(variables, coords={**counted, **own})
    if "log_likelihood" in sets:
        scored = sets["log_likelihood"]["draw"].values
        sets |= {name: sets[name].sel(draw=scored) for name in ("posterior", "sample_stats") if name in sets}
        # ArviZ takes every variable of this group for a likelihood, and their exponential for weights: they are given
        # without what any model of the same readings has.
        said = [name for name, variable in sets["log_likelihood"].items() if "draw" not in variable.dims]
        likelihood = sets["log_likelihood"].set_coords(said)
        beyond = (likelihood["readings"] - likelihood["usual"]).assign_attrs(likelihood["readings"].attrs)
        sets["log_likelihood"] = likelihood.assign(readings=beyond)
    if "posterior" in sets:
        sets = {name: one.rename({"sample": INSTANT}) if "sample" in one.dims else one for name, one in sets.items()}
    tree: xr.DataTree = xr.DataTree.from_dict(sets)
    tree.attrs.update(attributes)
    return tree
