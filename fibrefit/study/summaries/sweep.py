"""``summary.json`` of a sweep."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fibrefit.study.summaries.summaries import CheckSummary, Part, Provenance, Status


class JumpSummary(Part):
    """A jump of the swing between two neighbouring frequencies."""

    from_hz: float
    to_hz: float
    from_rad: float = Field(description="Half the travel of the settled angle at the lower frequency.")
    to_rad: float
    farthest_from_rad: float = Field(description="Largest angle from the first instant on, at the lower frequency.")
    farthest_to_rad: float


class PeakSummary(Part):
    """The frequency at which a branch swings most."""

    frequency_hz: float
    angle_rad: float


class BranchSummary(Part):
    """One way to come to the frequencies: from rest, or on from the next lower or higher one."""

    peak: PeakSummary | None = Field(default=None, description="Of the settled motion; null where all overturned.")
    farthest: PeakSummary | None = Field(default=None, description="From the first instant on, overturned runs apart.")
    largest_force_n: float | None = Field(default=None, description="In either fibre, once settled.")
    jumps: tuple[JumpSummary, ...] = ()
    overturned_hz: tuple[tuple[float, float], ...] = Field(
        default=(), description="First and last frequency of each range in which the pendulum overturns."
    )
    not_periodic_hz: tuple[tuple[float, float], ...] = Field(
        default=(), description="The same where the motion does not repeat itself after up to four periods."
    )
    unstable_hz: tuple[tuple[float, float], ...] = Field(
        default=(), description="The same where a Floquet multiplier of the motion is above 1."
    )
    largest_multiplier: float | None = Field(default=None, description="Largest modulus of a Floquet multiplier.")


class CurveSummary(Part):
    """One curve."""

    amplitude_m: float
    preload_n: float
    natural_frequency_hz: float = Field(description="Of small oscillations about the upright position.")
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
    checks: tuple[CheckSummary, ...]
    provenance: Provenance | None = None
