"""What a posterior was held against: blocks of its own records left out, other models, and another sampler."""

from __future__ import annotations

from pydantic import Field

from fibrefit.study.summaries.part import Known, Measure, Part


class CrossValidationSummary(Part):
    """Leave-one-block-out cross-validation by Pareto-smoothed importance sampling (PSIS-LOO)."""

    total: Measure = Field(description="elpd_loo: sum of the expected log predictive densities of the blocks.")
    blocks: int
    unsure: int = Field(description="Blocks with Pareto k above 0.7, whose figure is unreliable.")
    effective_parameters: float = Field(description="p_loo: effective number of parameters.")


class ComparedModel(Part):
    """Another posterior of the same data; differences are positive where this one predicts or explains it better."""

    result: str
    study: str
    effects: tuple[str, ...]
    elpd: Measure = Field(description="Difference of elpd_loo.")
    blocks: int | None = Field(default=None, description="Blocks of time that it is the sum of.")
    unsure: int | None = Field(
        default=None, description="Of these, blocks with Pareto k above 0.7 under one of both models."
    )
    elpd_sure: Measure | None = Field(
        default=None, description="The same difference of the other blocks alone; null where fewer than two are left."
    )
    log_evidence: Measure | None = Field(
        default=None,
        description="Difference of the log marginal likelihoods: log Bayes factor; null where one of them is not "
        "known, or noise is not of the same kind in both.",
    )
    same_noise: bool = Field(
        default=True,
        description="Whether noise is of the same kind in both: marginal likelihoods do not pay for the numbers of a "
        "spectrum.",
    )


class CrossCheckSummary(Part):
    """Cross-check of the posterior with the No-U-Turn sampler (NUTS)."""

    agrees: bool
    draws: int
    divergent: int
    scores: dict[str, Known] = Field(
        description="Difference of the means over its Monte-Carlo error; null, as what follows, where no chain of NUTS "
        "has moved."
    )
    spread: dict[str, Known] = Field(description="Ratio of the standard deviations.")
    spread_scores: dict[str, Known] = Field(
        default_factory=dict, description="Logarithm of that ratio over its Monte-Carlo error."
    )
    r_hat: dict[str, Known] = Field(default_factory=dict, description="Between the chains of NUTS.")
