"""What many records say together: parts of the summaries of batches and series."""

from __future__ import annotations

from pydantic import Field

from fibrefit.study.summaries.part import Interval, Part

SPEED_OF = "speed of "
"""How a condition begins that is such a speed."""


def speed_name(parameter: str) -> str:
    """Condition that is the speed at which a record tells of a parameter."""
    return f"{SPEED_OF}{parameter}"


class PopulationSummary(Part):
    """A parameter over the records, partially pooled."""

    unit: str
    mean: float
    mean_interval_95: Interval
    between_records: float = Field(description="Standard deviation between records; relative where `relative`.")
    between_records_interval_95: Interval
    relative: bool
    new_record_interval_95: Interval = Field(description="Where the true value of one more record lies.")
    chance: float = Field(description="Probability of values as different as these if records did not differ.")


class OutlierSummary(Part):
    """A record that does not follow a trend."""

    record: str
    score: float = Field(description="Distance from the line of the others in standard deviations.")
    chance: float


class TrendSummary(Part):
    """A parameter against a condition."""

    parameter: str
    condition: str
    slope: float
    slope_error: float
    slope_interval_95: Interval
    intercept: float
    unit: str
    condition_unit: str
    between_records: float = Field(description="Standard deviation between records about the line, in `unit`.")
    chance: float
    chance_corrected: float = Field(description="Among all looks (Holm).")
    records: int
    outliers: tuple[OutlierSummary, ...] = ()
