"""Every check a fit is put to: once where it passes, once where it does not, and what it says then."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.core.declarations import HELD, LOADING, REST, SLACK, UNLOADING
from fibrefit.fitting import checks as judge
from fibrefit.fitting.advice import advice
from fibrefit.fitting.error_bars import at_bound
from fibrefit.fitting.residuals import spectrum
from fibrefit.fitting.result import Advice, Found, Identification, Starts
from fibrefit.fitting.uncertainty import sandwich
from fibrefit.fitting.values import AtBound, Weakness, beyond_bounds, weaknesses
from fibrefit.problem.diagnose.motion import Motion, ResidualSet
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.problem.statement.observations import Observations
from fibrefit.report.sentences.fit import advice_sentence, fit_sentence, weakness_sentence
from fibrefit.simulation.model import Experiment
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import ChannelGap, InputErrorSummary
from tests.fitting.made import structure_checks

RATE, RECORDS, SAMPLES = 2000.0, 5, 3000
CHANNELS = ("force", "position")


def starts(basin: list[int], cost: list[float]) -> Starts:
    n = len(basin)
    return Starts(("k",), *(np.zeros((n, 1)),) * 3, np.array(cost), np.zeros(n, dtype=int), np.array(basin))


def gap(ratio: float) -> dict[str, ChannelGap]:
    return {"force": ChannelGap.against_noise(1.0, ratio, "N"), "position": ChannelGap.against_noise(1.0, ratio, "m")}


def known(samples: int) -> dict[str, Noise]:
    return {"force": Noise(1.0, 0.0, 0.0, samples)}


FINITE, NAN = np.zeros(3), np.array([0.0, np.nan])
QUIET, CHATTER = np.array([False, False]), np.array([False, True])
FAR = AtBound("damping", "N s/m", 20.0, 19.0, False, 9.0)
TIED = (Weakness(("a", "b"), "tied", correlation=0.999, slope=2.0),)

PAIRS: list[tuple[str, str, Found, Found, str]] = [
    (
        "arrived",
        "convergence",
        judge.converged(0.0001, True),
        judge.converged(0.5, True),
        "The cost would fall by 0.5 in another step; at most 0.01",
    ),
    (
        "arrived by its own word",
        "convergence",
        judge.converged(0.0001, True),
        judge.converged(0.0001, False),
        "The solver ended at a kink",
    ),
    (
        "finite",
        "simulation",
        judge.finite(FINITE, QUIET, ("a", "b")),
        judge.finite(NAN, QUIET, ("a", "b")),
        "is not finite",
    ),
    (
        "no chatter",
        "simulation",
        judge.finite(FINITE, QUIET, ("a", "b")),
        judge.finite(FINITE, CHATTER, ("a.csv", "b.csv")),
        "for b.csv switches faster than can be followed",
    ),
    (
        "second place",
        "second_solver",
        judge.second_solver(0.01, 0.0),
        judge.second_solver(3.0, -0.2),
        "ends 3 standard errors away",
    ),
    (
        "second cost",
        "second_solver",
        judge.second_solver(0.01, 0.0),
        judge.second_solver(0.01, 4.0),
        "with a cost 4 lower",
    ),
    (
        "the best minimum was found",
        "starts",
        judge.starts_agree(starts([0, 0, 0, 0, 1], [1.0] * 4 + [9.0])),
        judge.starts_agree(starts([0, 1, 1, -1], [1.0, 9.0, 9.0, np.inf])),
        "1 of 4 starts ended in the best minimum. 2 ended in others, the nearest with residuals 3 times as large",
    ),
    (
        "few starts find what leaves only noise",
        "starts",
        judge.starts_agree(starts([0, 0, 1, 1], [1.0, 1.0, 9.0, 9.0]), noise=True),
        judge.starts_agree(starts([0, 0, 1, 1], [1.0, 1.0, 1.02, 9.0]), noise=True),
        "2 of 4 starts ended in the best minimum. 2 ended in others, the nearest with residuals 1.01 times as large",
    ),
    (
        "few minima in many starts",
        "starts",
        judge.starts_agree(starts([0] * 4 + [1] * 12, [1.0] * 4 + [9.0] * 12)),
        judge.starts_agree(starts([0] * 4 + list(range(1, 13)), [1.0] * 4 + [9.0] * 12)),
        "a further start would find another minimum with a probability of 76 %. A better one may have been missed",
    ),
    (
        "a minimum met once",
        "starts",
        judge.starts_agree(starts([0] * 2 + [1] * 14, [1.0] * 2 + [9.0] * 14)),
        judge.starts_agree(starts([0] + [1] * 15, [1.0] + [9.0] * 15)),
        "1 of 16 starts ended in the best minimum.",
    ),
    (
        "one start is luck",
        "starts",
        judge.starts_agree(starts([0, 0, 1, 1], [1.0, 1.0, 9.0, 9.0]), noise=True),
        judge.starts_agree(starts([0, 1, 1, 1], [1.0, 9.0, 9.0, 9.0]), noise=True),
        "1 of 4 starts ended in the best minimum.",
    ),
    (
        "one start alone",
        "starts",
        judge.starts_agree(starts([0, 0], [1.0, 1.0])),
        judge.starts_agree(starts([0], [1.0])),
        "One start agrees with itself: whether there is a better minimum is not known without more.",
    ),
    (
        "one start where a search ended",
        "starts",
        judge.starts_agree(dataclasses.replace(starts([0], [1.0]), followed=True)),
        judge.starts_agree(starts([0, -1], [1.0, np.inf])),
        "1 of 2 starts ended in the best minimum. 1 led nowhere and was given up. One start agrees with itself",
    ),
    (
        "starts led elsewhere",
        "starts",
        judge.starts_agree(starts([0, 1, 2, 3], [1.0, 1.01, 1.02, 1.03]), noise=True, nats=11.0),
        judge.starts_agree(starts([0, 1, 2, 3], [1.0, 1.01, 1.02, 1.03]), noise=True, nats=9.0),
        "the next of these minima is 9 nats less probable; at least 10 less are expected",
    ),
    (
        "starts that were not followed",
        "starts",
        judge.starts_agree(starts([0, 0, 1, 1], [1.0, 1.0, 9.0, 9.0]), noise=True),
        judge.starts_agree(starts([0, 0, 1, 1], [1.0, 1.0, 9.0, 9.0]), noise=True, nats=-3.0),
        "the next of these minima is 3 nats more probable",
    ),
    (
        "second led elsewhere",
        "second_solver",
        judge.second_solver_by_likelihood(3.0, 11.0),
        judge.second_solver_by_likelihood(3.0, 9.0),
        "the likelihood leads 3 standard errors away, to what is 9 nats less probable",
    ),
    (
        "second led nowhere",
        "second_solver",
        judge.second_solver_by_likelihood(0.4, 1.0),
        judge.second_solver_by_likelihood(np.inf, 0.0),
        "the likelihood leads nowhere",
    ),
    (
        "second led to better",
        "second_solver",
        judge.second_solver_by_likelihood(0.4, -2.0),
        judge.second_solver_by_likelihood(3.0, -2.0),
        "the likelihood leads 3 standard errors away, to what is 2 nats more probable",
    ),
    ("inside bounds", "bounds", beyond_bounds(()), beyond_bounds((FAR,)), "damping stopped at the bound"),
    (
        "determined",
        "identifiability",
        judge.none_of(weak=()),
        judge.none_of(weak=TIED),
        "Only a combination of a and b",
    ),
    (
        "gap",
        "residual_size",
        judge.gap_is_noise(gap(1.05)),
        judge.gap_is_noise(gap(2.0)),
        "RMS is 2 times the noise; at most 1.1 is expected. The model lacks",
    ),
    (
        "gap with noisy inputs",
        "residual_size",
        judge.gap_is_noise(gap(1.3), expected=1.3),
        judge.gap_is_noise(gap(1.5), expected=1.3),
        "The model lacks something",
    ),
    (
        "noise seen",
        "noise_level",
        judge.noise_seen(known(500), ()),
        judge.noise_seen(known(0), ()),
        "hold no rest: noise of force",
    ),
    (
        "noise stated",
        "noise_level",
        judge.noise_seen(known(0), ("force",)),
        judge.noise_seen(known(0), ()),
        "State it under [noise]",
    ),
]


@pytest.mark.parametrize(
    ("identifier", "passes", "fails", "says"), [row[1:] for row in PAIRS], ids=[row[0] for row in PAIRS]
)
def test_each_check_passes_and_fails(identifier: str, passes: Found, fails: Found, says: str) -> None:
    good, bad = judge.check(identifier, passes), judge.check(identifier, fails)
    assert good.passed
    assert not bad.passed
    assert says in fit_sentence(bad)
    assert fit_sentence(good) != fit_sentence(bad)
    for check in (good, bad):
        assert fit_sentence(check).endswith(".")


def test_only_what_makes_a_result_useless_is_fatal() -> None:
    assert judge.check("convergence", judge.converged(50.0, True)).fatal
    assert not judge.check("convergence", judge.converged(1.0, True)).fatal
    assert judge.check("simulation", judge.finite(NAN, QUIET, ("a", "b"))).fatal
    assert not judge.check("residual_size", judge.gap_is_noise(gap(50.0))).fatal


@pytest.mark.parametrize(
    ("value", "error", "stopped"), [(0.001, 1.0, True), (0.3, 1.0, False), (99.99, 1.0, True), (0.0, np.inf, True)]
)
def test_an_estimate_is_at_a_bound_within_a_tenth_of_its_error(value: float, error: float, stopped: bool) -> None:
    assert at_bound(value, error, Range(0.0, 100.0, 10.0)) is stopped


@pytest.fixture(scope="module")
def clean() -> ResidualSet:
    """Residuals of a perfect model: noise and nothing else, over motions that have every phase."""
    random = np.random.default_rng(12)
    noise = Noise(0.75 / 1000.0, 0.25 / np.log(1000.0 * SAMPLES / RATE), 0.0, 4000)
    residuals = np.stack([[noise.draw(SAMPLES, RATE, random) for _ in range(2)] for _ in range(RECORDS)])
    phase = np.full((RECORDS, SAMPLES), REST)
    phase[:, :400] = HELD
    for begin, which in zip(range(400, 1600, 100), (SLACK, LOADING, UNLOADING) * 4, strict=True):
        phase[:, begin : begin + 100] = which
    t = np.arange(SAMPLES) / RATE
    states = {
        "position": np.tile(np.exp(-2.0 * t) * np.cos(30.0 * t), (RECORDS, 1)),
        "speed": np.tile(np.exp(-2.0 * t) * np.sin(30.0 * t), (RECORDS, 1)),
    }
    motion = Motion(phase, states, np.zeros(RECORDS, dtype=bool), {})
    data = Observations(
        Experiment(np.tile(t, (RECORDS, 1)), np.full(RECORDS, SAMPLES), {}, {}),  # type: ignore[arg-type]
        {channel: np.zeros((RECORDS, SAMPLES)) for channel in CHANNELS},  # type: ignore[misc]
        {channel: np.ones((RECORDS, SAMPLES)) for channel in CHANNELS},  # type: ignore[misc]
    )
    problem: Any = SimpleNamespace(observations=data, model=SimpleNamespace(rig=SimpleNamespace(channels=CHANNELS)))
    each = dict.fromkeys(CHANNELS, noise)
    return ResidualSet(problem, residuals, motion, each, each)


def changed(clean: ResidualSet, channel: int, by: np.ndarray) -> list[Check]:
    residuals = clean.residuals.copy()
    residuals[:, channel] += by
    return list(structure_checks(dataclasses.replace(clean, residuals=residuals)))


def test_noise_alone_passes_all_checks_of_structure(clean: ResidualSet) -> None:
    assert [check.passed for check in structure_checks(clean)] == [True] * 3


def test_a_tone_is_seen_in_the_spectrum(clean: ResidualSet) -> None:
    tone = 0.5 * np.sin(2.0 * np.pi * 130.0 * np.arange(SAMPLES) / RATE)
    octaves, _, states = changed(clean, 1, tone)
    assert not octaves.passed
    assert "position between 125 and 250 Hz" in fit_sentence(octaves)
    assert states.passed


@pytest.mark.parametrize(("tone", "passed"), [(0.0, True), (0.6, False)])
def test_half_of_the_samples_tell_as_much_of_the_spectrum(clean: ResidualSet, tone: float, passed: bool) -> None:
    """Masked samples are zero: they take power from noise and tone alike, and are no excuse."""
    random, noise = np.random.default_rng(8), Noise(1.0 / (0.5 * RATE), 0.0, 0.0, 4000)
    seen = random.random(clean.residuals.shape) < 0.5
    wave = tone * np.sin(2.0 * np.pi * 130.0 * np.arange(SAMPLES) / RATE)
    data = clean.problem.observations
    weight = {channel: 1.0 * seen[:, c] for c, channel in enumerate(CHANNELS)}
    problem: Any = SimpleNamespace(observations=data._replace(weight=weight), model=clean.problem.model)
    residuals = seen * (random.standard_normal(seen.shape) + wave)
    each = dict.fromkeys(CHANNELS, noise)
    found = spectrum(ResidualSet(problem, residuals, clean.motion, each, each))
    assert judge.check("residual_spectrum", found).passed is passed


def test_a_phase_that_is_explained_badly_is_named(clean: ResidualSet) -> None:
    slow = 1.5 * np.sin(2.0 * np.pi * 20.0 * np.arange(SAMPLES) / RATE)
    _, phases, _ = changed(clean, 0, np.where(clean.motion.phase == UNLOADING, slow, 0.0))
    assert not phases.passed
    assert "force while taut, unloading" in fit_sentence(phases)


def test_noise_that_is_louder_in_a_phase_is_noise(clean: ResidualSet) -> None:
    """The other one: what is louder at all frequencies alike is no lack of the model."""
    residuals = clean.residuals.copy()
    residuals[:, 0] *= np.where(clean.motion.phase == UNLOADING, 1.4, 1.0)
    _, phases, _ = structure_checks(dataclasses.replace(clean, residuals=residuals))
    assert phases.passed


def test_slow_noise_that_rests_show_passes_and_that_they_do_not_fails(clean: ResidualSet) -> None:
    random = np.random.default_rng(3)
    slow = Noise(0.5 / 1000.0, 0.0, 0.0, 4000, ((8.0, 0.5),))
    residuals = np.stack([[slow.draw(SAMPLES, RATE, random) for _ in range(2)] for _ in range(RECORDS)])
    rests = [(slow.draw(1000, RATE, random), RATE) for _ in range(2 * RECORDS)]
    quiet = [(Noise(0.5 / 1000.0, 0.0, 0.0, 4000).draw(1000, RATE, random), RATE) for _ in range(2 * RECORDS)]
    known = dict.fromkeys(clean.channels, slow)
    held = {"residuals": residuals, "noise": known, "fitted": known}
    same = dataclasses.replace(clean, rests=dict.fromkeys(clean.channels, rests), **held)
    other = dataclasses.replace(clean, rests=dict.fromkeys(clean.channels, quiet), **held)
    assert structure_checks(same)[0].passed
    assert not structure_checks(other)[0].passed


def test_a_force_that_depends_on_speed_is_named(clean: ResidualSet) -> None:
    _, _, states = changed(clean, 0, 2.0 * clean.motion.states["speed"])
    assert not states.passed
    assert "force residual depends on the speed" in fit_sentence(states)


@pytest.mark.parametrize("order", [1, -1])
def test_each_record_is_judged_at_its_own_rate(clean: ResidualSet, order: int) -> None:
    """White noise of one density, logged at 1 and 4 kHz: which record comes first makes no difference."""
    rates, random = np.array([1000.0, 4000.0])[::order], np.random.default_rng(4)
    counts = (rates * SAMPLES / rates.max()).astype(int)
    noise, data = Noise(1e-3, 0.0, 0.0, 4000), clean.problem.observations
    times = np.arange(SAMPLES) / rates[:, None]
    residuals = np.zeros((2, len(CHANNELS), SAMPLES))
    weight = np.zeros((2, SAMPLES))
    for r, (rate, count) in enumerate(zip(rates, counts, strict=True)):
        sigma = np.sqrt(0.5 * noise.white * rate)
        weight[r, :count] = 1.0 / sigma
        for channel in range(len(CHANNELS)):
            residuals[r, channel, :count] = noise.draw(count, rate, random) / sigma
    there = data._replace(
        experiment=data.experiment._replace(times=times, count=counts), weight=dict.fromkeys(CHANNELS, weight)
    )
    problem: Any = SimpleNamespace(observations=there, model=clean.problem.model)
    each = dict.fromkeys(CHANNELS, noise)
    check = judge.check("residual_spectrum", spectrum(ResidualSet(problem, residuals, clean.motion, each, each)))
    assert check.passed
    assert check.statistic is not None
    assert check.statistic < 1.2


@pytest.mark.parametrize(("rms", "passed"), [(0.8, True), (1.1, True), (1.3, False)])
def test_an_input_may_be_wrong_by_its_noise_and_no_more(rms: float, passed: bool) -> None:
    (found,) = judge.inputs_within_noise({"drive": InputErrorSummary(rms=rms * 1e-5, noise=1e-5, unit="m")})
    check = judge.check("{}_error", found)
    assert check.passed is passed
    assert (
        passed
        or "the error of the drive would have to be 1.3 times its noise at the frequencies at which it is looked for; "
        "at most 1.15"
        in fit_sentence(check).lower()
    )


def test_noise_of_an_input_where_no_error_is_looked_for_is_no_excuse() -> None:
    """White noise of 10 um at 5 kHz has 2 um up to 100 Hz: an error of 5 um there is what the model lacks."""
    error = InputErrorSummary(rms=5e-6, noise=1e-5, unit="m", looked_for=2e-6)
    check = judge.check("{}_error", judge.inputs_within_noise({"drive": error})[0])
    assert (check.passed, check.statistic) == (False, pytest.approx(2.5))


def test_an_input_whose_error_was_given_up_is_said_to_be() -> None:
    (found,) = judge.inputs_within_noise({"drive": InputErrorSummary(rms=0.0, noise=1e-5, unit="m")})
    check = judge.check("{}_error", found)
    assert not check.passed
    assert (
        fit_sentence(check)
        == "The drive was taken as it was measured: the model lacks more than an error of it could explain."
    )


NAMES = ("a", "b", "c")
LAYOUT = Layout(tuple(Slot(name, "-", Range(0.0, np.inf, 1.0)) for name in NAMES), ("r.csv",))
EITHER = Layout(tuple(Slot(name, "-", Range(-np.inf, np.inf, 1.0)) for name in NAMES), ("r.csv",))
"""The same of either sign, as a zero is."""


def said(jacobian: np.ndarray, values: list[float], layout: Layout = LAYOUT) -> list[str]:
    normal = jacobian.T @ jacobian
    return [weakness_sentence(weak) for weak in weaknesses(layout, np.array(values), sandwich(normal, normal), normal)]


COLUMNS = np.linalg.qr(np.random.default_rng(0).normal(size=(60, 3)))[0] * 100.0


def test_well_seen_parameters_have_no_weakness() -> None:
    assert said(COLUMNS, [1.0, 1.0, 1.0]) == []


def test_a_parameter_that_does_nothing_is_not_visible() -> None:
    blind = COLUMNS * [1.0, 0.0, 1.0]
    assert said(blind, [1.0] * 3) == ["b is not visible in these records: any value fits equally well."]


def test_parameters_that_do_the_same_are_only_known_together() -> None:
    twins = np.column_stack([COLUMNS[:, 0], COLUMNS[:, 1], 3.0 * COLUMNS[:, 0]])
    assert said(twins, [1.0] * 3) == [
        "Only a combination of a and c is determined: they move the readings in the same way."
    ]


def test_parameters_that_do_nearly_the_same_are_tied_and_the_exchange_is_told() -> None:
    near = np.column_stack([COLUMNS[:, 0], COLUMNS[:, 1], -2.0 * COLUMNS[:, 0] + 0.01 * COLUMNS[:, 2]])
    (tied,) = said(near, [1.0] * 3)[-1:]
    assert tied.startswith("Only a combination of a and c is determined (correlation 1.000)")
    assert "each unit of a can be traded for 0.5 of c" in tied


def test_values_known_to_a_few_percent_are_determined_however_tied() -> None:
    near = 1e6 * np.column_stack([COLUMNS[:, 0], COLUMNS[:, 1], -2.0 * COLUMNS[:, 0] + 0.01 * COLUMNS[:, 2]])
    assert said(near, [1.0] * 3) == []


def test_a_vague_value_is_said_to_be_so() -> None:
    assert said(COLUMNS, [1.0, 0.015, 1.0]) == ["b is hardly visible: its error is 67 % of its value."]


def test_values_that_each_record_has_for_itself_are_judged_too() -> None:
    """The second record does not see its damping; what nobody asks for, such as a zero, is passed over."""
    slots = [Slot(name, "-", Range(0.0, np.inf, 1.0), shared=name == "stiffness") for name in ("stiffness", "damping")]
    slots.append(Slot("zero", "-", Range(-np.inf, np.inf, 1.0), shared=False))
    layout = Layout(tuple(slots), ("may/a.csv", "may/b.csv"))
    normal = np.diag([1e4, 1e4, 0.0, 0.0, 1e4])  # stiffness, damping and zero of a, damping and zero of b
    assert [f"{slot.name} {record}" for slot, record in layout.entries][2:4] == ["zero 0", "damping 1"]
    weak = weaknesses(layout, np.ones(5), sandwich(normal, normal), normal, {"zero"})
    assert weak == (Weakness(("damping[may/b.csv]",), "invisible"),)
    assert weakness_sentence(weak[0]).startswith('damping of "b" is not visible in these records')
    # Of one record two values are tied, and of one with what all share; not those of different records.
    tied = np.diag([1e4] * 5)
    tied[0, 1] = tied[1, 0] = -1e4 * (1.0 - 1e-6)
    covariance = np.linalg.inv(tied)
    covariance[1, 3] = covariance[3, 1] = np.sqrt(covariance[1, 1] * covariance[3, 3])
    (pair,) = [one for one in weaknesses(layout, np.ones(5), covariance, tied, {"zero"}) if one.kind == "tied"]
    assert pair.names == ("stiffness", "damping[may/a.csv]")


def test_a_value_of_either_sign_may_be_near_nil_and_well_known() -> None:
    assert said(COLUMNS, [1.0, 0.015, 1.0], EITHER) == []
    hardly = said(COLUMNS / 70.0, [1.0, 0.015, 10.0], EITHER)
    assert [text.split()[0] for text in hardly] == ["a", "b"]


def test_advice_follows_from_what_failed(found: Identification) -> None:
    problem, values = found.problem, found.values
    normal = np.linalg.inv(found.covariance)

    def ask(weak: tuple[Weakness, ...], *failed: str) -> tuple[Advice, ...]:
        checks = tuple(Check(name="", passed=False, identifier=name) for name in failed)
        checks += tuple(Check(name="", passed=False, identifier="identifiability") for _ in weak[:1])
        of: Any = SimpleNamespace(
            problem=problem,
            values=values,
            weak=weak,
            bars=SimpleNamespace(covariance=found.covariance),
            search=SimpleNamespace(plain=SimpleNamespace(scores=SimpleNamespace(normal_matrix=lambda: normal))),
            passed=lambda name: name not in {check.identifier for check in checks},
            residual_set=found.residual_set,
        )
        return advice(of, checks)

    assert ask(()) == ()
    assert "fibrefit discover" in advice_sentence(ask((), "residual_size")[0])
    assert "rests tell the noise" in advice_sentence(ask((), "noise_level")[0])
    assert ask((Weakness((f"release[{problem.layout.records[0]}]",), "vague", share=2.0),)) == ()
    (further,) = ask(TIED)
    assert advice_sentence(further).startswith(("A further record with lift", "No further record"))


@pytest.mark.slow
def test_the_share_of_unknown_minima_is_that_of_its_posterior() -> None:
    """Minima and their shares drawn as likely as each other, starts from these: of those like the starts at hand."""
    random, left = np.random.default_rng(1), []
    for _ in range(200_000):
        shares = random.dirichlet(np.ones(random.integers(1, 60)))
        found = random.choice(len(shares), 12, p=shares)
        if len(set(found.tolist())) == 3:
            left.append(1.0 - shares[np.unique(found)].sum())
    basin = [0] * 6 + [1] * 4 + [2] * 2
    assert 1.0 - judge.known_minima(starts(basin, [1.0] * 12)) == pytest.approx(np.mean(left), abs=0.01)
