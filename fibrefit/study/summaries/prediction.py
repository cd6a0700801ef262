"""The summary file of a prediction: how well values that were found explain records they were not found from."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.part import Known, OrNan, Part
from fibrefit.study.summaries.summaries import (
    Gap,
    InputErrorSummary,
    ParameterSummary,
    Provenance,
    RecordSummary,
)

Verdict = Literal["holds", "does_not_hold", "not_trusted"]


class PredictedChannel(Part):
    """One channel over all records: measured minus predicted, beside what was to be expected of it."""

    rms: OrNan = Field(description="Root mean square of measured minus predicted, in `unit`; null if not known.")
    unit: str
    explained: Known = Field(default=None, description="Share of the variance of the signal within each record.")
    fit_rms: Known = Field(default=None, description="The same rms where the values come from, in `unit`.")
    fit_explained: Known = Field(default=None, description="The same share where the values come from.")
    expected: Known = Field(
        default=None,
        description="Root mean square that noise, what the model lacked in the fit and the error bars of the values "
        "let expect, in `unit`; of a force that drives the rig, its rms in the fit.",
    )
    inside: Known = Field(default=None, description="Share of the samples inside the 95 % predictive band.")


class PredictionSummary(Part):
    """``summary.json`` of a prediction."""

    schema_name: Literal["fibrefit/prediction/1"] = Field(default="fibrefit/prediction/1", alias="schema")
    status: Status
    verdict: Verdict
    says: str = Field(description="The verdict in words.")
    study: str = Field(description="Study of the records that were predicted.")
    result: str = Field(description="Result the values are from: its folder, or the name of its study.")
    rig: str | None = None
    effects: tuple[str, ...] = Field(default=(), description="Effects of the model, which is that of the result.")
    parameters: dict[str, ParameterSummary] = Field(description="Values as the result has them; none was fitted.")
    channels: dict[str, PredictedChannel]
    gap: Gap
    records: dict[str, RecordSummary] = Field(description="With zero and start, which were fitted to each record.")
    input_errors: dict[str, InputErrorSummary] = Field(default_factory=dict)
    checks: tuple[Check, ...]
    advice: tuple[str, ...] = ()
    provenance: Provenance | None = None
