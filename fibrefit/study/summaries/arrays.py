"""Arrays with units, as results keep them: what figures and pages ask of a variable of ``result.h5``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from fibrefit.core.units import format_quantity, typeset_unit


class Array(Protocol):
    """A variable: its values, and their SI unit."""

    @property
    def values(self) -> np.ndarray: ...  # noqa: D102
    @property
    def unit(self) -> str: ...  # noqa: D102


Groups = Mapping[str, Mapping[str, Array]]
"""Group to name to variable."""
AXES = ("record", "sample", "time")
"""Variables of a group of samples that are coordinates of the others."""
CONDITIONS = ("lift", "inclination", "added_mass")
"""Conditions worth a word beside a record's name."""


def conditions_text(constants: Mapping[str, Array], record: int) -> str:
    """What tells a record from its neighbours: ``lift 10 mm, inclination 45°``.

    Parameters
    ----------
    constants : mapping of str to Array
        Group ``constant_data`` of a result, ``(n_record,)`` each.
    record : int
        Place of the record.
    """
    stated = {name: constants[name] for name in CONDITIONS if name in constants}
    return ", ".join(
        f"{name.replace('_', ' ')} {typeset_unit(format_quantity(float(one.values[record]), one.unit))}"
        for name, one in stated.items()
        if one.values[record] != 0.0
    )
