"""Every threshold of a fit decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fibrefit.core.check import Check
from fibrefit.core.roles import UNLOADING
from fibrefit.fitting import checks as judge
from fibrefit.fitting import identifiability, thresholds
from fibrefit.fitting.misfit import structure
from fibrefit.fitting.result import ChannelGap, InputError
from fibrefit.problem.diagnose.residuals import ResidualSet
from fibrefit.problem.statement.transform import Range
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in
from tests.fitting.test_checks import COLUMNS, RATE, SAMPLES, changed, clean, gap, said, starts

__all__ = ["clean"]


def left(share: float) -> Check:
    """The check of a signal of which a share of the variance is left beyond the noise."""
    return judge.signal_explained({"force": ChannelGap(1.0, 1e-6, "N", 1.0 - share)})


def ended(agreeing: float, excess: float = 1.0, noise: bool = False) -> bool:
    """Verdict on ten starts of which some ended in the best minimum."""
    basin = [0] * int(agreeing) + [1] * (10 - int(agreeing))
    return judge.starts_agree(starts(basin, [1.0 if b == 0 else excess**2 for b in basin]), noise).passed


def tied(correlation: float, value: float = 4.0) -> list[str]:
    """What is said of two parameters with errors of one that are so correlated."""
    covariance = np.diag([1.0, 1.0, 1e-6])
    covariance[0, 1] = covariance[1, 0] = correlation
    return said(np.linalg.cholesky(np.linalg.inv(covariance)).T, [value, value, 1.0])


CASES = (
    Bracket("GAP", judge, lambda x: judge.gap_is_noise(gap(x)).passed, 1.05, 1.15),
    Bracket("SETTLED", judge, lambda x: judge.converged(x, True).passed, 0.007, 0.014),
    Bracket("ASTRAY", judge, lambda x: not judge.converged(x, True).fatal, 20.0, 30.0),
    Bracket(
        "INPUT_ERROR",
        judge,
        lambda x: judge.inputs_within_noise({"drive": InputError(x, 1.0, "m")})[0].passed,
        1.1,
        1.2,
    ),
    Bracket("AGREEMENT", judge, lambda x: judge.second_solver(x, 0.0).passed, 0.08, 0.12),
    Bracket("UNEXPLAINED", judge, lambda x: left(x).passed, 0.004, 0.006),
    Bracket("USELESS", judge, lambda x: not left(x).fatal, 0.04, 0.06),
    Bracket("STARTS", judge, lambda x: ended(10.0 - x), 2.0, 3.0),
    Bracket("FEW_STARTS", judge, lambda x: ended(3.0 - x, 1.5, noise=True), 1.0, 2.0),
    Bracket("WORSE", judge, lambda x: ended(3.0, 2.1 - x, noise=True), 1.0, 1.08),
    Bracket("AT_BOUND", judge, lambda x: not judge.at_bound(1.0 / x, 1.0, Range(0.0, 100.0, 10.0)), 8.0, 13.0),
    Bracket("VAGUE", identifiability, lambda x: said(COLUMNS, [1.0, 0.01 / x, 1.0]) == [], 0.4, 0.6),
    Bracket("TIED", identifiability, lambda x: tied(x) == [], 0.99, 0.9975),
    Bracket("LOOSE", identifiability, lambda x: tied(0.999, 1.0 / x) == [], 0.08, 0.12),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def tone(clean: ResidualSet, size: float) -> bool:
    wave = size * np.sin(2.0 * np.pi * 130.0 * np.arange(SAMPLES) / RATE)
    return changed(clean, 1, wave)[0].passed


def in_a_phase(clean: ResidualSet, size: float) -> bool:
    slow = size * np.sin(2.0 * np.pi * 20.0 * np.arange(SAMPLES) / RATE)
    return changed(clean, 0, np.where(clean.motion.phase == UNLOADING, slow, 0.0))[1].passed


def with_speed(clean: ResidualSet, size: float) -> bool:
    return changed(clean, 0, size * clean.motion.states["speed"])[2].passed


def louder(clean: ResidualSet, factor: float) -> bool:
    residuals = clean.residuals.copy()
    residuals[:, 0] *= np.where(clean.motion.phase == UNLOADING, factor, 1.0)
    return structure.structure_checks(dataclasses.replace(clean, residuals=residuals))[1].passed


OF_STRUCTURE = {
    "SPECTRUM_RATIO": (tone, 0.0, 0.4),
    "PHASE_RATIO": (in_a_phase, 0.0, 1.5),
    "STATE_SHARE": (with_speed, 1.2, 1.8),
    "LOUDEST": (louder, 1.4, 2.2),
}


@pytest.mark.parametrize("name", sorted(OF_STRUCTURE))
def test_a_verdict_on_structure_turns_at_the_threshold(
    name: str, clean: ResidualSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    passes, inside, outside = OF_STRUCTURE[name]
    Bracket(name, structure, lambda size: passes(clean, size), inside, outside).test(monkeypatch)


#: Probabilities and numbers of samples: twice or half of them moves a limit by a few percent of itself.
OF_CHANCE = {"CHANCE", "RARE_POWER", "RARE_SCATTER", "FEWEST", "SEEN"}


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == ({case.name for case in CASES} - {"GAP"}) | set(OF_STRUCTURE) | OF_CHANCE
