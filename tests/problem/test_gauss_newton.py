"""One Gauss-Newton for shared values, nuisances and deviations, held against dense solves and SciPy."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from fibrefit.problem.estimate.gauss_newton import (
    MODE_TOLERANCE,
    NOTICEABLE_FALL,
    SHORTEST_STEP,
    DampedStep,
    Effort,
    mode,
    radius_after,
    record_wise_start,
    step_within,
)
from fibrefit.problem.linear_model.normal_equations import Arrowhead, PosteriorMode
from fibrefit.problem.linear_model.unknowns import Place, Unknowns
from tests.problem.toys import NAMES, Linear, begun, bounded, dense, gram_of, unknowns

TRUTH = np.array([0.3, -0.2, 0.5])
EXACT = 1e-6
"""Differences of step 1e-6 of a linear function, and the damping of the last step, each good to more digits."""
ARRIVED = 1e-9
"""Promised fall of Q for a closer look than any user needs."""


def unfolded(found: PosteriorMode) -> np.ndarray:
    """Unknowns in the order of a dense solve."""
    own = np.concatenate([found.place.own, found.place.eta], axis=1)
    return np.concatenate([found.place.z, own.ravel()])


@pytest.mark.parametrize("scattering", [(), (0,), (0, 1)])
def test_the_mode_is_that_of_a_dense_solve(scattering: tuple[int, ...]) -> None:
    of, sigma = unknowns(scattering), np.full(len(scattering), 0.05)
    linear = Linear.drawn(1, TRUTH, scatter=0.05 * bool(scattering))
    best, lowest = dense(linear, of, sigma)
    found = mode(of, begun(of), linear.gram, sigma, ARRIVED)
    np.testing.assert_allclose(unfolded(found), best, atol=EXACT)
    assert found.objective == pytest.approx(lowest, rel=EXACT)
    assert found.normal.cost == pytest.approx(np.sum(linear.residuals(found.local) ** 2), rel=EXACT)
    assert found.steps <= 4


def test_where_slopes_are_no_numbers_nothing_is_predicted() -> None:
    # Those that were predicted on the way are; those simulated at its end are not, though the motion has a cost.
    of, linear = unknowns(()), Linear.drawn(1, TRUTH)

    class Predicted:
        exact = False

        def renew(self) -> None:
            self.exact = True

        def __call__(self, *of: np.ndarray) -> np.ndarray:
            found = linear.gram(*of).copy()
            if self.exact:
                found[:, 0, :-1] = found[:, :-1, 0] = np.inf
            return found

    found = mode(of, begun(of), Predicted(), np.zeros(0), ARRIVED)
    assert found.normal.cost == found.predicted_reduction == np.inf


def test_matrices_are_those_of_the_columns() -> None:
    of, linear = unknowns(), Linear.drawn(2, TRUTH)
    design, own = linear.design(of), 3
    found = Arrowhead.at(of, begun(of), linear.gram)
    np.testing.assert_allclose(found.shared, design[:, :3].T @ design[:, :3], rtol=EXACT)
    for r in range(4):
        mine = design[:, 3 + r * own : 3 + (r + 1) * own]
        np.testing.assert_allclose(found.blocks[r], mine.T @ mine, rtol=EXACT, atol=EXACT)
        np.testing.assert_allclose(found.cross[r], design[:, :3].T @ mine, rtol=EXACT, atol=EXACT)
        np.testing.assert_allclose(found.pulls[r], -mine.T @ linear.measured.ravel(), rtol=EXACT, atol=EXACT)
    np.testing.assert_allclose(found.pull, -design[:, :3].T @ linear.measured.ravel(), rtol=EXACT)
    assert found.costs.sum() == found.cost == pytest.approx(np.sum(linear.measured**2))


def test_values_that_are_held_stay_and_the_others_make_up_for_them() -> None:
    of, linear, sigma = unknowns(), Linear.drawn(3, TRUTH), np.array([0.02])
    free = of.free.copy()
    free[1, 0] = free[3, 1] = False
    held = np.where(free, 0.0, 0.7)
    of = replace(of, free=free)
    start = begun(of)
    found = mode(of, start._replace(own=held.copy()), linear.gram, sigma, ARRIVED)
    best, lowest = dense(linear, of, sigma, held)
    own = best[3:].reshape(4, 3)
    np.testing.assert_allclose(found.place.own, np.where(free, own[:, :2], held), atol=EXACT)
    np.testing.assert_allclose(found.place.z, best[:3], atol=EXACT)
    assert found.objective == pytest.approx(lowest, rel=EXACT)


def test_no_scatter_at_all_is_one_value_for_all_records() -> None:
    linear = Linear.drawn(4, TRUTH)
    rigid = mode(unknowns(), begun(unknowns()), linear.gram, np.zeros(1), ARRIVED)
    without = mode(unknowns(()), begun(unknowns(())), linear.gram, np.zeros(0), ARRIVED)
    np.testing.assert_allclose(rigid.place.z, without.place.z, atol=EXACT)
    assert np.abs(rigid.place.eta).max() < EXACT
    assert rigid.objective == pytest.approx(without.objective, rel=EXACT)


@pytest.mark.parametrize(("side", "value"), [("upper", 0.0), ("lower", 0.6)])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_bound_holds_and_the_others_are_best_beside_it(side: str, value: float, index: int) -> None:
    """The negative control is a bound beyond the best: it changes nothing."""
    of, linear = unknowns(()), Linear.drawn(5, TRUTH)
    free = mode(of, begun(of), linear.gram, np.zeros(0), ARRIVED)
    limits = {side: (index, value)}
    of = bounded(of, **limits)
    found = mode(of, begun(of), linear.gram, np.zeros(0), ARRIVED)
    best = _bounded_dense(linear, of)
    np.testing.assert_allclose(found.place.z, best, atol=EXACT)
    assert np.all((found.place.z >= of.lower) & (found.place.z <= of.upper))
    inside = free.place.z[index] < value if side == "upper" else free.place.z[index] > value
    assert inside == np.allclose(found.place.z, free.place.z, atol=EXACT)


def test_a_bound_is_held_where_values_are_alike() -> None:
    """Two coordinates that do nearly the same: one at its bound, the other has to take back what it gave up."""
    of, linear = _alike()
    best = _bounded_dense(linear, of)
    found = mode(of, begun(of, np.array([0.5, 0.0, 0.0])), linear.gram, np.zeros(0), ARRIVED)
    np.testing.assert_allclose(found.place.z, best, atol=1e-3)


def _alike() -> tuple[Unknowns, Linear]:
    linear = Linear.drawn(6, np.array([-0.5, 1.0, 0.0]))
    slopes = 3.0 * linear.slopes
    slopes[:, :, 1] = slopes[:, :, 0] + 0.1 * slopes[:, :, 1]
    measured = slopes[:, :, :3] @ np.array([-0.5, 1.0, 0.0]) + np.random.default_rng(1).standard_normal(
        slopes.shape[:2]
    )
    return bounded(unknowns(()), lower=(0, 0.0)), Linear(slopes, measured)


def _bounded_dense(linear: Linear, of: Unknowns) -> np.ndarray:
    """Shared coordinates of SciPy's bounded least squares."""
    design = linear.design(of)
    root = np.linalg.cholesky(of.precision).T
    prior = np.concatenate([root, np.zeros((3, design.shape[1] - 3))], axis=1)
    far = np.full(design.shape[1] - 3, np.inf)
    found = lsq_linear(
        np.concatenate([design, prior]),
        np.concatenate([linear.measured.ravel(), root @ of.mean]),
        (np.concatenate([of.lower, -far]), np.concatenate([of.upper, far])),
        method="bvls",
        tol=1e-14,
    )
    return np.asarray(found.x[:3])


def test_a_start_outside_its_bounds_is_brought_in() -> None:
    of = bounded(unknowns(()), lower=(1, 0.5))
    linear = Linear.drawn(7, TRUTH)
    found = mode(of, begun(of, np.array([0.0, -3.0, 0.0])), linear.gram, np.zeros(0), effort=Effort(steps=1))
    assert found.place.z[1] == 0.5


def test_the_predicted_reduction_is_the_fall() -> None:
    of, sigma = unknowns(), np.array([0.05])
    linear = Linear.drawn(8, TRUTH, scatter=0.05)
    # At any tolerance nothing is done, and the predicted reduction of the first step is returned.
    begin = mode(of, begun(of), linear.gram, sigma, tolerance=np.inf)
    assert begin.steps == 1
    # The damping of the first step, 1e-4, costs its square.
    assert begin.predicted_reduction == pytest.approx(begin.objective - dense(linear, of, sigma)[1], rel=1e-4)
    end = mode(of, begun(of), linear.gram, sigma)
    assert 0.0 <= end.predicted_reduction <= MODE_TOLERANCE


def test_what_no_record_sees_stays() -> None:
    of, linear = unknowns((), records=2), Linear.drawn(9, TRUTH, records=2)
    slopes = linear.slopes.copy()
    slopes[:, :, 4] = 0.0
    blind = Linear(slopes, linear.measured)
    start = begun(of, records=2)._replace(own=np.full((2, 2), 0.3))
    found = mode(of, start, blind.gram, np.zeros(0), ARRIVED)
    np.testing.assert_array_equal(found.place.own[:, 1], 0.3)
    assert found.predicted_reduction < MODE_TOLERANCE


def test_where_slopes_are_no_numbers_a_start_is_lost_and_nothing_fails() -> None:
    of, linear = unknowns((), records=2), Linear.drawn(9, TRUTH, records=2)

    def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        found = linear.gram(local, columns, targets)
        found[1, 0, :] = found[1, :, 0] = np.nan
        return found

    found = mode(of, begun(of, records=2), gram, np.zeros(0), ARRIVED)
    assert found.normal.cost == np.inf
    assert found.steps == 1


def test_where_products_of_slopes_are_no_numbers_no_step_leads_on_and_nothing_fails() -> None:
    """Each slope is a number still; what is left of shared values where own ones are eliminated is none."""
    of, linear = unknowns((0,), records=2), Linear.drawn(9, TRUTH, records=2)
    found = mode(of, begun(of, records=2), linear.gram, np.array([0.05]), ARRIVED)
    lost = replace(found, normal=found.normal._replace(cross=np.full_like(found.normal.cross, 1e200)))
    again = mode(of, lost, linear.gram, np.array([0.05]), ARRIVED)
    assert np.isfinite(again.normal.cost)
    assert again.predicted_reduction == np.inf
    assert found.predicted_reduction < ARRIVED


TIMES = np.linspace(0.0, 2.0, 50)


def decays(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Records of a decay from an amplitude, with an offset each, and the deviations of its pace."""
    random = np.random.default_rng(seed)
    eta = 0.05 * random.standard_normal(5)
    pace = 1.5 * np.exp(eta)
    clean = 8.0 * np.exp(-pace[:, None] * TIMES) + random.standard_normal((5, 1))
    return clean + 0.05 * random.standard_normal(clean.shape), eta


def test_a_curved_model_ends_where_scipy_ends() -> None:
    measured, _ = decays(0)
    of = replace(
        unknowns((1,), 5),
        shared=np.arange(2),
        each=np.array([2]),
        free=np.ones((5, 1), dtype=bool),
        log=np.ones(2, dtype=bool),
        reference=np.array([5.0, 1.0]),
        scale=np.ones(2),
        mean=np.zeros(2),
        precision=np.eye(2),
        lower=np.full(2, -5.0),
        upper=np.full(2, 5.0),
        size=np.ones(1),
        names=NAMES[:2] + NAMES[3:4],
    )

    def residuals(local: np.ndarray) -> np.ndarray:
        return (local[:, :1] * np.exp(-local[:, 1:2] * TIMES) + local[:, 2:] - measured) / 0.05

    sigma = np.array([0.05])
    start = Place(np.array([-1.0, 1.5]), np.zeros((5, 1)), np.zeros((5, 1)), np.ones((5, 3)))
    found = mode(of, start, gram_of(residuals), sigma, ARRIVED)

    def stacked(x: np.ndarray) -> np.ndarray:
        place = Place(x[:2], x[2:7, None], x[7:, None], start.rest)
        return np.concatenate([residuals(of.local_of(place)).ravel(), x[:2], x[7:] / sigma])

    scipy = least_squares(stacked, np.concatenate([start.z, np.zeros(10)]), xtol=1e-15, ftol=1e-15, gtol=1e-12)
    assert found.objective == pytest.approx(2.0 * scipy.cost, rel=EXACT)
    np.testing.assert_allclose(unfolded_of(found), scipy.x, atol=1e-5)
    # What it says it ends with is what its values give.
    cost = np.sum(residuals(found.local) ** 2)
    assert found.objective == pytest.approx(cost + of.penalty(found.place, sigma), rel=EXACT)


def unfolded_of(found: PosteriorMode) -> np.ndarray:
    return np.concatenate([found.place.z, found.place.own.ravel(), found.place.eta.ravel()])


def test_a_place_made_of_values_gives_them_back() -> None:
    of = unknowns((0, 1))
    random = np.random.default_rng(10)
    z = np.array([0.2, -0.4, 0.6])
    local = of.local_of(Place(z, random.standard_normal((4, 2)), np.zeros((4, 2)), np.zeros((4, 5))))
    local[:, :2] *= np.exp(0.01 * random.standard_normal((4, 2)))
    np.testing.assert_allclose(of.local_of(of.place_of(local)), local, rtol=1e-12)
    # Deviations that are known are taken off, also where their mean is not nothing: the place is the one it was.
    eta = 0.1 * random.standard_normal((4, 2)) + 0.05
    there = of.place_of(local)._replace(eta=eta)
    again = of.place_of(of.local_of(there), eta)
    np.testing.assert_allclose(again.z, there.z, atol=1e-12)
    np.testing.assert_array_equal(again.eta, eta)
    # Told the deviations, it takes them as they are.
    told = of.place_of(local, np.zeros((4, 2)))
    assert not told.eta.any()
    np.testing.assert_allclose(np.log(of.value(told.z)[:2]), np.log(local[:, :2]).mean(axis=0), rtol=1e-12)
    outside = bounded(of, upper=(0, 0.1)).place_of(local)
    assert outside.z[0] == 0.1


def test_a_step_that_leads_nowhere_is_not_taken() -> None:
    """Where residuals are not finite beyond a wall, the search stays before it."""
    of, linear = unknowns(()), Linear.drawn(11, TRUTH)

    def walled(local: np.ndarray) -> np.ndarray:
        left = linear.residuals(local)
        return np.where(np.log(local[:, :1] / 20.0) > 0.2, np.nan, left)

    found = mode(of, begun(of), gram_of(walled), np.zeros(0))
    assert np.isfinite(found.objective)
    assert found.place.z[0] <= 0.2
    assert found.objective < mode(of, begun(of), gram_of(walled), np.zeros(0), tolerance=np.inf).objective


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_a_motion_that_is_lost_at_the_start_is_told_and_not_raised(lost: float) -> None:
    of, linear = unknowns((0,)), Linear.drawn(1, TRUTH)

    def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        return np.where(np.arange(len(local))[:, None, None] == 1, lost, linear.gram(local, columns, targets))

    found = mode(of, begun(of), gram, np.array([0.05]))
    assert found.steps == 1
    assert not np.isfinite(found.objective)


@pytest.mark.parametrize("share", [1e-6, 1e-3, 0.1, 0.5, 0.8])
def test_a_step_has_the_size_of_the_radius_and_is_predicted_to_gain_less_the_shorter_it_is(share: float) -> None:
    of, linear = unknowns(), Linear.drawn(11, TRUTH)
    at = PosteriorMode(of, begun(of), Arrowhead.at(of, begun(of), linear.gram), np.array([0.05]), np.inf, 1)
    whole = step_within(at, 1e9)
    shorter = step_within(at, share * whole.size)
    assert shorter.size == pytest.approx(share * whole.size, rel=0.11)
    # Q along any way falls at most as it does at its start.
    assert 0.0 < shorter.predicted_reduction < min(whole.predicted_reduction, shorter.slope)
    here = of.penalty(shorter.place, at.sigma) + np.sum(linear.residuals(of.local_of(shorter.place)) ** 2)
    assert at.objective - here == pytest.approx(shorter.predicted_reduction, rel=1e-4)


def test_after_a_rise_the_radius_is_where_a_parabola_is_lowest() -> None:
    # Q falls as 4 t - 10 t^2 along a step of size 3: a fall of -6 at its end, most at t = 0.2.
    step = DampedStep(begun(unknowns()), predicted_reduction=2.0, slope=4.0, size=3.0)
    assert radius_after(step, -6.0, 5.0) == pytest.approx(0.6)
    assert radius_after(step, -1e6, 5.0) == radius_after(step, np.nan, 5.0) == pytest.approx(3.0 * SHORTEST_STEP)
    assert radius_after(step, 1.0, 5.0) == 5.0
    assert radius_after(step, 1.9, 5.0) == 6.0
    assert radius_after(step, 1.0, np.inf) == 3.0


def test_what_creeps_is_left_and_what_is_worth_nothing_given_up() -> None:
    of, linear, nothing = unknowns(()), Linear.drawn(3, TRUTH), np.zeros(0)

    def misled(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        # Slopes a hundred times too large: each step goes a hundredth of its way.
        scale = np.r_[np.full(len(columns), 100.0), 1.0]
        return linear.gram(local, columns, targets) * np.outer(scale, scale)

    ends = [mode(of, begun(of), misled, nothing, effort=effort) for effort in (Effort(), Effort(patience=5))]
    assert ends[0].steps > ends[1].steps >= 6
    assert ends[1].objective - ends[0].objective < ends[0].steps / 5 * NOTICEABLE_FALL
    given_up = Effort(patience=5, worthless=ends[1].objective - 1.0)
    assert mode(of, begun(of), misled, nothing, effort=given_up).steps == 6
    # So is what gains little beside what it has gained so far, and more of what has gained nothing yet is waited for.
    before = mode(of, begun(of), misled, nothing, effort=Effort(steps=1)).objective
    shares = [
        mode(of, begun(of), misled, nothing, effort=Effort(patience=5, share=share, before=before))
        for share in (0.0, 0.5)
    ]
    assert shares[0].steps == ends[1].steps > shares[1].steps >= 6
    assert shares[1].objective < before
    # What does not creep ends where it ended.
    easy = [mode(of, begun(of), linear.gram, nothing, effort=effort) for effort in (Effort(), Effort(patience=2))]
    assert easy[0].objective == pytest.approx(easy[1].objective, abs=MODE_TOLERANCE)


def test_of_several_places_it_goes_on_from_the_one_that_leads_lowest() -> None:
    """A swing whose frequency is a few periods off is a minimum of its own; no horizons are at hand."""
    of, samples = unknowns(), np.arange(400)
    truth = of.value(TRUTH)[0]

    def residuals(local: np.ndarray) -> np.ndarray:
        swing = np.sin(0.02 * local[:, :1] * samples) - np.sin(0.02 * truth * samples)
        return np.concatenate([30.0 * swing, local[:, 1:] - of.value(TRUTH)[1]], axis=1)

    data = SimpleNamespace(observations=SimpleNamespace(weight={"force": np.ones((4, 404))}))
    seen: Any = SimpleNamespace(gram=lambda _: gram_of(residuals), problem=data)
    far, near = begun(of, TRUTH + np.array([0.3, 0.0, 0.0])), begun(of, TRUTH + np.array([0.003, 0.0, 0.0]))
    nowhere = np.empty((0, 1, 4), dtype=int)
    ends = [record_wise_start(of, places, seen, nowhere) for places in ([far], [far, near], [near, far])]
    assert np.abs(of.value(ends[0].z)[0] / truth - 1.0) > 0.05
    for end in ends[1:]:
        assert of.value(end.z)[0] == pytest.approx(truth, rel=1e-3)
