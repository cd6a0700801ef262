"""Every threshold of a fit decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest

from fibrefit.core.declarations import HELD, STICKING, UNLOADING
from fibrefit.fitting import advice as advised
from fibrefit.fitting import checks as judge
from fibrefit.fitting import error_bars, evaluated, gls, misstatements, thresholds, uncertainty
from fibrefit.fitting import residuals as structure
from fibrefit.fitting import values as single
from fibrefit.fitting.misstatements import Alternative
from fibrefit.fitting.search import optimum, rescue
from fibrefit.fitting.search import starts as multistart
from fibrefit.fitting.search.optimum import as_predicted, lets_more_count, reacts_alike, still_gains
from fibrefit.fitting.search.solve import Descent
from fibrefit.fitting.uncertainty import ErrorBars
from fibrefit.fitting.values import Doubtful, weaknesses
from fibrefit.problem.diagnose.motion import Motion, ResidualSet
from fibrefit.problem.diagnose.newton import Gravity, Lag
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Range
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import Z_95
from fibrefit.study.summaries.results import ChannelGap, InputErrorSummary
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in
from tests.fitting.made import structure_checks
from tests.fitting.test_checks import COLUMNS, LAYOUT, RATE, SAMPLES, changed, clean, gap, said, starts
from tests.fitting.test_lone_samples import found_in
from tests.fitting.test_outweighed import said as said_of_weight

__all__ = ["clean"]


def left(share: float) -> Check:
    """The check of a signal of which a share of the variance is left beyond the noise."""
    return judge.check(
        "explained_share", judge.signal_explained({"force": ChannelGap.against_noise(1e-6, 1.0, "N", 1.0 - share)})
    )


def stands_out(size: float) -> bool:
    """Whether a sample of such a size among ones of the noise stands alone."""
    residuals = np.ones((1, 1, 50))
    residuals[0, 0, 20] = size
    return bool(structure.stands_out(residuals, np.ones((1, 1, 50), dtype=bool)).any())


def carried(share: float) -> bool:
    """Whether a sample that carries such a share of what is left is told."""
    residuals = np.ones((1, 1, 2000))
    residuals[0, 0, 1000:] = np.sqrt(1.0 + 0.4 / share * (1.0 - share))
    residuals[0, 0, 500] = np.sqrt(401.0)
    return found_in(np.concatenate([residuals, residuals[:, :, ::-1]], axis=1).repeat(2, axis=0)) is not None


def off_by(factor: float) -> Alternative:
    """A fault in what is stated that makes so much of a value."""
    return Alternative("study.clock", 0.01, "-", "damping", "N s/m", factor, 1.0, factor)


def reaching(share: float) -> Doubtful:
    """A value whose 95 % interval reaches so far round it, of itself."""
    return Doubtful("damping", "N s/m", 10.0, 10.0 * share / Z_95, share)


def ended(agreeing: float, excess: float = 1.0, noise: bool = False, nats: float | None = None) -> bool:
    """Verdict on ten starts of which some ended in the best minimum."""
    basin = [0] * int(agreeing) + [1] * (10 - int(agreeing))
    return judge.check(
        "starts", judge.starts_agree(starts(basin, [1.0 if b == 0 else excess**2 for b in basin]), noise, nats)
    ).passed


def all_known(minima: int) -> bool:
    """Verdict on 32 starts that found so many minima, two of them the best one."""
    basin = [0, 0, *(1 + i % (minima - 1) for i in range(30))]
    return judge.check("starts", judge.starts_agree(starts(basin, [1.0 if b == 0 else 2.0 for b in basin]))).passed


def louder(ratio: float) -> bool:
    """Whether residuals with the structure of noise, of which those of one record are so much larger, may be noise."""
    seen = SimpleNamespace(record_gaps={"a": gap(0.9), "b": gap(0.9 * ratio)})
    of: Any = SimpleNamespace(passed=lambda *of: False, like_noise=True, seen=seen, expected_gap=0.9)
    return bool(evaluated.EvaluatedEstimate.may_be_noise.fget(of))  # type: ignore[attr-defined]


def reached(predicted_reduction: float) -> bool:
    """Whether a mode of which such a reduction is predicted is the estimate."""
    found = SimpleNamespace(log=0.0, spread=np.ones(1), mode=SimpleNamespace(predicted_reduction=predicted_reduction))
    seen: Any = SimpleNamespace(gram=lambda _: None)
    with patch.object(gls, "laplace_evidence", lambda *_: found):
        return gls._laplace_evidence(cast(Any, None), cast(Any, None), seen, None) is not None


def tied(correlation: float, value: float = 4.0) -> list[str]:
    """What is said of two parameters with errors of one that are so correlated."""
    covariance = np.diag([1.0, 1.0, 1e-6])
    covariance[0, 1] = covariance[1, 0] = correlation
    return said(np.linalg.cholesky(np.linalg.inv(covariance)).T, [value, value, 1.0])


def unseen(change: float) -> bool:
    """Whether a parameter without an error is called invisible, whose typical size changes the readings so much."""
    scale = LAYOUT.entries[1][0].range.scale
    covariance, normal = np.diag([1e-6, np.inf, 1e-6]), np.diag([1e6, (change / scale) ** 2, 1e6])
    return any(weak.kind == "invisible" for weak in weaknesses(LAYOUT, np.ones(3), covariance, normal))


def scattered(ratio: float) -> bool:
    """Verdict on six records whose values scatter so many times as much as their errors, in squares."""
    steps = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])[:, None] * np.sqrt(ratio * 5.0 / 6.0)
    slot = SimpleNamespace(name="stiffness", unit="N/m")
    problem: Any = SimpleNamespace(layout=SimpleNamespace(entries=((slot, None),), shared_places=[0]))
    scores: Any = SimpleNamespace(columns=range(6))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(single, "_steps", lambda scores, rate: (steps, np.ones((6, 1))))
        bars = ErrorBars({"spectrum": np.eye(1)}, "spectrum")
        found = single.records_agree(problem, np.zeros(1), scores, bars, 1.0)
    assert found is not None
    return bool(found.passed)


def of_fast(differences: float) -> bool:
    """Whether so many third differences say how large the fast noise is."""
    row = np.random.default_rng(0).standard_normal((1, int(differences) + 3))
    return structure._fast(row, np.ones(row.shape, dtype=bool)) > 0.0


def with_spectrum(samples: float) -> bool:
    """Whether a piece of so many samples has a spectrum."""
    values = np.random.default_rng(0).standard_normal(int(samples))
    return structure._shares([(values, 1e4)], Noise(1e-4, 0.0, 0.0, 1000)).power.size > 0


def one_place(distance: float) -> bool:
    """Whether two starts have come to one place, so far from each other in units of the steps."""
    ended = Descent(np.array([[0.0], [distance]]), np.ones(2), np.ones(2, int), np.ones(2, bool))
    return bool(multistart._leaders(ended, np.ones(1), np.zeros(2, int))[1] == 0)


def small_error(share: float) -> bool:
    """Whether nothing is said of a value of zero whose error is such a share of its typical size."""
    covariance = np.diag([(share * LAYOUT.entries[0][0].range.scale) ** 2, 1e-12, 1e-12])
    return weaknesses(LAYOUT, np.array([0.0, 1.0, 1.0]), covariance, np.linalg.inv(covariance)) == ()


def has_error(part: float) -> bool:
    """Whether a value has an error bar that has such a part in a direction that the data do not see."""
    blind = np.array([part, *[np.sqrt(0.5 * (1.0 - part**2))] * 2])
    # Where each column has the same size, the direction is what was asked for.
    within = np.linalg.qr(np.column_stack([blind, [0.0, 1.0, -1.0], [1.0, 0.0, 0.0]]))[0][:, 1:]
    sizes = np.linalg.lstsq((within**2) ** 1.0, np.ones(3), rcond=None)[0]
    normal = within @ np.diag(sizes) @ within.T
    return bool(np.isfinite(uncertainty.sandwich(normal, normal)[0, 0]))


def worthwhile(ratio: float) -> bool:
    """Whether a further record is advised that leaves such a share of the largest relative error."""
    rig = SimpleNamespace(menu=lambda _: [{"lift": 1.0}], conditions=[SimpleNamespace(name="lift", unit="m")])
    problem = SimpleNamespace(
        model=SimpleNamespace(rig=rig),
        layout=SimpleNamespace(shared_places=[0]),
        observations=SimpleNamespace(experiment=SimpleNamespace(conditions={})),
    )
    with patch.object(advised, "_information", lambda *_: [np.array([[ratio**-2.0 - 1.0]])]):
        found = advised._further_record(cast(Any, problem), np.ones(1), np.ones((1, 1)))
    assert found is not None
    return found.identifier == "further_record"


def linearisation(share: float, left: float) -> gls._Linearisation:
    """One in which such a share of the samples counts, and so much is left of all."""
    return gls._Linearisation(cast("Any", None), False, share, left)


def more_counts(number: int) -> bool:
    """Whether one look more is made where in each of so many more samples count."""
    return gls._tells_more([linearisation(0.1 + 0.05 * i, 4.0) for i in range(number)], True)


@dataclasses.dataclass(frozen=True)
class RowBracket(Bracket):
    """A threshold that the table of checks holds.

    Parameters
    ----------
    row : str
        Identifier of the check.
    """

    row: str = ""

    def test(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Assert that the verdict turns there, and no longer with twice or half the threshold in the table."""
        assert self.holds(), self.name
        for factor in (2.0, 0.5):
            changed = tuple(
                row._replace(threshold=factor * (row.threshold or 0.0)) if row.identifier == self.row else row
                for row in judge.CHECKS
            )
            with monkeypatch.context() as patched:
                patched.setattr(judge, "CHECKS", changed)
                assert not self.holds(), f"{factor:g} times {self.name} would go unnoticed"


CASES = (
    Bracket(
        "GAP_OF_NOISE", judge, lambda x: judge.check("residual_size", judge.gap_is_noise(gap(x))).passed, 1.05, 1.15
    ),
    Bracket("ALIKE_EVIDENCE", misstatements, lambda x: misstatements.explains_alike(100.0 + x, 100.0), 5.0, 8.0),
    Bracket("ZERO_SHARE", misstatements, lambda x: x <= misstatements.zero_allowed(0.01, 100.0), 0.2, 0.4),
    Bracket("STANDS_OUT", structure, lambda x: not stands_out(x), 6.0, 10.0),
    Bracket(
        "FIT_TOLERANCE", judge, lambda x: judge.check("convergence", judge.converged(x, True)).passed, 0.007, 0.014
    ),
    Bracket(
        "ROUGHLY", judge, lambda x: judge.check("convergence", judge.converged(x, True, rough=True)).passed, 0.03, 0.07
    ),
    Bracket("MISSED_LINEARISED", optimum, lambda x: as_predicted(np.sqrt(x) + np.ones(5), np.ones(5)), 0.02, 0.04),
    Bracket(
        "REACTS_ALIKE",
        optimum,
        lambda x: bool(reacts_alike(np.sqrt(x) + np.ones((1, 5)), np.ones((1, 5))).all()),
        0.004,
        0.006,
    ),
    Bracket("MORE_COUNT", optimum, lambda x: lets_more_count(0.5 + x, 0.5), 0.013, 0.007),
    Bracket("MOST_LINEARISATIONS", gls, lambda x: more_counts(int(x)), 7, 9),
    Bracket("FALLS", optimum, lambda x: still_gains([0.5, 0.5], [4.0, 4.0 * x], False), 0.85, 0.95),
    Bracket("LOUDER_THAN_AT_REST", evaluated, louder, 1.2, 1.3),
    Bracket("LOSES", rescue, lambda x: rescue.loses(x, 1.0), 2.2, 1.8),
    Bracket("MODE_REACHED", gls, reached, 0.4, 0.7),
    Bracket("DIVERGED", judge, lambda x: not judge.check("convergence", judge.converged(x, True)).fatal, 20.0, 30.0),
    Bracket(
        "GAP_OF_PART",
        judge,
        lambda x: bool(judge.inputs_within_noise({"drive": InputErrorSummary(rms=x, noise=1.0, unit="m")})[0].passed),
        1.1,
        1.2,
    ),
    Bracket("SAME_BASIN", multistart, lambda x: multistart.basins_of(np.array([1.0, 1.0 + x]))[1] == 0, 7e-4, 1.3e-3),
    Bracket("SMALL_ERROR", single, small_error, 0.007, 0.013),
    Bracket("BLIND_PART", uncertainty, has_error, 0.7e-3, 1.3e-3),
    Bracket("WORTHWHILE", advised, worthwhile, 0.7, 0.9),
    Bracket("UNNOTICED", judge, lambda x: judge.check("second_solver", judge.second_solver(x, 0.0)).passed, 0.08, 0.12),
    RowBracket("UNEXPLAINED", judge, lambda x: left(x).passed, 0.004, 0.006, row="explained_share"),
    Bracket("USELESS", judge, lambda x: not left(x).fatal, 0.04, 0.06),
    RowBracket(
        "GRAVITY_OFF",
        judge,
        lambda x: judge.check("free_flight", judge.beyond_chance(Gravity(-x, 1e-5))).passed,
        0.004,
        0.006,
        row="free_flight",
    ),
    Bracket(
        "FACTOR",
        judge,
        lambda x: judge.check("doubtful_value", judge.known_to_a_factor(reaching(1.0 - 1.0 / x))).passed,
        1.4,
        1.6,
    ),
    Bracket(
        "FACTOR", judge, lambda x: not judge.check("otherwise", judge.explained_otherwise(off_by(x))).fatal, 1.4, 1.6
    ),
    Bracket(
        "REMAINING",
        misstatements,
        lambda x: misstatements.is_noise(math.sqrt(1.0 + 50.0 * x), math.sqrt(51.0)),
        0.017,
        0.0235,
    ),
    RowBracket(
        "LATE_FORCE",
        judge,
        lambda x: judge.check("lag", judge.beyond_chance(Lag(-x, 1e-6))).passed,
        2.5e-4,
        3.5e-4,
        row="lag",
    ),
    Bracket("STARTS_AGREED", judge, lambda x: ended(10.0 - x), 2.0, 3.0),
    Bracket("MINIMA_KNOWN", judge, lambda x: all_known(int(x)), 4.0, 8.0),
    Bracket("FEW_STARTS", judge, lambda x: ended(3.0 - x, 1.5, noise=True), 1.0, 2.0),
    Bracket("WORSE", judge, lambda x: ended(3.0, 2.1 - x, noise=True), 1.0, 1.08),
    Bracket("LESS_PROBABLE", judge, lambda x: ended(3.0, 1.01, noise=True, nats=30.0 - x), 12.0, 22.0),
    Bracket(
        "UNNOTICED", error_bars, lambda x: not error_bars.at_bound(1.0 / x, 1.0, Range(0.0, 100.0, 10.0)), 8.0, 13.0
    ),
    Bracket("VAGUE", single, lambda x: said(COLUMNS, [1.0, 0.01 / x, 1.0]) == [], 0.4, 0.6),
    Bracket("TIED", single, lambda x: tied(x) == [], 0.99, 0.9975),
    Bracket("SEEN", single, lambda x: unseen(x), 0.008, 0.012),
    Bracket("STATE_CELLS", structure, lambda x: structure._steps(np.arange(x)).size > 0, 24.0, 20.0),
    Bracket("ORDINATES", structure, of_fast, 9.0, 7.0),
    Bracket("SLOWEST_OCTAVE", structure, lambda x: structure._edges(8000.0).min() <= x, 1.0, 0.5),
    Bracket("LOOSE", single, lambda x: tied(0.999, 1.0 / x) == [], 0.08, 0.12),
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
    return structure_checks(dataclasses.replace(clean, residuals=residuals))[1].passed


def alone(clean: ResidualSet, number: float, size: float) -> bool:
    """Verdict on phases of which one lasts so many samples, each so large; the others hold next to nothing."""
    phase, residuals = np.full_like(clean.motion.phase, HELD), np.full_like(clean.residuals, 1e-3)
    phase[0, 100 : 100 + int(number)] = STICKING
    residuals[0, 0, 100 : 100 + int(number)] = size
    motion = dataclasses.replace(clean.motion, phase=phase)
    return structure_checks(dataclasses.replace(clean, residuals=residuals, motion=motion))[1].passed


def louder_octave(ratio: float) -> bool:
    """Verdict on 48 samples, whose only octave of more than a few ordinates is so much louder than at rest."""
    noise, count = Noise(1e-3, 0.0, 0.0, 48), 48
    rest = noise.draw(count, RATE, np.random.default_rng(0))
    row = np.zeros((1, count))
    data: Any = SimpleNamespace(
        weight={"force": row + 1.0},
        experiment=SimpleNamespace(times=np.arange(count)[None] / RATE, count=np.array([count])),
    )
    problem: Any = SimpleNamespace(observations=data, model=SimpleNamespace(rig=SimpleNamespace(channels=("force",))))
    motion = Motion(np.full((1, count), HELD), {"position": row, "speed": row}, np.zeros(1, dtype=bool), {})
    named = {"force": noise}
    left = ResidualSet(problem, np.sqrt(ratio) * rest[None, None], motion, named, named, {"force": [(rest, RATE)]})
    return structure_checks(left)[0].passed


OF_WEIGHT = {
    "NO_FACTOR": (lambda inverse: said_of_weight(1.5, limits=Range(0.0, np.inf, 1.0 / inverse)) is None, 0.025, 0.045),
}


@pytest.mark.parametrize("name", sorted(OF_WEIGHT))
def test_a_verdict_on_weight_turns_at_the_threshold(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Bracket(name, single, *OF_WEIGHT[name]).test(monkeypatch)


OF_STRUCTURE = {
    "FEWEST_SAMPLES": (lambda clean, number: alone(clean, number, 50.0), 190.0, 210.0),
    # A residual that does not change is as rare as its phase is long: 2.2 times the noise's power passes, just.
    "CHANCE": (lambda clean, size: alone(clean, 240.0, size), 1.6, 1.8),
    "RARE_POWER": (lambda clean, ratio: louder_octave(ratio), 11.0, 12.0),
    "SPECTRUM_RATIO": (tone, 0.0, 0.4),
    "GAP_OF_PART": (in_a_phase, 0.0, 1.5),
    "STATE_SHARE": (with_speed, 1.2, 1.8),
    "LOUDEST": (louder, 1.4, 2.2),
}


@pytest.mark.parametrize("name", sorted(OF_STRUCTURE))
def test_a_verdict_on_structure_turns_at_the_threshold(
    name: str, clean: ResidualSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    passes, inside, outside = OF_STRUCTURE[name]
    row = {"SPECTRUM_RATIO": "residual_spectrum", "GAP_OF_PART": "residual_phase"}.get(name)
    if row is None:
        Bracket(name, structure, lambda size: passes(clean, size), inside, outside).test(monkeypatch)
    else:
        RowBracket(name, judge, lambda size: passes(clean, size), inside, outside, row).test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    known = {case.name for case in CASES} - {"GAP_OF_NOISE"}
    assert names_in(thresholds) == known | set(OF_STRUCTURE) | set(OF_WEIGHT)
