"""Chances of a name although nothing is missing, against gains that are drawn; and every threshold decides."""

from __future__ import annotations

from dataclasses import replace
from itertools import starmap
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.special import logsumexp

from fibrefit.discovery import choice, comparison, conclusion, forward_selection, unnamed
from fibrefit.discovery import discover as search
from fibrefit.discovery.curves import free_form
from fibrefit.discovery.design import distinguish, grams, plan
from fibrefit.discovery.design import thresholds as of_design
from fibrefit.discovery.engine import priors, thresholds
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import NAMED, PRICE, Chance, false_alarm, false_alarm_at_most, gate, occam
from fibrefit.discovery.residuals import innovations
from fibrefit.discovery.residuals import thresholds as of_residuals
from fibrefit.discovery.search import inputs
from fibrefit.fitting.checks import CONVERGED
from fibrefit.laws.catalogue import find_effect
from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.discovery import Detectable
from fibrefit.study.summaries.results import ChannelGap
from fibrefit.workflow.design import distinguish as limits
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in
from tests.discovery.left import noise_alone, with_gap
from tests.discovery.placed import PLACES
from tests.discovery.test_events import SAMPLE
from tests.discovery.test_innovations import pink, resting
from tests.problem.toys import BareMode

VISCOUS = find_effect("guide.viscous_friction")
CANDIDATES = tuple(starmap(Chance, ((1, 2.0), (1, 3.5), (2, 4.0), (3, 6.0), (1, 2.5))))
"""Parameters each adds, and nats they cost."""
DRAWS = 100_000
SURE = 4.0
"""Standard errors of a share of so many draws."""


def best(alike: bool = False) -> np.ndarray:
    """Largest logarithm of a Bayes factor of the candidates over noise alone, ``(DRAWS,)``."""
    random, found = np.random.default_rng(1), []
    common = random.standard_normal((DRAWS, 3))
    for parameters, cost, _ in CANDIDATES:
        drawn = common if alike else random.standard_normal((DRAWS, 3))
        found.append(0.5 * np.sum(drawn[:, :parameters] ** 2, axis=1) - cost)
    return np.max(found, axis=0)


@pytest.mark.parametrize("log_factor", [-1.0, 0.0, 1.0, 3.0])
def test_a_false_alarm_is_as_probable_as_it_is_often(log_factor: float) -> None:
    said, often = false_alarm(log_factor, CANDIDATES), np.mean(best() >= log_factor)
    assert said == pytest.approx(often, abs=SURE * np.sqrt(said * (1.0 - said) / DRAWS))


def test_candidates_that_are_alike_are_on_the_safe_side() -> None:
    for log_factor in (0.0, 1.0, 3.0):
        said, often = false_alarm(log_factor, CANDIDATES), np.mean(best(alike=True) >= log_factor)
        assert said > often
        # By no more than there are candidates.
        assert said < len(CANDIDATES) * often


def test_one_candidate_is_not_the_best_of_many() -> None:
    """The negative control: were the best of many told as if it were the only one, chance would be larger than said."""
    alone = false_alarm(1.0, CANDIDATES[:1])
    assert np.mean(best() >= 1.0) > 1.5 * alone


@pytest.mark.parametrize("log_factor", [0.5, 1.0, 3.0])
def test_a_curve_reaches_a_bayes_factor_no_more_often_than_its_inverse(log_factor: float) -> None:
    """Of heights with normal priors over normal noise, whose marginal likelihood is known in closed form."""
    random = np.random.default_rng(2)
    slopes, size = random.standard_normal((30, 6)), np.linspace(0.1, 2.0, 6)
    gram = size[:, None] * (slopes.T @ slopes) * size + np.eye(6)
    pull = random.standard_normal((DRAWS, 30)) @ slopes * size
    factors = 0.5 * np.einsum("ni,ni->n", pull, np.linalg.solve(gram, pull.T).T) - 0.5 * np.linalg.slogdet(gram)[1]
    often = np.mean(factors >= log_factor)
    assert 0.0 < often <= false_alarm_at_most(log_factor)
    # The best of a thousand such curves is not that of one: unless their number is paid for, the bound is broken.
    best = factors.reshape(-1, 1000).max(axis=1)
    assert np.mean(best >= log_factor) > false_alarm_at_most(log_factor)
    assert np.mean(best - np.log(1000.0) >= log_factor) <= false_alarm_at_most(log_factor)


def test_a_name_is_hardly_ever_chance() -> None:
    # A catalogue of forty effects with two parameters that cost four nats each.
    assert false_alarm(NAMED, [Chance(2, 2.0 * PRICE)] * 40) < 1e-3
    assert false_alarm(NAMED, []) == 0.0
    assert false_alarm(200.0, CANDIDATES) < 1e-80
    falling = [false_alarm(x, CANDIDATES) for x in np.linspace(-10.0, 30.0, 50)]
    assert falling == sorted(falling, reverse=True)
    assert falling[0] == pytest.approx(1.0)


def test_a_bayes_factor_is_no_likelier_by_chance_than_its_inverse() -> None:
    """Where records differ much less with a candidate, its sum of squares says that it gains little."""
    assert false_alarm(NAMED, [Chance(1, -NAMED)]) == pytest.approx(np.exp(-NAMED))
    assert false_alarm(-1.0, [Chance(1, -NAMED)]) == pytest.approx(1.0)


@pytest.mark.parametrize("most", [0.1, 0.03, 0.01])
def test_a_step_at_an_instant_that_was_looked_for_is_no_rarer_than_said(most: float) -> None:
    """Of a level in white noise, at any of 360 instants: its Bayes factor is known in closed form."""
    random, n = np.random.default_rng(3), 400
    before = np.arange(20, n - 20)
    informed, prior = before * (n - before) / n, 100.0 / n
    said: dict[int, list[float]] = {0: [], 1: []}
    for values in random.standard_normal((4000, n)):
        sums = np.cumsum(values)
        scores = sums[-1] - sums[before - 1] - (n - before) * sums[-1] / n
        factors = 0.5 * scores**2 / (informed + 1.0 / prior) - 0.5 * np.log1p(informed * prior)
        factor = logsumexp(factors) - np.log(before.size)
        cost = np.max(0.5 * scores**2 / informed) - factor
        for searched, chances in said.items():
            chances.append(false_alarm(factor, [Chance(2, cost, searched)]))
    often = {searched: np.mean(np.array(chances) < most) for searched, chances in said.items()}
    assert often[1] <= most < often[0], "the negative control: taken for a parameter like any other, it is oftener"


def test_what_parameters_cost_is_the_gain_less_the_bayes_factor() -> None:
    before, after = (
        cast(Any, SimpleNamespace(log=log, mode=SimpleNamespace(objective=objective)))
        for log, objective in ((-100.0, 180.0), (-80.0, 132.0))
    )
    assert occam(before, after) == pytest.approx(24.0 - 20.0)


def test_an_effect_is_expected_to_be_named_at_its_gate() -> None:
    for parameters in (1, 2, 3):
        assert 0.5 * gate(parameters) - PRICE * parameters == pytest.approx(NAMED)


def fitted(log: float, effects: tuple[Any, ...] = (), **shared: float) -> Any:
    """A hypothesis by what is asked of it."""
    mode = SimpleNamespace(objective=0.0, steps=1)
    supermodel = SimpleNamespace(declared={name: SimpleNamespace(unit="N") for name in shared})
    return SimpleNamespace(
        log=log, effects=effects, names=effects, shared=shared, supermodel=supermodel,
        evidence=SimpleNamespace(log=log, mode=mode),
        with_log=lambda other, divided_off=0.0: fitted(other, effects), largest_loss_to=lambda other: 0.0,
    )  # fmt: skip


def effect(parameters: int) -> Any:
    return SimpleNamespace(
        name=f"guide.of_{parameters}", records=(), parameters=range(parameters), strength=("a",), sudden=False
    )


def chosen(*gains: tuple[float, int]) -> Any:
    """What is added of candidates of such gains, in nats, and numbers of parameters."""
    found = [fitted(gain, (effect(number),)) for gain, number in gains]
    ranked: Any = SimpleNamespace(
        found=found, gain=lambda one: one.log, parent=fitted(0.0), compared=("all",), gained=0.0
    )
    return choice.chosen_of(ranked, None)


def leaves_much(share: float) -> bool:
    """Whether an effect that leaves such a share of its gain may be a likeness, where slopes say nothing of curves."""
    ranked: Any = SimpleNamespace(gap=1.5, gain=lambda one: one.log)
    return unnamed._leaves_much(ranked, fitted(50.0), 50.0 * share)


def overdispersion_corrected(gain: float) -> bool:
    """Whether a gain counts for less in innovations that scatter twice as much as they should."""
    inference: Any = SimpleNamespace(overdispersion=lambda parent, one, names: 2.0)
    parent, one = fitted(0.0), fitted(gain, (effect(1),))
    return inputs.overdispersion_corrected(parent, one, inputs.overdispersion_of(inference, parent, one)).log < gain


EVIDENCE = MarginalLikelihood(cast(Any, None), 0.0, *(np.zeros(0) for _ in range(5)))
ALIKE_RECORDS: dict[str, Any] = {"place": SimpleNamespace(eta=np.zeros((1, 0))), "sigma": np.zeros(0)}
"""Of a mode in which records deviate in nothing."""


def of_records(log: float, *costs: float) -> Any:
    """A hypothesis by its evidence and the sum of squares that it leaves of each record."""
    mode: Any = BareMode(normal=SimpleNamespace(costs=np.array(costs)), **ALIKE_RECORDS)
    return LaplaceFit((effect(1),), cast(Any, None), replace(EVIDENCE, mode=mode, log=log))


def test_what_an_overdispersion_took_is_not_held_against_the_next_effect() -> None:
    """It decides a name; what is added next is compared without, and would gain it for nothing."""
    divided = of_records(40.0, 1.0).with_log(28.0, 12.0)
    assert (divided.log, divided.undivided.log, divided.undivided.divided_off) == (28.0, 40.0, 0.0)
    assert divided.undivided.undivided is not divided
    whole = of_records(40.0, 1.0)
    assert whole.undivided is whole


def test_a_record_that_deviates_less_has_lost_nothing() -> None:
    """What an effect saves a record in deviations counts as what it costs it in residuals does."""

    def deviating(eta: float, *costs: float) -> Any:
        found = {"place": SimpleNamespace(eta=np.array([[eta], [0.0]])), "sigma": np.array([0.01])}
        mode: Any = BareMode(normal=SimpleNamespace(costs=np.array(costs)), **found)
        return LaplaceFit((effect(1),), cast(Any, None), replace(EVIDENCE, mode=mode))

    parent, one = deviating(0.03, 100.0, 100.0), deviating(0.0, 117.0, 80.0)
    assert one.largest_loss_to(parent) == pytest.approx(4.0)  # 17 less the 9 of three standard deviations, in nats
    assert deviating(0.03, 117.0, 80.0).largest_loss_to(parent) == pytest.approx(8.5)


def test_a_record_of_others_that_differ_less_has_lost_nothing() -> None:
    """That what was added makes records differ less is no loss of one that differs as it did."""

    def deviating(sigma: float) -> Any:
        found = {"place": SimpleNamespace(eta=np.array([[0.015], [0.0]])), "sigma": np.array([sigma])}
        mode: Any = BareMode(normal=SimpleNamespace(costs=np.array([100.0, 100.0])), **found)
        return LaplaceFit((effect(1),), cast(Any, None), replace(EVIDENCE, mode=mode))

    assert deviating(0.004).largest_loss_to(deviating(0.016)) == 0.0
    assert deviating(0.016).largest_loss_to(deviating(0.004)) == 0.0


@pytest.mark.parametrize("overdispersion", [1.0, 2.0, 4.0])
def test_what_an_overdispersion_takes_is_no_price(overdispersion: float) -> None:
    """A gain that is divided is as likely by chance as one that was no greater from the beginning."""
    found = {"normal": SimpleNamespace(costs=np.zeros(1)), **ALIKE_RECORDS}
    before, after = (
        LaplaceFit(
            effects,
            cast(Any, None),
            replace(EVIDENCE, log=log, mode=cast(Any, BareMode(objective=objective, **found))),
        )
        for effects, log, objective in (((), -100.0, 180.0), ((VISCOUS,), -80.0, 132.0))
    )
    divided = inputs.overdispersion_corrected(before, after, overdispersion)
    assert divided.log - before.log == pytest.approx(24.0 / overdispersion - 4.0)
    there = comparison.Comparison(cast(Any, None), before, (divided,), frozenset({divided.names}))
    chance = choice._chance(there, divided)
    assert chance.parameters == 1
    assert chance.cost == pytest.approx(4.0)


@pytest.mark.parametrize(("width", "taken"), [(1.0, PRICE), (np.exp(-1.0), PRICE - 1.0), (np.exp(-6.0), 0.0)])
def test_an_instant_is_one_of_many_however_wide_the_matrices_say_it_is(width: float, taken: float) -> None:
    """Between two reversals it changes nothing: there its own curvature is that of its prior alone."""
    slip = find_effect("fibre.knot_slip")
    unknowns = SimpleNamespace(
        names=(f"{slip.name}.instant", f"{slip.name}.{slip.strength[0]}"), shared=np.arange(2), precision=np.eye(2)
    )
    spread = np.diag([width**2, 1e-4])
    evidence = replace(
        EVIDENCE, mode=cast(Any, SimpleNamespace(unknowns=unknowns)), log=30.0, weight=np.ones(1),
        z=np.zeros((1, 2)), covariance=spread[None],
    )  # fmt: skip
    one = LaplaceFit((slip,), cast(Any, None), evidence)
    assert one.log == pytest.approx(30.0 - taken)
    assert one.with_log(12.0).log == pytest.approx(12.0)


def believed(lost: float, gain: float = 50.0) -> bool:
    """Whether a gain stands where one record is less probable by so many nats."""
    parent, one = of_records(0.0, 100.0, 100.0), of_records(gain, 100.0 + 2.0 * lost, 100.0 - 2.0 * (gain + lost))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(inputs, "occam", lambda before, after: 4.0)
        return inputs.overdispersion_corrected(parent, one, 1.0).log > 0.0


def test_a_gain_that_one_record_objects_to_is_none() -> None:
    assert believed(0.0)
    assert not believed(17.0)
    # What is beyond doubt may stand in the wrong bounce of one record still.
    assert believed(17.0, 500.0)


@pytest.mark.parametrize("factors", [{1: 1.4, 2: 1.0}, {1: 1.0, 2: 1.0}, {1: 1.1, 2: 2.0}])
def test_of_two_that_explain_the_same_none_wins_by_less_overdispersion(
    monkeypatch: pytest.MonkeyPatch, factors: dict[int, float]
) -> None:
    """It is known to a half or so, and is that of the best one for both."""
    one, other = fitted(50.0, (effect(1),)), fitted(48.0, (effect(2),))
    for each in (one, other):
        each.names = (each.effects[0].name,)
        each.evidence.mode.steps = 1
    inference: Any = SimpleNamespace(
        again=lambda one: one,
        in_noise_of=lambda one: inference,
        settled_about=lambda one: True,
        overdispersion=lambda parent, one, names: factors[len(one.effects[0].parameters)],
        without=lambda one, kept: fitted(0.0),
        warm_started_without=lambda one, kept: fitted(-1.0),
    )
    monkeypatch.setattr(inputs, "occam", lambda before, after: 4.0)
    parent = fitted(0.0)
    parent.evidence.mode.sigma = np.zeros(1)
    search: Any = SimpleNamespace(context=None, inference=inference, with_inference=lambda inference: search)
    search.recalled = lambda what, parent, about, job, own: job
    ranked = comparison.in_same_noise(search, parent, [one, other])
    assert [found.effects for found in ranked.found] == [one.effects, other.effects]
    assert ranked.gain(ranked.found[0]) == pytest.approx(54.0 / factors[1] - 4.0)
    assert ranked.gain(ranked.found[1]) == pytest.approx(52.0 / factors[1] - 4.0)


@pytest.mark.parametrize(("moves", "taken"), [(0, 1), (2, 3), (9, 5)])
def test_the_noise_before_rounding_is_taken_anew_until_it_rests(moves: int, taken: int) -> None:
    """What gained only while that noise was another one gains nothing; it is not followed without end."""
    asked: list[Any] = []

    def known(one: Any) -> Any:
        one.names, one.evidence.mode.sigma = tuple(each.name for each in one.effects), np.zeros(1)
        return one

    def inference(turn: int) -> Any:
        return SimpleNamespace(
            again=lambda one: known(fitted(9.0 - 4.0 * turn if one.effects else 0.0, one.effects)),
            in_noise_of=lambda one: asked.append(one) or inference(turn + 1),
            settled_about=lambda one: turn > moves,
            overdispersion=lambda parent, one, names: 1.0,
            without=lambda one, kept: known(fitted(0.0)),
        )

    def search(inference: Any) -> Any:
        return SimpleNamespace(
            inference=inference, with_inference=search, recalled=lambda what, parent, about, job, own: job
        )

    parent, one = known(fitted(0.0)), known(fitted(9.0, (effect(1),)))
    ranked = comparison.in_same_noise(search(inference(0)), parent, [one])
    assert len(asked) == taken
    assert ranked.gain(ranked.found[0]) == 9.0 - 4.0 * taken


def test_what_was_not_followed_keeps_its_share_of_what_the_best_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its nats are those that slopes predicted in the noise of the parent, in which everything counts for more."""
    best, other, worse = (fitted(log, (effect(number),)) for log, number in ((480.0, 1), (240.0, 2), (-3.0, 3)))
    for each in (best, other, worse):
        each.names = (each.effects[0].name,)
        each.evidence.mode.steps = int(each is best)
        each.with_log = lambda log, each=each: SimpleNamespace(**(vars(each) | {"log": log}))
    inference: Any = SimpleNamespace(
        again=lambda one: one.with_log(160.0) if one.effects == best.effects else one,
        in_noise_of=lambda one: inference,
        settled_about=lambda one: True,
        without=lambda one, kept: fitted(0.0),
        overdispersion=lambda parent, one, names: 1.0,
    )
    parent = fitted(0.0)
    parent.evidence.mode.sigma = np.zeros(1)
    search: Any = SimpleNamespace(context=None, inference=inference, with_inference=lambda inference: search)
    search.recalled = lambda what, parent, about, job, own: job
    ranked = comparison.in_same_noise(search, parent, [best, other, worse])
    assert [(one.effects, one.log) for one in ranked.found] == [
        (best.effects, 160.0), (other.effects, pytest.approx(80.0)), (worse.effects, -3.0),
    ]  # fmt: skip


def nothing_left(gap: float, objections: int = 0) -> bool:
    """Whether costly effects are left alone beyond an effect that was named, at such a gap."""
    ranked: Any = SimpleNamespace(found=(), search=None, gap=gap, parent=fitted(0.0, (effect(1),)))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(comparison, "alarms_of", lambda search, fitted: [object()] * objections)
        return comparison._worth_following(ranked) == np.inf


def test_costly_effects_are_looked_at_beyond_a_name_where_a_test_objects() -> None:
    assert nothing_left(1.0)
    assert not nothing_left(1.0, objections=1)


def an_event(share: float) -> bool:
    """Whether what is left is told as an event where a curve accounts for such a share of it."""
    kept, curve = (cast(Any, SimpleNamespace(fit=SimpleNamespace(cost=cost))) for cost in (1e3, 1e3 * (1.0 - share)))
    step = np.where(SAMPLE >= 1130, 6.0 * np.sin(0.7 * SAMPLE), 0.0)
    found: Any = SimpleNamespace(residual_set=with_gap(noise_alone(0, records=1), step))
    found.problem = found.residual_set.problem
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(conclusion, "curve_facts", lambda curve: {})
        curves: Any = [SimpleNamespace(hypothesis=curve)]
        said = conclusion._looks_like(kept, cast(Any, SimpleNamespace(samples=0)), found, curves, False)
    return said.identifier == "event"


def visible(share: float) -> bool:
    """Whether two effects of which the base parameter imitates all but such a share are compared at all."""
    like = np.sqrt(1.0 - share**2)
    products = np.array([[[1.0, like, like], [like, 1.0, 1.0], [like, 1.0, 1.0]]])
    context: Any = SimpleNamespace(base=("stiffness",), each=())
    return bool(grams.likeness(products, len(context.base), len(context.each))[2][0, 1] > 0.5)


def determined(share: float) -> bool:
    """Whether two parameters are, with so much of the largest information where both change alike."""
    turned = np.array([[1.0, 1.0], [1.0, -1.0]])
    return bool(np.isfinite(plan._errors((turned * [1.0, share] @ turned)[None], 2, 0)).all())


def unconcerned(share: float) -> bool:
    """Whether a parameter is determined that has such a share in what two others imitate of each other."""
    a, c = np.eye(2)
    columns = np.stack([a, a + np.sqrt(2.0 * share) * c, c])
    return bool(np.isfinite(plan._errors((columns @ columns.T)[None], 3, 0))[2])


def told_apart(cosine: float) -> bool:
    """Whether records distinguish two effects so much alike."""
    both = tuple(
        Detectable(effect=name, parameter="size", unit="N", smallest_detectable=1.0, unique=0.5) for name in "ab"
    )
    return distinguish.Confusion(both, np.array([[1.0, cosine], [cosine, 1.0]])).inseparable == ()


def told_at_rest(power: float) -> bool:
    """Whether rests of such a power, in units of the noise in motion, are held against it."""
    traces = [one._replace(channels={"force": np.sqrt(power) * one.channels["force"]}) for one in resting(0, 0.0)]
    return innovations.against_rest(traces, "force", pink(0.0)) is not None


def told_by(ordinates: float) -> bool:
    """Whether so many ordinates at rest are held against the noise in motion."""
    noise, frequency = pink(0.0), np.array([10.0] * int(ordinates) + [200.0] * 20)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(innovations, "rests", lambda trace: [slice(0, 100)])
        patched.setattr(innovations, "periodogram", lambda values, rate: (frequency, noise.density(frequency)))
        return innovations.against_rest(resting(0, 0.0)[:1], "force", noise) is not None


def rests_differ(below: float, above: float) -> bool:
    """Whether rests with a tenth of the power at one frequency, and all of it at another, alarm."""
    noise, frequency = pink(0.0), np.array([below] * 20 + [above] * 20)
    power = np.where(np.arange(40) < 20, 0.1, 1.0) * noise.density(frequency)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(innovations, "rests", lambda trace: [slice(0, 100)])
        patched.setattr(innovations, "periodogram", lambda values, rate: (frequency, power))
        found = innovations.against_rest(resting(0, 0.0)[:1], "force", noise)
    return found is not None and found.raised


def seen(share: float) -> bool:
    """Whether a direction with such a share of a record's information is seen in a part of it."""
    return innovations._gain(np.diag([1.0, share]), np.ones(2), np.ones(2))[1] == 2


def steady(size: float) -> bool:
    """Whether a parameter that is off by so much one way, and then the other, passes for one that is constant."""
    score = size * np.where(np.arange(400) < 200, 1.0, -1.0)[None, :, None]
    return not innovations._windows(innovations._Scores(np.ones((1, 400, 1, 1)), score, np.full(1, 1e9))).raised


def told_of_constancy(freedom: float) -> bool:
    """Whether a record is tested for constancy whose scores' scatter is known from so many degrees of freedom."""
    scores = innovations._Scores(np.ones((1, 400, 1, 1)), np.zeros((1, 400, 1)), np.full(1, freedom))
    return innovations._windows(scores).facts["chance"] > 0


def as_at_rest(slow: float) -> bool:
    """Whether noise of variance one passes for that at rest with so much more variance below 15 Hz."""
    noise, parts = pink(0.0), ((4.0, slow), (15.0, slow))
    found = innovations.against_rest(resting(0, 0.0), "force", Noise(noise.white, 0.0, 0.0, 1000, slow=parts))
    return found is not None and not found.raised


def unremarked(gap: float) -> bool:
    """Whether such a gap is taken for noise where detection limits are told."""
    fit: Any = SimpleNamespace(
        gap={"force": ChannelGap.against_noise(1.0, gap, "N")}, expected_gap=1.0, error_inflation=1.0
    )
    return limits._beyond_noise(fit) == ((), 1.0)


def at_a_kink(share: float) -> bool:
    """Whether a base fit is trusted from which a further step predicts such a share of the cost."""
    check = Check(name="", passed=False, statistic=100.0 * share, fatal=True, identifier=CONVERGED)
    before: Any = SimpleNamespace(problem=SimpleNamespace(n_measured=100), checks=(check,))
    return not search._broken(before)


def by_logarithm(share: float) -> bool:
    """Whether a base parameter is told by its logarithm that is such a share of its typical size."""
    declared = SimpleNamespace(typical=1.0, lower=0.0, upper=9.0)
    slot = SimpleNamespace(name="friction", belief=None, range=declared)
    return priors._line(cast(Any, declared), cast(Any, slot), share, ())[0]


CASES = (
    Bracket("AT_A_KINK", search, at_a_kink, 0.04, 0.07),
    Bracket("ALARM", innovations, steady, 0.2512, 0.2589),
    Bracket("CONTRADICTED", innovations, as_at_rest, 0.0076, 0.0082),
    Bracket("LIKENESS", unnamed, lambda x: not leaves_much(x), 0.09, 0.11),
    Bracket("NOISE_LIKE", limits, unremarked, 1.03, 1.06),
    Bracket("NAMED", choice, lambda x: chosen((x, 1)) is not None, 6.0, 4.0),
    Bracket("SIMPLER", choice, lambda x: chosen((20.0, 3), (20.0 - x, 1)).log < 20.0, 2.5, 3.5),
    Bracket("BEYOND_DOUBT", inputs, overdispersion_corrected, 90.0, 110.0),
    Bracket("OBJECTS", inputs, believed, 6.0, 10.0),
    Bracket("ENOUGH", comparison, nothing_left, 1.01, 1.03),
    Bracket("CARRIED", forward_selection, lambda x: changes(x) != (), 0.06, 0.04),
    Bracket("TELLS", conclusion, an_event, 0.55, 0.65),
    Bracket("UNIQUE", grams, visible, 0.025, 0.015),
    Bracket("INSEPARABLE", distinguish, told_apart, 0.97, 0.99),
    Bracket("QUANTISED", innovations, told_at_rest, 0.36, 0.25),
    Bracket("FEWEST_TELLING", innovations, told_of_constancy, 7.0, 5.0),
    Bracket("FEWEST_ORDINATES", innovations, told_by, 9.0, 7.0),
    Bracket("RANK", innovations, seen, 1.3e-4, 0.7e-4),
    Bracket("UNKNOWN", plan, determined, 1.5e-12, 0.7e-12),
    Bracket("CONCERNED", plan, unconcerned, 0.7e-10, 1.5e-10),
    Bracket("APART", plan, lambda x: plan.Standing(0.0).distinguished(x) > 0.5, 6.0, 4.0),
    Bracket("SLOW_BELOW", innovations, lambda x: rests_differ(x, 200.0), 35.0, 45.0),
    Bracket("FAST_ABOVE", innovations, lambda x: rests_differ(10.0, x), 110.0, 90.0),
    Bracket("ACTS", free_form, lambda x: free_form.acting(np.repeat([x, 1.0], 5)) is not None, 0.15, 0.3),
    Bracket("VANISHES", priors, by_logarithm, 1.5e-6, 0.7e-6),
    *PLACES,
)


def changes(share: float) -> tuple:
    return forward_selection._changes(fitted(0.0, friction=4.0), fitted(0.0, friction=4.0 * (1.0 + share)))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    """`PRICE` is no verdict of its own: it makes the gate, which is tested above."""
    assert names_in(thresholds) | names_in(of_design) | names_in(of_residuals) == (
        {case.name for case in CASES} | {"PRICE"}
    ) - {"BESIDE_MAINS"}
