"""What was found, as numbers and names; `fibrefit.report.sentences` puts it into words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Statement:
    """What was found besides the checks.

    Parameters
    ----------
    identifier : str
        By which its sentence is found.
    facts : mapping of str to object
        What the sentence needs, in SI units.
    """

    identifier: str
    facts: Mapping[str, Any] = field(default_factory=dict)
