"""Summary files of many records: a batch, each by itself, and a series, all of them together."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.part import Interval, Known, Measure, Part
from fibrefit.study.summaries.results import ParameterSummary, Provenance

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
    between_records: float
    """Standard deviation between records; relative where `relative`."""
    between_records_interval_95: Interval
    relative: bool
    new_record_interval_95: Interval
    """Where the true value of one more record lies."""
    chance: float
    """Probability of values as different as these if records did not differ."""


class OutlierSummary(Part):
    """A record that does not follow a trend."""

    record: str
    score: float
    """Distance from the line of the others in standard deviations."""
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
    between_records: float
    """Standard deviation between records about the line, in `unit`."""
    chance: float
    chance_corrected: float
    """Among all looks (Holm)."""
    records: int
    outliers: tuple[OutlierSummary, ...] = ()


class BatchItem(Part):
    """One identification of a batch."""

    status: Status | None = None
    """null where it was not carried out."""
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)
    gap: Known = None
    lacks: tuple[str, ...] = ()
    """Quantities by which its model leaves more than noise, such as `residual size`."""
    conditions: dict[str, float] = Field(default_factory=dict)
    """Of its record, in SI units."""
    condition_errors: dict[str, float] = Field(default_factory=dict)
    """Of those not known exactly, in SI."""
    speeds: dict[str, float] = Field(default_factory=dict)
    """Root mean square by parameter, in m/s."""
    shrunk: dict[str, Measure] = Field(default_factory=dict)
    """Values drawn to the mean of all, in SI."""
    result: str | None = None
    """Folder of its summary (no arrays), relative to this file."""
    error: str | None = None

    @model_validator(mode="after")
    def _result_or_error(self) -> Self:
        if (self.status is None) == (self.error is None):
            raise ValueError("an item has either a status or an error")
        return self


class BatchSummary(Part):
    """``summary.json`` of a batch."""

    schema_name: Literal["fibrefit/batch/1"] = Field(default="fibrefit/batch/1", alias="schema")
    status: Status
    name: str
    items: dict[str, BatchItem]
    population: dict[str, PopulationSummary] = Field(default_factory=dict)
    trends: tuple[TrendSummary, ...] = ()
    checks: tuple[Check, ...] = ()
    provenance: Provenance | None = None


Answer = Literal["constant", "speed_law", "per_record"]


class RivalSummary(Part):
    """One of the three models."""

    log_bayes_factor: float
    """Natural logarithm of the Bayes factor over constant parameters."""
    gap: float
    """Normalised residual RMS."""
    gap_left_out: float
    """The same of records that are predicted from the others."""
    elpd: float
    """Expected log predictive density of leave-one-record-out cross-validation: that of each record given the others,
    summed, over that of constant parameters."""
    laws: tuple[str, ...] = ()
    """Effects that make parameters depend on speed."""
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)


class LawSummary(Part):
    """A law of speed that was tried on top of constant parameters."""

    effect: str
    parameter: str
    form: str
    log_bayes_factor: float
    linearised: bool = False
    """Whether that is what linearisation predicts: the law was not fitted."""
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)


class SpeedCurveSummary(Part):
    """A parameter over speed, as its law says."""

    parameter: str
    effect: str
    form: str
    unit: str
    speeds: tuple[float, ...]
    """In m/s."""
    values: tuple[float, ...]
    low: tuple[float, ...]
    """Lower end of the 95 % band."""
    high: tuple[float, ...]


class OwnSummary(Part):
    """What one record says by itself, and drawn to the others by as much as it is uncertain."""

    value: float
    std_error: float
    """Of the record alone, by which records are compared."""
    common_error: float = 0.0
    """Further error, alike in all records: of what they share."""
    shrunk: Known = None
    shrunk_error: Known = None
    """Both parts together."""
    unit: str


class SeriesRecord(Part):
    """One record of a series."""

    speeds: dict[str, Interval]
    """By parameter: speeds in m/s between which 90 % of the samples lie that tell of it."""
    conditions: dict[str, float] = Field(default_factory=dict)
    """In SI units."""
    condition_errors: dict[str, float] = Field(default_factory=dict)
    """Of those not known exactly, in SI."""
    parameters: dict[str, OwnSummary]
    gap_left_out: dict[Answer, float]


class SeriesSummary(Part):
    """``summary.json`` of a series."""

    schema_name: Literal["fibrefit/series/1"] = Field(default="fibrefit/series/1", alias="schema")
    status: Status
    study: str
    rig: str
    answer: Answer
    sentence: str
    models: dict[Answer, RivalSummary]
    laws: tuple[LawSummary, ...]
    """Every law tried by itself, the most probable first."""
    indistinguishable: tuple[str, ...] = ()
    """Laws as probable as the one that was taken."""
    curves: tuple[SpeedCurveSummary, ...] = ()
    population: dict[str, PopulationSummary] = Field(default_factory=dict)
    records: dict[str, SeriesRecord]
    trends: tuple[TrendSummary, ...] = ()
    checks: tuple[Check, ...]
    advice: tuple[str, ...] = ()
    provenance: Provenance | None = None
