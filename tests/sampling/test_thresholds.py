"""Every threshold of a posterior decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest

from fibrefit.core.errors import UsageError
from fibrefit.problem.statement.layout import Range
from fibrefit.report.sentences.posterior import posterior_sentence
from fibrefit.sampling import evidence as found_modes
from fibrefit.sampling import nuts, settings, thresholds
from fibrefit.sampling import posterior as judge
from fibrefit.sampling import posterior as sampled
from fibrefit.sampling import predict as predictions
from fibrefit.sampling.density import prior
from fibrefit.sampling.evidence import Evidence
from fibrefit.sampling.posterior import Marginal
from fibrefit.sampling.predict import CrossValidation
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
    return {"a": Marginal("a", "N", 10.0, 1.0, 10.0, (9.9, 10.1), (gap, gap + 4.0), 1.0, 1e4, 1e4, prior, share)}


def at(distance: float) -> bool:
    run = correlated(0.0)
    start = run.kept.reshape(-1, 2).mean(axis=0) + np.array([distance, 0.0])
    return judge.start_is_near(TARGET, run, start).passed


def is_sampled(weight: float) -> bool:
    """Whether a second mode of such a weight, by Laplace's method, is sampled."""
    both = [SimpleNamespace(log_evidence=np.log(one)) for one in (1.0, weight)]
    target = cast(Any, SimpleNamespace(log_density=None))
    with (
        patch.object(found_modes, "run_ensembles", lambda *_: course()),
        patch.object(found_modes, "bridge", lambda *_: Evidence(0.0, 0.1)),
        patch.object(found_modes, "_moved", lambda mode, heavier: False),
    ):
        return found_modes.sample_modes(target, cast(Any, both), SETTINGS)[1].course is not None


def one_mode(distance: float) -> bool:
    """Whether two searches ended in one mode, so many standard deviations apart."""
    one = SimpleNamespace(log_evidence=0.0, centre=None, distance=lambda _: distance)
    return len(found_modes.distinct(cast(Any, [one, one]))) == 1


def stayed(share: float) -> bool:
    """Whether an ensemble stayed in its mode of whose draws such a share lies nearer to another one."""
    distances = np.where(np.arange(1000) < 1000.0 * share, 0.5, 2.0)
    points = np.zeros((1000, 1, 1))
    own = SimpleNamespace(
        course=SimpleNamespace(kept=points, points=points),
        approximation=SimpleNamespace(distance=lambda _: np.ones(1000)),
    )
    other = SimpleNamespace(approximation=SimpleNamespace(distance=lambda _: distances))
    return not found_modes._moved(cast(Any, own), [cast(Any, other)])


def accepted(ensembles: int) -> bool:
    """Whether so many ensembles may be asked for."""
    try:
        Settings(ensembles=ensembles)
    except UsageError:
        return False
    return True


def gains(factor: float) -> bool:
    """Whether nothing is said of the GLS estimate, whose standard error is such a share of the OLS one."""
    layout = SimpleNamespace(entries=((None, None),))
    run = SimpleNamespace(
        alike=False,
        moving=0.0,
        density=SimpleNamespace(problem=SimpleNamespace(layout=layout)),
        hausman=SimpleNamespace(efficiency=np.array([factor])),
        target=SimpleNamespace(names=("a",)),
    )
    return sampled.Posterior.remarks.fget(cast(Any, run)) == ()  # type: ignore[attr-defined]


def checked(score: float = 0.0, r_hat: float = 1.0, divergent: int = 0) -> nuts.CrossCheck:
    """A sound cross-check of one coordinate but for what is said."""
    one = np.ones(1)
    return nuts.CrossCheck(np.zeros((4, 250, 1)), divergent, np.array([score]), one, 0.0 * one, r_hat * one)


def uniform(width: float) -> bool:
    """Whether a value is as likely anywhere between limits so far from each other, in typical sizes."""
    found = prior.default_prior(
        cast(Any, SimpleNamespace(reciprocal=False, null=0.0)), Range(-0.5 * width, 0.5 * width, 1.0)
    )
    return not np.isfinite(found.spread)


CASES = (
    Bracket("WIDE_PRIOR", prior, uniform, 15.0, 30.0),
    Bracket("OVERLOOKED", found_modes, is_sampled, 1.5e-4, 0.7e-4),
    Bracket("SAME_MODE", found_modes, one_mode, 2.0, 4.5),
    Bracket("LEFT_MODE", found_modes, stayed, 0.03, 0.08),
    Bracket("FEWEST_ENSEMBLES", settings, lambda n: accepted(int(n)), 4, 3),
    Bracket("DIFFERS", nuts, lambda z: checked(score=z).agrees, 2.65, 2.95),
    Bracket("NUTS_R_HAT", nuts, lambda r_hat: checked(r_hat=r_hat).agrees, 1.04, 1.06),
    Bracket("OVERLOOKED", nuts, lambda share: checked(divergent=int(1000 * share)).agrees, 0.008, 0.012),
    Bracket("SAME_WIDTH", sampled, gains, 0.9, 0.7),
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
    Bracket("OVERLOOKED", judge, lambda x: judge.one_mode(modes(x), TARGET).passed, 0.008, 0.012),
    Bracket("SAME_WIDTH", judge, lambda x: judge.contraction(marginal(x)).passed, 0.7, 0.9),
    Bracket(
        "PRIOR_MATTERS",
        judge,
        lambda x: "matters" not in posterior_sentence(judge.contraction(marginal(x))),
        0.25,
        0.35,
    ),
    Bracket("STRONG_CORRELATION", judge, lambda x: judge.correlation(NAMES, correlated(x)).passed, 0.99, 0.9975),
    Bracket("FAR_FROM_START", judge, at, np.sqrt(2.0) + 3.0, np.sqrt(2.0) + 5.0),
    Bracket(
        "PARETO_K", predictions, lambda x: CrossValidation(np.zeros(1), np.array([x]), 0.0).unreliable == 0, 0.6, 0.8
    ),
    Bracket("TRUNCATED", judge, lambda x: judge.truncation(marginal(0.1, x)).passed, 0.15, 0.07),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.name}-{case.module.__name__.rpartition('.')[2]}")
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_other_modes_count_together_and_are_named() -> None:
    """None of three has as much as one alone must have."""
    light = [modes(0.004)[1] for _ in range(3)]
    check = judge.one_mode([*modes(0.0)[:1], *light], TARGET)
    assert not check.passed
    assert check.statistic == pytest.approx(0.012)
    assert posterior_sentence(check).count("weight 0.004 at a = 0 N") == 3
    # The negative control: those whose draws lie in the first one count for nothing.
    for mode in light:
        mode.absorbed = True
    assert judge.one_mode([*modes(0.0)[:1], *light], TARGET).passed


def test_residuals_of_a_posterior_may_be_as_large_as_those_of_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    passes = lambda ratio: judge.residual_size(("force",), np.array([ratio])).passed  # noqa: E731
    Bracket("GAP_OF_NOISE", judge, passes, 1.05, 1.15).test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
