"""A law that was composed for what has no name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Runner:
    """Another law that was fitted.

    Parameters
    ----------
    name, says : str
    behind : float
        Logarithm of the Bayes factor over the best law: below nil.
    """

    name: str
    says: str
    behind: float


@dataclass(frozen=True)
class ProposedLaw:
    """The law that accounts best for what no effect of the catalogue does.

    Parameters
    ----------
    name : str
        Of the effect, ``port.effect``.
    title, file : str
        Of its class, and of the file in the folder ``laws`` of the result.
    says : str
    port, variable, form, expression : str
        Where it acts, on what it depends and how.
    parameters : mapping of str to (value, standard error, unit)
        In SI units.
    gain : float
        Logarithm of the Bayes factor over the model without it, the number of laws that were looked at paid for.
    gap_before, gap_after : float
        Normalised residual RMS without and with it.
    left_out_before, left_out_after : float
        The same of each record as predicted from the others; not a number where there is but one.
    runners_up : tuple of Runner
    heights : (n_knot,)
        Of the law at the knots of the free curve it stands for, without their median, in SI units.
    probe : str
        Name of that curve.
    source : str
        Of the file.
    """

    name: str
    title: str
    file: str
    says: str
    port: str
    variable: str
    form: str
    expression: str
    parameters: Mapping[str, tuple[float, float, str]]
    gain: float
    gap_before: float
    gap_after: float
    left_out_before: float
    left_out_after: float
    runners_up: tuple[Runner, ...]
    heights: np.ndarray
    probe: str
    source: str
