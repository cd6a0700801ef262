"""Slopes corrected from residuals: held against simulated ones, on records that take no simulation."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.discovery.engine.secant import SecantGram, Seed
from fibrefit.discovery.engine.slopes import Slopes
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.problem.estimate.gauss_newton import MODE_TOLERANCE, mode
from fibrefit.problem.inputs.sensitivities import Directions, InputSensitivities
from fibrefit.problem.linear_model.normal_equations import Arrowhead, PosteriorMode
from tests.problem.toys import NAMES, Linear, begun, gram_of, unknowns

TRUTH = np.array([0.3, -0.2, 0.5])
COUNTS = np.full(4, 40)
SIGMA = np.array([0.05])
CURVED = 0.3
"""Share of the square of its readings that a record has beside them."""


class Bench:
    """A supermodel whose readings are a known function, and which counts what is asked of it."""

    names = NAMES
    whitening = None
    problem = SimpleNamespace(observations=SimpleNamespace(weight={"force": None}))

    def __init__(self, linear: Linear, curved: float = 0.0, sensitivities: Any = None) -> None:
        self.linear, self.curved, self.sensitivities = linear, curved, sensitivities
        self.simulated, self.full = 0, 0

    def residuals(self, local: np.ndarray) -> np.ndarray:
        left = self.linear.residuals(local)
        return left + self.curved * ((left + self.linear.measured) ** 2 - self.linear.measured**2) / 10.0

    def rows(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> Any:
        self.simulated += 1 + len(columns)
        self.full += len(columns) > 0
        here = self.residuals(local)
        rows = [here]
        for i, column in enumerate(columns):
            moved = local.copy()
            moved[:, column] = targets[:, i]
            rows.append(self.residuals(moved) - here)
        return jnp.asarray(np.stack(rows, axis=1))

    def slopes(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> Slopes:
        return Supermodel.slopes(self, local, columns, targets, counts)  # type: ignore[arg-type]


def found_with(gram: Any) -> PosteriorMode:
    of = unknowns()
    return mode(of, begun(of), gram, SIGMA)


@pytest.mark.parametrize("curved", [0.0, CURVED])
def test_the_mode_is_that_of_simulated_slopes(curved: float) -> None:
    bench = Bench(Linear.drawn(1, TRUTH, scatter=0.05), curved)
    exact = found_with(gram_of(bench.residuals))
    secant = SecantGram(bench, COUNTS)  # type: ignore[arg-type]
    found = found_with(secant)
    assert found.objective == pytest.approx(exact.objective, abs=MODE_TOLERANCE)
    np.testing.assert_allclose(found.place.z, exact.place.z, atol=0.02)
    # The matrices that errors come from are those of simulated slopes.
    np.testing.assert_allclose(np.diag(found.normal.shared), np.diag(exact.normal.shared), rtol=0.05)
    # No mode ends on slopes that were foreseen: these are simulated once more than on the direct way.
    assert bench.simulated <= 6 * (exact.steps + 1), (bench.simulated, exact.steps)


@pytest.mark.parametrize("deviation", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_mode_ends_with_slopes_of_its_own_place(seed: int, deviation: float) -> None:
    """Also where its last step costs more in the data than is gained there, and less with the priors."""
    of, bench = unknowns(), Bench(Linear.drawn(seed, TRUTH, scatter=0.3), CURVED)
    start = begun(of)._replace(eta=np.full((4, 1), deviation))
    found = mode(of, start, SecantGram(bench, COUNTS), np.array([0.02]))  # type: ignore[arg-type]
    there = Arrowhead.at(of, found.place, gram_of(bench.residuals))
    np.testing.assert_allclose(found.normal.shared, there.shared, rtol=1e-6)
    np.testing.assert_allclose(found.normal.pulls, there.pulls, rtol=1e-6, atol=1e-6)


def test_no_mode_counts_before_simulated_slopes_ask_for_no_step() -> None:
    bench = Bench(Linear.drawn(1, TRUTH), CURVED)
    secant = SecantGram(bench, COUNTS)  # type: ignore[arg-type]
    found = found_with(secant)
    fresh = mode(unknowns(), found.place, gram_of(bench.residuals), SIGMA)
    assert fresh.steps == 1
    assert fresh.objective == pytest.approx(found.objective, rel=1e-9)


def test_a_wrong_seed_leads_to_the_same_mode() -> None:
    bench = Bench(Linear.drawn(1, TRUTH), CURVED)
    other = Bench(Linear.drawn(2, TRUTH), CURVED)
    exact, seeds = found_with(gram_of(bench.residuals)), []

    def keep(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        seeds.append(other.slopes(local, columns, targets, COUNTS))
        return seeds[0].grams(None)

    unknowns().local_grams(begun(unknowns()), keep)
    secant = SecantGram(bench, COUNTS, Seed(NAMES, seeds[0]))  # type: ignore[arg-type]
    found = found_with(secant)
    assert found.objective == pytest.approx(exact.objective, abs=MODE_TOLERANCE)


def test_a_seed_saves_the_simulations_it_stands_for() -> None:
    linear = Linear.drawn(1, TRUTH)
    bench, seeds, of = Bench(linear), [], unknowns()

    def keep(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        seeds.append(bench.slopes(local, columns[:2], targets[:, :2], COUNTS))
        return gram_of(bench.residuals)(local, columns, targets)

    whole = of.local_grams(begun(of), keep)
    bench.simulated = 0
    grams = of.local_grams(begun(of), SecantGram(bench, COUNTS, Seed(NAMES[:2], seeds[0])))  # type: ignore[arg-type]
    assert bench.simulated == 1 + 3
    np.testing.assert_allclose(grams, whole, rtol=1e-9, atol=1e-9)


def test_corrected_slopes_foretell_where_the_step_led() -> None:
    random = np.random.default_rng(0)
    old, new = random.standard_normal((2, 4, 9)), random.standard_normal((2, 1, 9))
    pulled, other = random.standard_normal((2, 4, 3)), random.standard_normal((2, 1, 3))
    way = random.standard_normal((2, 3))
    led = Slopes(old, pulled).updated(Slopes(new, other), way)
    assert led.pulled is not None
    after_all = np.array(led.pulled)
    for before, after, corrected in ((old, new, led.rows), (pulled, other, after_all)):
        np.testing.assert_allclose(before[:, 0] + np.einsum("rj,rjk->rk", way, corrected[:, 1:]), after[:, 0])
    # Across the step nothing was learnt, and nothing changes.
    across = np.cross(way, random.standard_normal((2, 3)))
    for before, corrected in ((old, led.rows), (pulled, after_all)):
        np.testing.assert_allclose(
            np.einsum("rj,rjk->rk", across, corrected[:, 1:]), np.einsum("rj,rjk->rk", across, before[:, 1:])
        )


def test_errors_of_inputs_are_eliminated() -> None:
    random = np.random.default_rng(3)
    pulls = 0.3 * random.standard_normal((4, 2, 40))
    inverse = np.linalg.inv(np.eye(2) + pulls @ np.swapaxes(pulls, 1, 2))
    records = [
        Directions(np.eye(2), each.astype(np.float32)[:, None], of) for each, of in zip(pulls, inverse, strict=True)
    ]
    seen = InputSensitivities({}, np.ones((4, 1, 40)), np.zeros((4, 40)), tuple(records))
    bench = Bench(Linear.drawn(1, TRUTH), 0.0, seen)
    local, columns = begun(unknowns()).rest, np.arange(2)
    slopes = bench.slopes(local, columns, local[:, :2] + 1e-3, COUNTS)
    left = np.eye(40) - np.swapaxes(pulls, 1, 2) @ inverse @ pulls
    expected = slopes.rows @ left @ np.swapaxes(slopes.rows, 1, 2)
    keep = [1, 2, 0]
    np.testing.assert_allclose(slopes.grams(bench.sensitivities), expected[:, keep][:, :, keep], rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("pulled", [True, False])
def test_what_unknowns_imitate_of_a_change_is_carried_over_to_where_they_are(pulled: bool) -> None:
    """An effect leaves a thousandth of the unknowns' changes, and these are a tenth otherwise at the other place."""
    random = np.random.default_rng(5)
    here = random.normal(size=(3, 4, 200))
    there = here + 0.1 * random.normal(size=here.shape)
    # An unknown that cannot move changes nothing.
    here[:, 2] = there[:, 2] = 0.0
    share, own = random.normal(size=(3, 2, 4)), 1e-3 * random.normal(size=(3, 2, 200))
    directions = random.normal(size=(200, 6))

    def slopes(rows: np.ndarray) -> Slopes:
        return Slopes(rows, list(rows @ directions) if pulled else None)

    found = slopes(share @ there + own).carried_over(slopes(there), slopes(here))
    # By least squares the unknowns take along what they imitate of the effect's own part, as they do where they are.
    imitated = np.array([row @ np.linalg.pinv(of) for row, of in zip(own, there, strict=True)])
    expected = share @ here + own + imitated @ (here - there)
    np.testing.assert_allclose(found.rows, expected, atol=1e-7)
    assert np.abs(share @ (there - here)).max() > 100.0 * np.abs(own).max()
    if found.pulled is not None:
        np.testing.assert_allclose(found.pulled, expected @ directions, atol=1e-6)
