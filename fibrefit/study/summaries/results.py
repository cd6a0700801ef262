"""Summary files of single results: what programs read, and what the terminal report is written from."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.part import Interval, Known, KnownInterval, Measure, OrNan, Part


class ParameterSummary(Part):
    """An identified parameter; all numbers in `unit`."""

    value: float
    std_error: Known = None
    """Standard error; null where it is held or not determined."""
    interval_95: KnownInterval = None
    """95 % interval."""
    unit: str
    free: bool = True
    at_bound: bool = False
    std_errors: dict[str, Known] = Field(default_factory=dict)
    """Standard error by method: white (of ordinary least squares under white noise), spectrum, newey_west,
    block_bootstrap, windows for a motion that is followed in windows, and, where residuals are more than noise,
    discrepancy. Where the estimate is that of generalised least squares: whitened, which allows for differences between
    records, and alike, if there were none."""
    interval_kind: str = "normal"
    """Of what it is, and how it was found; normal: of a value that all records share; population: of the mean of a
    parameter that differs from record to record, as wide as so few records ask for; record: normal, of a value that one
    record has for itself, or of the only record that there is; profile likelihood: of a value that all records share,
    by fit --profile; posterior: mean and sd of a posterior, in a prediction from it, without an interval."""
    plain_value: Known = None
    """Ordinary least squares estimate, where the value is the generalised least squares one."""
    plain_error: Known = None
    """Its standard error, autocorrelated noise allowed for."""
    prior_centre: Known = None
    """Of its prior: mean, 0 if half-normal, median if log-normal."""
    prior_error: Known = None
    """Of its prior: sd; if log-normal, that of ln times value."""
    common_error: Known = None
    """Part of the error due to priors: alike in all records."""


class ChannelGap(Part):
    """Residual of one channel: measured minus simulated."""

    rms: OrNan
    """Root mean square of measured minus simulated, in `unit`; null if not known."""
    unit: str
    noise: Known = None
    """Root mean square of the channel's noise, in `unit`."""
    ratio: Known = None
    """Normalised residual RMS: rms over noise; 1 is expected."""
    explained: Known = None
    """Share of the variance of the signal within each record that the model explains; within each window, about a
    uniform motion, on a rig simulated in windows; of a force that drives the rig, by inverse dynamics."""

    @classmethod
    def against_noise(cls, noise: float, rms: float, unit: str, explained: float = math.nan) -> Self:
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
    std_error: Known = None
    """Its stated uncertainty; of one that was found, its error."""
    found: bool = False
    """Whether it was found from the record, as a lift that none states."""


class RecordSummary(Part):
    """What was found about one record, and under which conditions."""

    files: tuple[str, ...] = ()
    """Its measured data, by the names that the study has."""
    conditions: dict[str, ConditionSummary] = Field(default_factory=dict)
    """In SI units; without constants that are parameters of all records."""
    gap: Gap
    parameters: dict[str, ParameterSummary] = Field(default_factory=dict)
    """Values of this record alone, such as position_zero and release."""
    speeds: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    """That tell of a parameter, in m/s: slow end, root mean square, fast end."""
    samples: int | None = None
    masked: int | None = None
    """Readings left out as damaged, of all channels together."""
    notes: tuple[str, ...] = ()
    """What of its files is damaged, missing or not understood, in sentences."""


class Basin(Part):
    """A minimum in which some of the starts ended."""

    cost: float
    """Excess over the cost of the best minimum, as a share of it."""
    starts: int
    parameters: dict[str, float] = Field(default_factory=dict)
    """In SI."""


class StartsSummary(Part):
    """Multistart: whether the starts agree on the minimum."""

    tried: int
    agreeing: int
    basins: tuple[Basin, ...] = ()


class Provenance(Part):
    """What a result rests on, so that it can be made again."""

    created: str
    """UTC, ISO 8601."""
    versions: dict[str, str]
    inputs: dict[str, str]
    """SHA-256 of every file that was read."""
    resolved_study: str
    """The study as TOML, with all defaults and overrides in it."""
    seed: int | None = None
    settings: dict[str, str] = Field(default_factory=dict)
    """All else the result depends on, by option."""
    seconds: Known = None
    """Wall time of the computation."""


class InputErrorSummary(Part):
    """Error that was estimated in a measured input, and subtracted from it (errors in variables)."""

    rms: OrNan
    noise: float
    """Noise rms of the input."""
    unit: str
    looked_for: Known = None
    """Rms that its noise has at the frequencies at which errors are looked for; all of it where None."""

    @property
    def times_expected(self) -> float:
        """Error over what the noise would let it be at the frequencies at which it is looked for."""
        return self.rms / (self.noise if self.looked_for is None else self.looked_for)


class BetweenRecordsSummary(Part):
    """How much records differ in a parameter, beyond its error."""

    sd: float
    """Relative standard deviation between records, posterior median; 0 where they agree."""
    interval_95: Interval
    """95 % interval of it."""
    unit: Literal["1"] = "1"
    agree: Known = None
    """Probability that the records do not differ in it."""
    rms: Known = None
    """Root of the posterior mean of its square: the standard deviation of what a new record may differ by from the mean
    of the population. Null in results of before it was told."""

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

    samples: int
    """Samples that count, of all channels."""
    free_values: int
    """Values that were fitted, those of single records included."""
    chi_square: float
    """Sum of the squared residuals in units of the noise. Where inputs have errors, samples of which the problem
    linearised in these tells little count less."""
    bic: Known = None
    """Bayesian information criterion, chi-square + free values * ln(samples): for models of the same records; it takes
    each sample for one by itself. None where inputs have errors or records differ."""


class FitResultSummary(Part):
    """What the summaries of a fit and of a discovery share."""

    status: Status
    study: str
    rig: str | None = None
    """Kind of the rig."""
    parameters: dict[str, ParameterSummary]
    gap: Gap
    expected_gap: Known = None
    """Of a perfect model: below 1 where errors of measured inputs are fitted and take noise along."""
    input_errors: dict[str, InputErrorSummary] = Field(default_factory=dict)
    """Errors that were found in measured inputs."""
    records: dict[str, RecordSummary]
    between_records: dict[str, BetweenRecordsSummary] = Field(default_factory=dict)
    """Differences between records in each parameter that may differ; empty where they were not sought."""
    checks: tuple[Check, ...]
    starts: StartsSummary | None = None
    effects: tuple[str, ...] = ()
    """Effects of the final model."""
    own_parameters: tuple[str, ...] = ()
    """Parameters of the model that each record has for itself (shared = false)."""
    estimator: str | None = None
    """Ordinary (plain) or generalised (whitened) least squares."""
    estimator_says: str | None = None
    """Why it is this one, in words."""
    error_method: str | None = None
    """Method behind the reported standard errors."""
    error_inflation: Known = None
    """Reported standard errors over those of ordinary least squares under white noise, median."""
    correlations: tuple[CorrelationSummary, ...] = ()
    """Pairs of shared parameters whose errors are correlated by more than 0.7, either way."""
    statistics: StatisticsSummary | None = None
    findings: tuple[str, ...] = ()
    """What the data do and do not determine, in words."""
    advice: tuple[str, ...] = ()
    """What to do next, in words."""
    provenance: Provenance | None = None

    @property
    def bars_allow(self) -> bool:
        """Whether error bars allow for what the model lacks; those of noise do not, whatever spectrum it has."""
        return self.error_method == "discrepancy"


class FitSummary(FitResultSummary):
    """``summary.json`` of a fit."""

    schema_name: Literal["fibrefit/fit/1"] = Field(default="fibrefit/fit/1", alias="schema")


class CrossValidationSummary(Part):
    """Leave-one-block-out cross-validation by Pareto-smoothed importance sampling (PSIS-LOO)."""

    total: Measure
    """elpd_loo: sum of the expected log predictive densities of the blocks."""
    blocks: int
    unsure: int
    """Blocks with Pareto k above 0.7, whose figure is unreliable."""
    effective_parameters: float
    """p_loo: effective number of parameters."""


class ComparedModel(Part):
    """Another posterior of the same data; differences are positive where this one predicts or explains it better."""

    result: str
    study: str
    effects: tuple[str, ...]
    elpd: Measure
    """Difference of elpd_loo."""
    blocks: int | None = None
    """Blocks of time that it is the sum of."""
    unsure: int | None = None
    """Of these, blocks with Pareto k above 0.7 under one of both models."""
    elpd_sure: Measure | None = None
    """The same difference of the other blocks alone; null where fewer than two are left."""
    log_evidence: Measure | None = None
    """Difference of the log marginal likelihoods: log Bayes factor; null where one of them is not known, or noise is
    not of the same kind in both."""
    same_noise: bool = True
    """Whether noise is of the same kind in both: marginal likelihoods do not pay for the numbers of a spectrum."""


class CrossCheckSummary(Part):
    """Cross-check of the posterior with the No-U-Turn sampler (NUTS)."""

    agrees: bool
    draws: int
    divergent: int
    scores: dict[str, Known]
    """Difference of the means over its Monte-Carlo error; null, as what follows, where no chain of NUTS has moved."""
    spread: dict[str, Known]
    """Ratio of the standard deviations."""
    spread_scores: dict[str, Known] = Field(default_factory=dict)
    """Logarithm of that ratio over its Monte-Carlo error."""
    r_hat: dict[str, Known] = Field(default_factory=dict)
    """Between the chains of NUTS."""


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
    prior: str = ""
    """The prior in words."""
    prior_share: Known = None
    """Posterior over prior width, 0 to 1: 1 where the data tell nothing."""
    fitted: Known = None
    """Value of the fit the walkers were initialised around."""


class ModeSummary(Part):
    """One mode of a posterior."""

    weight: float
    """Share of the posterior's mass, 0 to 1."""
    sampled: bool
    """Whether it was heavy enough to be sampled."""
    parameters: dict[str, float]
    """Its highest point, in SI."""


class PosteriorSummary(Part):
    """``summary.json`` of a posterior."""

    schema_name: Literal["fibrefit/posterior/1"] = Field(default="fibrefit/posterior/1", alias="schema")
    status: Status
    study: str
    rig: str | None = None
    """Kind of the rig."""
    effects: tuple[str, ...] = ()
    """Effects of the model."""
    parameters: dict[str, PosteriorParameter]
    records: dict[str, dict[str, PosteriorParameter]] = Field(default_factory=dict)
    """Values of each record alone, such as position_zero and release."""
    between_records: dict[str, BetweenRecordsSummary] = Field(default_factory=dict)
    """Differences between records in each parameter that may differ; empty where they were not sought."""
    interval_kind: Literal["equal_tailed", "highest_density"]
    interval_probability: Annotated[float, Field(gt=0, lt=1)]
    likelihood: str
    likelihood_says: str = ""
    """Why this likelihood, in words."""
    ensembles: int
    walkers: int
    draws: int
    steps: int | None = None
    """Of each ensemble, warm-up included."""
    warm_up: int | None = None
    """Steps discarded as warm-up."""
    ended: Literal["converged", "budget"] | None = None
    """What ended the run."""
    acceptance: Known = None
    """Share of moves accepted."""
    modes: tuple[ModeSummary, ...] = ()
    gap: Gap = Gap()
    """Residuals at the mode, errors of inputs taken off, each record with its own deviations; empty in results of
    before it was told."""
    covered: dict[str, float] = Field(default_factory=dict)
    """Posterior predictive check: share of the samples inside the 90 % band, by channel."""
    log_evidence: Measure | None = None
    """Logarithm of the marginal likelihood; null where a prior is not proper."""
    cross_validation: CrossValidationSummary | None = None
    compared: tuple[ComparedModel, ...] = ()
    second_opinion: CrossCheckSummary | None = None
    fit_status: Status | None = None
    """Of the fit the walkers were initialised around."""
    remarks: tuple[str, ...] = ()
    """What a reader should know besides the checks."""
    checks: tuple[Check, ...]
    advice: tuple[str, ...] = ()
    provenance: Provenance | None = None


Verdict = Literal["holds", "does_not_hold", "not_trusted"]


class PredictedChannel(Part):
    """One channel over all records: measured minus predicted, beside what was to be expected of it."""

    rms: OrNan
    """Root mean square of measured minus predicted, in `unit`; null if not known."""
    unit: str
    explained: Known = None
    """Share of the variance of the signal within each record."""
    fit_rms: Known = None
    """The same rms where the values come from, in `unit`."""
    fit_explained: Known = None
    """The same share where the values come from."""
    expected: Known = None
    """Root mean square that noise, what the model lacked in the fit and the error bars of the values let expect, in
    `unit`; of a force that drives the rig, its rms in the fit."""
    inside: Known = None
    """Share of the samples inside the 95 % predictive band."""


class PredictionSummary(Part):
    """``summary.json`` of a prediction."""

    schema_name: Literal["fibrefit/prediction/1"] = Field(default="fibrefit/prediction/1", alias="schema")
    status: Status
    verdict: Verdict
    says: str
    """The verdict in words."""
    study: str
    """Study of the records that were predicted."""
    result: str
    """Result the values are from: its folder, or the name of its study."""
    rig: str | None = None
    effects: tuple[str, ...] = ()
    """Effects of the model, which is that of the result."""
    parameters: dict[str, ParameterSummary]
    """Values as the result has them; none was fitted."""
    channels: dict[str, PredictedChannel]
    gap: Gap
    records: dict[str, RecordSummary]
    """With zero and start, which were fitted to each record."""
    input_errors: dict[str, InputErrorSummary] = Field(default_factory=dict)
    checks: tuple[Check, ...]
    advice: tuple[str, ...] = ()
    provenance: Provenance | None = None


class JumpSummary(Part):
    """A jump of the amplitude between two neighbouring frequencies."""

    from_hz: float
    to_hz: float
    from_rad: float
    """Steady-state amplitude at the lower frequency: half the travel of the angle."""
    to_rad: float
    farthest_from_rad: float
    """Maximum |angle|, transient included, at the lower frequency."""
    farthest_to_rad: float


class PeakSummary(Part):
    """The frequency at which a branch has its largest angle."""

    frequency_hz: float
    angle_rad: float


class BranchSummary(Part):
    """One branch of the response: from rest at each frequency, or continued from the next lower or higher one."""

    peak: PeakSummary | None = None
    """Steady-state amplitude; null where all overturned."""
    farthest: PeakSummary | None = None
    """Maximum |angle|, transient included, without overturned runs."""
    largest_force_n: Known = None
    """Steady-state maximum in either fibre."""
    jumps: tuple[JumpSummary, ...] = ()
    overturned_hz: tuple[tuple[float, float], ...] = ()
    """First and last frequency of each range in which the pendulum overturns."""
    not_periodic_hz: tuple[tuple[float, float], ...] = ()
    """The same where the motion is not periodic within four periods of the drive."""
    unstable_hz: tuple[tuple[float, float], ...] = ()
    """The same where a Floquet multiplier of the motion is above 1."""
    largest_multiplier: Known = None
    """Largest modulus of a Floquet multiplier."""


class CurveSummary(Part):
    """One curve."""

    amplitude_m: float
    preload_n: float
    natural_frequency_hz: float
    """Linear natural frequency about the upright position."""
    branches: dict[str, BranchSummary]


class SweepSummary(Part):
    """``summary.json`` of a sweep over frequency."""

    schema_name: Literal["fibrefit/sweep/1"] = Field(default="fibrefit/sweep/1", alias="schema")
    status: Status
    study: str
    rig: str
    effects: tuple[str, ...] = ()
    parameters: dict[str, float]
    """Values the pendulum has, in SI."""
    lowest_hz: float
    highest_hz: float
    frequencies: int
    runs: int
    curves: dict[str, CurveSummary]
    checks: tuple[Check, ...]
    provenance: Provenance | None = None
