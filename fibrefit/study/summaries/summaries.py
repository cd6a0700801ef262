"""The summary files of results: what programs read, and what the terminal report is written from."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.held_against import ComparedModel, CrossCheckSummary, CrossValidationSummary
from fibrefit.study.summaries.part import Interval, Known, KnownInterval, Measure, OrNan, Part
from fibrefit.study.summaries.pooled import PopulationSummary, TrendSummary


class ParameterSummary(Part):
    """An identified parameter; all numbers in `unit`."""

    value: float
    std_error: Known = Field(default=None, description="Standard error; null where it is held or not determined.")
    interval_95: KnownInterval = Field(default=None, description="95 % interval.")
    unit: str
    free: bool = True
    at_bound: bool = False
    std_errors: dict[str, Known] = Field(
        default_factory=dict,
        description="Standard error by method: white (of ordinary least squares under white noise), spectrum, "
        "newey_west, block_bootstrap, windows for a motion that is followed in windows, and, where residuals are more "
        "than noise, discrepancy. Where the estimate is "
        "that of generalised least squares: whitened, which allows "
        "for differences between records, and alike, if there were none.",
    )
    interval_kind: str = Field(
        default="normal",
        description="Of what it is, and how it was found; normal: of a value that all records share; population: of "
        "the mean of a parameter that differs from record to record, as wide as so few records ask for; record: "
        "normal, of a value that one record has for itself, or of the only record that there is; profile likelihood: "
        "of a value that all records share, by fit --profile; posterior: mean and sd of a posterior, in a prediction "
        "from it, without an interval.",
    )
    plain_value: Known = Field(
        default=None,
        description="Ordinary least squares estimate, where the value is the generalised least squares one.",
    )
    plain_error: Known = Field(default=None, description="Its standard error, autocorrelated noise allowed for.")
    prior_centre: Known = Field(default=None, description="Of its prior: mean, 0 if half-normal, median if log-normal.")
    prior_error: Known = Field(default=None, description="Of its prior: sd; if log-normal, that of ln times value.")
    common_error: Known = Field(default=None, description="Part of the error due to priors: alike in all records.")


class ChannelGap(Part):
    """Residual of one channel: measured minus simulated."""

    rms: OrNan = Field(description="Root mean square of measured minus simulated, in `unit`; null if not known.")
    unit: str
    noise: Known = Field(default=None, description="Root mean square of the channel's noise, in `unit`.")
    ratio: Known = Field(default=None, description="Normalised residual RMS: rms over noise; 1 is expected.")
    explained: Known = Field(
        default=None,
        description="Share of the variance of the signal within each record that the model explains; within each "
        "window, about a uniform motion, on a rig simulated in windows; of a force that drives the rig, by inverse "
        "dynamics.",
    )

    @classmethod
    def beside(cls, noise: float, rms: float, unit: str, explained: float = math.nan) -> Self:
        """A residual with its ratio to the noise, both in `unit`; nan stands for what is not known."""
        return cls(rms=rms, unit=unit, noise=noise, ratio=rms / noise, explained=explained)


class Gap(BaseModel):
    """The gap, or normalised residual RMS, of each channel by name, and their root mean square."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)
    __pydantic_extra__: dict[str, ChannelGap] = Field(init=False)

    total: Known = Field(default=None, description="Root of the mean of the squared ratios; all channels count alike.")

    @property
    def channels(self) -> dict[str, ChannelGap]:
        """The gap of each channel."""
        return dict(self.__pydantic_extra__)

    def ratio_of(self, channel: str) -> float | None:
        """The gap of a channel over its noise; None for one that is not judged by its noise, or not stated here."""
        found = self.__pydantic_extra__.get(channel)
        return None if found is None else found.ratio


class ConditionSummary(Part):
    """A number that holds for one record, stated for it or under ``[rig]``."""

    value: float
    unit: str
    std_error: Known = Field(default=None, description="Its stated uncertainty; of one that was found, its error.")
    found: bool = Field(default=False, description="Whether it was found from the record, as a lift that none states.")


class RecordSummary(Part):
    """What was found about one record, and under which conditions."""

    files: tuple[str, ...] = Field(default=(), description="Its measured data, by the names that the study has.")
    conditions: dict[str, ConditionSummary] = Field(
        default_factory=dict, description="In SI units; without constants that are parameters of all records."
    )
    gap: Gap
    parameters: dict[str, ParameterSummary] = Field(
        default_factory=dict, description="Values of this record alone, such as position_zero and release."
    )
    speeds: dict[str, tuple[float, float, float]] = Field(
        default_factory=dict, description="That tell of a parameter, in m/s: slow end, root mean square, fast end."
    )
    samples: int | None = None
    masked: int | None = Field(default=None, description="Readings left out as damaged, of all channels together.")
    notes: tuple[str, ...] = Field(
        default=(), description="What of its files is damaged, missing or not understood, in sentences."
    )


class Basin(Part):
    """A minimum in which some of the starts ended."""

    cost: float = Field(description="Excess over the cost of the best minimum, as a share of it.")
    starts: int
    parameters: dict[str, float] = Field(default_factory=dict, description="In SI.")


class StartsSummary(Part):
    """Multistart: whether the starts agree on the minimum."""

    tried: int
    agreeing: int
    basins: tuple[Basin, ...] = ()


class Provenance(Part):
    """What a result rests on, so that it can be made again."""

    created: str = Field(description="UTC, ISO 8601.")
    versions: dict[str, str]
    inputs: dict[str, str] = Field(description="SHA-256 of every file that was read.")
    resolved_study: str = Field(description="The study as TOML, with all defaults and overrides in it.")
    seed: int | None = None
    settings: dict[str, str] = Field(default_factory=dict, description="All else the result depends on, by option.")
    seconds: Known = Field(default=None, description="Wall time of the computation.")


class InputErrorSummary(Part):
    """Error that was estimated in a measured input, and subtracted from it (errors in variables)."""

    rms: OrNan
    noise: float = Field(description="Noise rms of the input.")
    unit: str
    looked_for: Known = Field(
        default=None,
        description="Rms that its noise has at the frequencies at which errors are looked for; all of it where None.",
    )

    @property
    def times_expected(self) -> float:
        """Error over what the noise would let it be at the frequencies at which it is looked for."""
        return self.rms / (self.noise if self.looked_for is None else self.looked_for)


class BetweenRecordsSummary(Part):
    """How much records differ in a parameter, beyond its error."""

    sd: float = Field(description="Relative standard deviation between records, posterior median; 0 where they agree.")
    interval_95: Interval = Field(description="95 % interval of it.")
    unit: Literal["1"] = "1"
    agree: Known = Field(default=None, description="Probability that the records do not differ in it.")
    rms: Known = Field(
        default=None,
        description="Root of the posterior mean of its square: the standard deviation of what a new record may differ "
        "by from the mean of the population. Null in results of before it was told.",
    )

    @property
    def found(self) -> bool:
        """Whether records differ more probably than not."""
        return self.agree is not None and self.agree < 0.5


class CorrelationSummary(Part):
    """Two values that records determine together rather than each by itself."""

    pair: tuple[str, str]
    correlation: Annotated[float, Field(ge=-1, le=1)]


class StatisticsSummary(Part):
    """How much was fitted to how much."""

    samples: int = Field(description="Samples that count, of all channels.")
    free_values: int = Field(description="Values that were fitted, those of single records included.")
    chi_square: float = Field(
        description="Sum of the squared residuals in units of the noise. Where inputs have errors, "
        "samples of which the problem linearised in these tells little count less."
    )
    bic: Known = Field(
        default=None,
        description="Bayesian information criterion, chi-square + free values * ln(samples): for models of the same "
        "records; it takes each sample for one by itself. None where inputs have errors or records differ.",
    )


class FitResultSummary(Part):
    """What the summaries of a fit and of a discovery share."""

    status: Status
    study: str
    rig: str | None = Field(default=None, description="Kind of the rig.")
    parameters: dict[str, ParameterSummary]
    gap: Gap
    expected_gap: Known = Field(
        default=None,
        description="Of a perfect model: below 1 where errors of measured inputs are fitted and take noise along.",
    )
    input_errors: dict[str, InputErrorSummary] = Field(
        default_factory=dict, description="Errors that were found in measured inputs."
    )
    records: dict[str, RecordSummary]
    between_records: dict[str, BetweenRecordsSummary] = Field(
        default_factory=dict,
        description="Differences between records in each parameter that may differ; empty where they were not sought.",
    )
    checks: tuple[Check, ...]
    starts: StartsSummary | None = None
    effects: tuple[str, ...] = Field(default=(), description="Effects of the final model.")
    own_parameters: tuple[str, ...] = Field(
        default=(), description="Parameters of the model that each record has for itself (shared = false)."
    )
    estimator: str | None = Field(default=None, description="Ordinary (plain) or generalised (whitened) least squares.")
    estimator_says: str | None = Field(default=None, description="Why it is this one, in words.")
    error_method: str | None = Field(default=None, description="Method behind the reported standard errors.")
    error_inflation: Known = Field(
        default=None,
        description="Reported standard errors over those of ordinary least squares under white noise, median.",
    )
    correlations: tuple[CorrelationSummary, ...] = Field(
        default=(), description="Pairs of shared parameters whose errors are correlated by more than 0.7, either way."
    )
    statistics: StatisticsSummary | None = None
    findings: tuple[str, ...] = Field(default=(), description="What the data do and do not determine, in words.")
    advice: tuple[str, ...] = Field(default=(), description="What to do next, in words.")
    provenance: Provenance | None = None

    @property
    def bars_allow(self) -> bool:
        """Whether error bars allow for what the model lacks; those of noise do not, whatever spectrum it has."""
        return self.error_method == "discrepancy"


class FitSummary(FitResultSummary):
    """``summary.json`` of a fit."""

    schema_name: Literal["fibrefit/fit/1"] = Field(default="fibrefit/fit/1", alias="schema")


class PosteriorParameter(Part):
    """The posterior of one parameter; all numbers in `unit`."""

    mean: float
    sd: float
    median: float
    interval: Interval
    unit: str
    r_hat: Known = None
    ess_bulk: Known = None
    ess_tail: Known = None
    prior: str = Field(default="", description="The prior in words.")
    prior_share: Known = Field(
        default=None, description="Posterior over prior width, 0 to 1: 1 where the data tell nothing."
    )
    fitted: Known = Field(default=None, description="Value of the fit the walkers were initialised around.")


class ModeSummary(Part):
    """One mode of a posterior."""

    weight: float = Field(description="Share of the posterior's mass, 0 to 1.")
    sampled: bool = Field(description="Whether it was heavy enough to be sampled.")
    parameters: dict[str, float] = Field(description="Its highest point, in SI.")


class PosteriorSummary(Part):
    """``summary.json`` of a posterior."""

    schema_name: Literal["fibrefit/posterior/1"] = Field(default="fibrefit/posterior/1", alias="schema")
    status: Status
    study: str
    rig: str | None = Field(default=None, description="Kind of the rig.")
    effects: tuple[str, ...] = Field(default=(), description="Effects of the model.")
    parameters: dict[str, PosteriorParameter]
    records: dict[str, dict[str, PosteriorParameter]] = Field(
        default_factory=dict, description="Values of each record alone, such as position_zero and release."
    )
    between_records: dict[str, BetweenRecordsSummary] = Field(
        default_factory=dict,
        description="Differences between records in each parameter that may differ; empty where they were not sought.",
    )
    interval_kind: Literal["equal_tailed", "highest_density"]
    interval_probability: Annotated[float, Field(gt=0, lt=1)]
    likelihood: str
    likelihood_says: str = Field(default="", description="Why this likelihood, in words.")
    ensembles: int
    walkers: int
    draws: int
    steps: int | None = Field(default=None, description="Of each ensemble, warm-up included.")
    warm_up: int | None = Field(default=None, description="Steps discarded as warm-up.")
    ended: Literal["converged", "budget"] | None = Field(default=None, description="What ended the run.")
    acceptance: Known = Field(default=None, description="Share of moves accepted.")
    modes: tuple[ModeSummary, ...] = ()
    gap: Gap = Field(
        default=Gap(),
        description="Residuals at the mode, errors of inputs taken off, each record with its own deviations; empty in "
        "results of before it was told.",
    )
    covered: dict[str, float] = Field(
        default_factory=dict,
        description="Posterior predictive check: share of the samples inside the 90 % band, by channel.",
    )
    log_evidence: Measure | None = Field(
        default=None, description="Logarithm of the marginal likelihood; null where a prior is not proper."
    )
    cross_validation: CrossValidationSummary | None = None
    compared: tuple[ComparedModel, ...] = ()
    second_opinion: CrossCheckSummary | None = None
    fit_status: Status | None = Field(default=None, description="Of the fit the walkers were initialised around.")
    remarks: tuple[str, ...] = Field(default=(), description="What a reader should know besides the checks.")
    checks: tuple[Check, ...]
    advice: tuple[str, ...] = ()
    provenance: Provenance | None = None


class BatchItem(Part):
    """One identification of a batch."""

    status: Status | None = Field(default=None, description="null where it was not carried out.")
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)
    gap: Known = None
    lacks: tuple[str, ...] = Field(
        default=(), description="Quantities by which its model leaves more than noise, such as `residual size`."
    )
    conditions: dict[str, float] = Field(default_factory=dict, description="Of its record, in SI units.")
    condition_errors: dict[str, float] = Field(default_factory=dict, description="Of those not known exactly, in SI.")
    speeds: dict[str, float] = Field(default_factory=dict, description="Root mean square by parameter, in m/s.")
    shrunk: dict[str, Measure] = Field(default_factory=dict, description="Values drawn to the mean of all, in SI.")
    result: str | None = Field(default=None, description="Folder of its summary (no arrays), relative to this file.")
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
