"""Every threshold of a posterior decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.report import posterior as report
from fibrefit.report.sentences.posterior import posterior_sentence
from fibrefit.sampling import checks as judge
from fibrefit.sampling import compare, thresholds
from fibrefit.sampling.compare import CrossValidation
from fibrefit.sampling.posterior import Marginal
from fibrefit.sampling.settings import Settings
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

SETTINGS = Settings()
NAMES = ("a", "b")


def course(**found: Any) -> Any:
    """A run that is sound but for what is said."""
    mixing = {"r_hat": 1.0, "ess_bulk": 1e4, "ess_tail": 1e4, "r_hat_walkers": 1.0}
    mixing |= {name: found.pop(name) for name in list(found) if name in mixing}
    arrays = {name: np.full(2, value) for name, value in mixing.items()}
    points = found.pop("points", np.random.default_rng(0).standard_normal((1, 5000, 1, 2)))
    run = {"points": points, "kept": points, "acceptance": np.full((1, 4), 0.4), "mixing": SimpleNamespace(**arrays)}
    return SimpleNamespace(**(run | found))


def correlated(by: float) -> Any:
    """A run whose two coordinates are correlated by exactly so much."""
    white = np.random.default_rng(0).standard_normal((5000, 2))
    white = (white - white.mean(axis=0)) @ np.linalg.inv(np.linalg.cholesky(np.cov(white.T))).T
    drawn = white @ np.linalg.cholesky(np.array([[1.0, by], [by, 1.0]])).T
    return course(points=drawn.reshape(1, 5000, 1, 2))


def modes(weight: float) -> Any:
    """Two modes, the second of so much weight."""
    one = lambda mass: SimpleNamespace(  # noqa: E731
        weight=mass, absorbed=False, approximation=SimpleNamespace(centre=np.zeros(2))
    )
    return [one(1.0 - weight), one(weight)]


TARGET = cast(
    Any, SimpleNamespace(names=NAMES, units=("N", "m"), size=2, values=lambda points: np.zeros((len(points), 2)))
)


def marginal(share: float, gap: float = 5.0) -> dict[str, Marginal]:
    """A parameter whose posterior is so wide beside its prior, and so far from its lower bound."""
    prior = cast(Any, SimpleNamespace(lower=0.0, upper=100.0))
    return {"a": Marginal("a", "N", 10.0, 1.0, 10.0, (gap, gap + 4.0), 1.0, 1e4, 1e4, prior, share)}


def alike(difference: float) -> bool:
    """Whether two models count as alike, so many standard errors apart."""
    rival = SimpleNamespace(
        foresight=SimpleNamespace(value=difference, error=1.0), log_evidence=None, effects=(), result="results/other"
    )
    return "alike" in "".join(report._rivals([cast(Any, rival)]))


def at(distance: float) -> bool:
    run = correlated(0.0)
    start = run.kept.reshape(-1, 2).mean(axis=0) + np.array([distance, 0.0])
    return judge.start_is_near(TARGET, run, start).passed


CASES = (
    Bracket(
        "HOPELESS_R_HAT", judge, lambda x: not judge.ensembles_agree(NAMES, course(r_hat=x), SETTINGS).fatal, 1.05, 1.15
    ),
    Bracket(
        "HOPELESS_ESS", judge, lambda x: not judge.draws_suffice(NAMES, course(ess_tail=x), SETTINGS).fatal, 60.0, 40.0
    ),
    Bracket(
        "STUCK",
        judge,
        lambda x: judge.walkers_mix(NAMES, course(acceptance=np.full((1, 4), x)), SETTINGS).passed,
        0.025,
        0.015,
    ),
    Bracket("SECOND_MODE", judge, lambda x: judge.one_mode(modes(x), TARGET).passed, 0.008, 0.012),
    Bracket("UNCONTRACTED", judge, lambda x: judge.contraction(marginal(x)).passed, 0.7, 0.9),
    Bracket(
        "PRIOR_MATTERS",
        judge,
        lambda x: "matters" not in posterior_sentence(judge.contraction(marginal(x))),
        0.25,
        0.35,
    ),
    Bracket("STRONG_CORRELATION", judge, lambda x: judge.correlation(NAMES, correlated(x)).passed, 0.99, 0.9975),
    Bracket("FAR_FROM_START", judge, at, np.sqrt(2.0) + 3.0, np.sqrt(2.0) + 5.0),
    Bracket("DECISIVE", report, alike, 1.5, 2.5),
    Bracket("PARETO_K", compare, lambda x: CrossValidation(np.zeros(1), np.array([x]), 0.0).unreliable == 0, 0.6, 0.8),
    Bracket("TRUNCATED", judge, lambda x: judge.truncation(marginal(0.1, x)).passed, 0.15, 0.07),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_residuals_of_a_posterior_may_be_as_large_as_those_of_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    passes = lambda ratio: judge.residual_size(("force",), np.array([ratio])).passed  # noqa: E731
    Bracket("GAP_OF_NOISE", judge, passes, 1.05, 1.15).test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
