"""``summary.json`` of a sweep."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.part import Known, Part
from fibrefit.study.summaries.summaries import Provenance


class JumpSummary(Part):
    """A jump of the amplitude between two neighbouring frequencies."""

    from_hz: float
    to_hz: float
    from_rad: float = Field(description="Steady-state amplitude at the lower frequency: half the travel of the angle.")
    to_rad: float
    farthest_from_rad: float = Field(description="Maximum |angle|, transient included, at the lower frequency.")
    farthest_to_rad: float


class PeakSummary(Part):
    """The frequency at which a branch has its largest angle."""

    frequency_hz: float
    angle_rad: float


class BranchSummary(Part):
    """One branch of the response: from rest at each frequency, or continued from the next lower or higher one."""

    peak: PeakSummary | None = Field(default=None, description="Steady-state amplitude; null where all overturned.")
    farthest: PeakSummary | None = Field(
        default=None, description="Maximum |angle|, transient included, without overturned runs."
    )
    largest_force_n: Known = Field(default=None, description="Steady-state maximum in either fibre.")
    jumps: tuple[JumpSummary, ...] = ()
    overturned_hz: tuple[tuple[float, float], ...] = Field(
        default=(), description="First and last frequency of each range in which the pendulum overturns."
    )
    not_periodic_hz: tuple[tuple[float, float], ...] = Field(
        default=(), description="The same where the motion is not periodic within four periods of the drive."
    )
    unstable_hz: tuple[tuple[float, float], ...] = Field(
        default=(), description="The same where a Floquet multiplier of the motion is above 1."
    )
    largest_multiplier: Known = Field(default=None, description="Largest modulus of a Floquet multiplier.")


class CurveSummary(Part):
    """One curve."""

    amplitude_m: float
    preload_n: float
    natural_frequency_hz: float = Field(description="Linear natural frequency about the upright position.")
    branches: dict[str, BranchSummary]


class SweepSummary(Part):
    """``summary.json`` of a sweep over frequency."""

    schema_name: Literal["fibrefit/sweep/1"] = Field(default="fibrefit/sweep/1", alias="schema")
    status: Status
    study: str
    rig: str
    effects: tuple[str, ...] = ()
    parameters: dict[str, float] = Field(description="Values the pendulum has, in SI.")
    lowest_hz: float
    highest_hz: float
    frequencies: int
    runs: int
    curves: dict[str, CurveSummary]
    checks: tuple[Check, ...]
    provenance: Provenance | None = None
