"""The summary file of a series: what its records say together."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.part import Interval, Known, Part
from fibrefit.study.summaries.pooled import PopulationSummary, TrendSummary
from fibrefit.study.summaries.summaries import ParameterSummary, Provenance

Answer = Literal["constant", "speed_law", "per_record"]


class RivalSummary(Part):
    """One of the three models."""

    log_bayes_factor: float = Field(description="Natural logarithm of the Bayes factor over constant parameters.")
    gap: float = Field(description="Normalised residual RMS.")
    gap_left_out: float = Field(description="The same of records that are predicted from the others.")
    elpd: float = Field(
        description="Expected log predictive density of leave-one-record-out cross-validation: that of each record "
        "given the others, summed, over that of constant parameters."
    )
    laws: tuple[str, ...] = Field(default=(), description="Effects that make parameters depend on speed.")
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)


class LawSummary(Part):
    """A law of speed that was tried on top of constant parameters."""

    effect: str
    parameter: str
    form: str
    log_bayes_factor: float
    linearised: bool = Field(
        default=False, description="Whether that is what linearisation predicts: the law was not fitted."
    )
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)


class SpeedCurveSummary(Part):
    """A parameter over speed, as its law says."""

    parameter: str
    effect: str
    form: str
    unit: str
    speeds: tuple[float, ...] = Field(description="In m/s.")
    values: tuple[float, ...]
    low: tuple[float, ...] = Field(description="Lower end of the 95 % band.")
    high: tuple[float, ...]


class OwnSummary(Part):
    """What one record says by itself, and drawn to the others by as much as it is uncertain."""

    value: float
    std_error: float = Field(description="Of the record alone, by which records are compared.")
    common_error: float = Field(default=0.0, description="Further error, alike in all records: of what they share.")
    shrunk: Known = None
    shrunk_error: Known = Field(default=None, description="Both parts together.")
    unit: str


class SeriesRecord(Part):
    """One record of a series."""

    speeds: dict[str, Interval] = Field(
        description="By parameter: speeds in m/s between which 90 % of the samples lie that tell of it."
    )
    conditions: dict[str, float] = Field(default_factory=dict, description="In SI units.")
    condition_errors: dict[str, float] = Field(default_factory=dict, description="Of those not known exactly, in SI.")
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
    laws: tuple[LawSummary, ...] = Field(description="Every law tried by itself, the most probable first.")
    indistinguishable: tuple[str, ...] = Field(default=(), description="Laws as probable as the one that was taken.")
    curves: tuple[SpeedCurveSummary, ...] = ()
    population: dict[str, PopulationSummary] = Field(default_factory=dict)
    records: dict[str, SeriesRecord]
    trends: tuple[TrendSummary, ...] = ()
    checks: tuple[Check, ...]
    advice: tuple[str, ...] = ()
    provenance: Provenance | None = None
