"""``summary.json`` of what records can show, and of a plan of the next ones."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from fibrefit.study.summaries.check import Status
from fibrefit.study.summaries.discovery import Detectable, Separation
from fibrefit.study.summaries.part import Known, Part
from fibrefit.study.summaries.summaries import Provenance


class DistinguishSummary(Part):
    """``summary.json`` of ``distinguish``: which effects the records can show, and tell from each other."""

    schema_name: Literal["fibrefit/distinguish/1"] = Field(default="fibrefit/distinguish/1", alias="schema")
    status: Status = "ok"
    study: str
    rig: str
    records: tuple[str, ...]
    planned: bool = Field(description="Whether the records are only planned.")
    remarks: tuple[str, ...] = ()
    effects: tuple[Detectable, ...]
    cosine: tuple[tuple[float, ...], ...] = Field(
        description="|cosine| of what any two effects change beyond what base parameters can imitate, in the order of "
        "`effects`; 1 is not separable, 0 also where the records do not show one of them."
    )
    cannot_tell_apart: tuple[tuple[str, str], ...] = ()
    cannot_see: tuple[str, ...] = ()
    best_further_record: Separation | None = None
    provenance: Provenance | None = None


class FurtherRecord(Part):
    """A record that could be taken next, and what it would add to those at hand."""

    like: str = Field(description="Record of the study that it is like.")
    conditions: dict[str, float] = Field(description="In which it differs from that one, in SI units.")
    pace: float = Field(description="Factor on how fast its input runs.")
    size: float = Field(description="Factor on how far its input runs.")
    minutes: float = Field(description="What it costs, the time that a slower motion takes included.")
    errors: dict[str, float] = Field(
        description="Factor on the standard error of each parameter that the records at hand determine."
    )
    newly_determined: tuple[str, ...] = Field(default=(), description="Parameters that only the further record does.")
    limits: dict[str, float] = Field(
        description="Factor on the detection limit of each effect that the records at hand show."
    )
    newly_shown: tuple[str, ...] = Field(default=(), description="Effects that only the further record shows.")
    probability_distinguished: Known = Field(
        default=None, description="Probability that the rivals are distinguished with it; null without rivals."
    )
    nats: Known = Field(default=None, description="Expected logarithm of the likelihood ratio of the rivals with it.")
    looked_into: bool | None = Field(
        default=None,
        description="Whether the rivals were fitted to it too; where not, slopes alone say what it tells, which mostly "
        "promise too much. Null without rivals.",
    )
    says: str


class PlanSummary(Part):
    """``summary.json`` of a plan: the next records, the most useful first."""

    schema_name: Literal["fibrefit/plan/1"] = Field(default="fibrefit/plan/1", alias="schema")
    status: Status = "ok"
    study: str
    rig: str
    records: tuple[str, ...] = Field(description="Those at hand.")
    purpose: Literal["errors", "rivals", "power"] = Field(description="What the records are ranked by.")
    rivals: tuple[str, str] | None = None
    probability_distinguished_now: Known = Field(
        default=None, description="Probability that records like those at hand distinguish the rivals; see `ahead`."
    )
    ahead: Known = Field(
        default=None,
        description="Nats by which the records at hand make the first rival more probable; null where they do not show "
        "both. Where it is known, the probabilities rest on it.",
    )
    further: tuple[FurtherRecord, ...]
    reach: dict[str, tuple[float, float]] = Field(
        default_factory=dict,
        description="Least and most of each condition that further records have, in SI units: as [limits] of the study "
        "state it, else what records at hand have, wider by a factor at either end.",
    )
    limits_stated: tuple[str, ...] = Field(default=(), description="Those of them that the study states.")
    remarks: tuple[str, ...] = ()
    provenance: Provenance | None = None
