"""The sampler on densities that are known: right, repeatable, safe to interrupt; and R-hat and ESS of known chains."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest

from fibrefit.core.errors import UsageError
from fibrefit.sampling.chains import ChainHistory, SamplerProgress, mixing, next_look, run_ensembles
from fibrefit.sampling.settings import Settings
from tests.sampling.targets import around, correlated, normal, target

MONTE_CARLO = 4.5
"""Standard errors that none of some tens of means may stray."""
SIZE = 5
CENTRE, COVARIANCE = correlated(SIZE)
DENSITY = normal(CENTRE, COVARIANCE)


def course(seed: int = 0, **more: object) -> ChainHistory:
    settings = Settings(seed=seed, **more.pop("settings", {}))
    return run_ensembles(target(DENSITY, SIZE), around(DENSITY, CENTRE, COVARIANCE), settings, **more)


def test_moments_are_those_of_the_density() -> None:
    found = course()
    assert found.converged
    points = found.kept.reshape(-1, SIZE)
    scale = np.sqrt(np.diag(COVARIANCE))
    error = scale / np.sqrt(found.mixing.ess_bulk)
    assert np.all(np.abs(points.mean(axis=0) - CENTRE) < MONTE_CARLO * error)
    covariance = np.cov(points.T) / np.outer(scale, scale)
    assert np.abs(covariance - COVARIANCE / np.outer(scale, scale)).max() < MONTE_CARLO * 1.5 / np.sqrt(
        found.mixing.ess_tail.min()
    )


def test_a_poor_approximation_costs_time_and_not_truth() -> None:
    """Its centre is off by a standard deviation or two and its width is wrong: the other moves see to it."""
    off = CENTRE + 1.5 * np.sqrt(np.diag(COVARIANCE))
    found = run_ensembles(
        target(DENSITY, SIZE), around(DENSITY, off, np.diag(np.diag(COVARIANCE)) / 9.0), Settings(seed=2)
    )
    assert found.converged
    points = found.kept[:, ::5].reshape(-1, SIZE)
    for i in range(SIZE):
        thin = points[:: max(1, len(points) // 400), i]
        assert kstest((thin - CENTRE[i]) / np.sqrt(COVARIANCE[i, i]), "norm").pvalue > 1e-4
    assert len(found.points[0]) > len(course().points[0])


def test_the_wrong_density_is_noticed() -> None:
    """The negative control: the same comparison, the density wider by a fifth."""
    wider = normal(CENTRE, 1.44 * COVARIANCE)
    found = run_ensembles(target(wider, SIZE), around(wider, CENTRE, COVARIANCE), Settings(seed=0))
    scale = np.sqrt(np.diag(COVARIANCE))
    spread = found.kept.reshape(-1, SIZE).std(axis=0) / scale
    assert np.all(np.abs(spread - 1.0) > MONTE_CARLO / np.sqrt(2.0 * found.mixing.ess_bulk))


def test_the_same_seed_gives_the_same_bits_whatever_the_threads() -> None:
    one, two, other = (course(3, settings={"threads": n}) for n in (1, 4, 2))
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.log_density, other.log_density)
    assert not np.array_equal(one.points, course(4).points)


def test_ensembles_know_nothing_of_each_other() -> None:
    found = course()
    assert len({ensemble[0, 0, 0] for ensemble in found.points}) == 4
    few, more = (course(5, settings={**LONG, "walkers": 20, "ensembles": number}) for number in (4, 5))
    steps = min(few.points.shape[1], more.points.shape[1])
    np.testing.assert_array_equal(few.points[:, :steps], more.points[:4, :steps])


class StopError(Exception):
    """Stands for anything that may end a run."""


def stopped(after: int, file: Path) -> None:
    def progress(said: SamplerProgress) -> None:
        if said.steps >= after:
            raise StopError

    with pytest.raises(StopError):
        course(5, settings=LONG, checkpoint_file=file, progress=progress)


LONG = {"max_steps": 150, "ess": 1e9}


def test_a_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    whole, file = course(5, settings=LONG), tmp_path / "chains.npz"
    for after in (1, 20, 64, 130):
        stopped(after, file)
    steps: list[int] = []
    done = course(5, settings=LONG, checkpoint_file=file, progress=lambda said: steps.append(said.steps))
    assert 1 < steps[0] < 150, "the chains are not begun anew"
    np.testing.assert_array_equal(done.points, whole.points)
    np.testing.assert_array_equal(done.log_density, whole.log_density)
    assert done.mixing.r_hat.tolist() == whole.mixing.r_hat.tolist()


def test_an_interrupted_block_is_finished_by_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One thread for four ensembles, interrupted as the first of them is done: none lags behind, so all are kept."""
    file = tmp_path / "chains.npz"
    waited = Future.result
    calls: list[int] = []

    def interrupted(self: Future[None], timeout: float | None = None) -> None:
        calls.append(1)
        if len(calls) == 10:
            raise StopError
        return waited(self, timeout)

    monkeypatch.setattr(Future, "result", interrupted)
    density = normal(CENTRE, COVARIANCE)

    def slow(points: np.ndarray) -> np.ndarray:
        """Lets the other thread go on, so that ensembles are left that have not begun."""
        time.sleep(2e-3)
        return density(points)

    with pytest.raises(StopError):
        settings = Settings(seed=5, **(LONG | {"threads": 1}))
        run_ensembles(target(slow, SIZE), around(density, CENTRE, COVARIANCE), settings, file)
    monkeypatch.undo()
    steps: list[int] = []
    done = course(5, settings=LONG, checkpoint_file=file, progress=lambda said: steps.append(said.steps))
    assert steps[0] > 1
    np.testing.assert_array_equal(done.points, course(5, settings=LONG).points)


def test_a_finished_run_is_not_gone_again(tmp_path: Path) -> None:
    file = tmp_path / "chains.npz"
    first = course(5, checkpoint_file=file)
    again = course(5, checkpoint_file=file, progress=lambda said: pytest.fail(f"walks on from step {said.steps}"))
    np.testing.assert_array_equal(again.points, first.points)


def test_another_runs_checkpoint_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "chains.npz"
    stopped(20, file)
    with pytest.raises(UsageError) as refused:
        course(6, checkpoint_file=file)
    assert "the checkpoint of another run: its walkers began elsewhere" in str(refused.value)
    other = normal(CENTRE, 1.1 * COVARIANCE)
    with pytest.raises(UsageError):
        run_ensembles(target(other, SIZE), around(other, CENTRE, COVARIANCE), Settings(seed=5), file)


@pytest.mark.parametrize("damage", ["cut", "noise", "empty"])
def test_a_damaged_checkpoint_is_refused(tmp_path: Path, damage: str) -> None:
    file = tmp_path / "chains.npz"
    stopped(20, file)
    content = file.read_bytes()
    file.write_bytes({"cut": content[: len(content) // 2], "noise": b"no file of ours", "empty": b""}[damage])
    with pytest.raises(UsageError, match="no checkpoint"):
        course(5, checkpoint_file=file)


def test_a_checkpoint_holds_no_objects(tmp_path: Path) -> None:
    file = tmp_path / "chains.npz"
    course(5, checkpoint_file=file)
    with np.load(file, allow_pickle=False) as content:
        assert all(content[name].dtype != object for name in content.files)
    assert [path.name for path in tmp_path.iterdir()] == ["chains.npz"]


VICTIM = """
import sys, time
import numpy as np
from pathlib import Path
from fibrefit.sampling.chains import run_ensembles
from fibrefit.sampling.settings import Settings
from tests.sampling.targets import around, normal, target
def slowly(x):
    time.sleep(2e-3)
    return density(x)
density = normal(np.zeros(3), np.eye(3))
settings = Settings(seed=1, max_steps=int(sys.argv[3]), ess=1e9, checkpoint_seconds=0.05)
near = around(density, np.zeros(3), np.eye(3))
done = run_ensembles(target(slowly, 3), near, settings, Path(sys.argv[1]))
np.save(sys.argv[2], done.points)
"""


def kept(file: Path) -> int:
    """Steps in a checkpoint."""
    if not file.exists():
        return 0
    with np.load(file, allow_pickle=False) as content:
        return len(content["0.points"])


@pytest.mark.slow
@pytest.mark.parametrize("kills", [1, 10])
def test_kill_nine_loses_nothing_but_seconds(tmp_path: Path, kills: int) -> None:
    random = np.random.default_rng(kills)
    file, whole, pieces = tmp_path / "chains.npz", tmp_path / "whole.npy", tmp_path / "pieces.npy"
    command, steps = [sys.executable, "-c", VICTIM], str(140 + 100 * kills)
    subprocess.run([*command, str(tmp_path / "other.npz"), str(whole), steps], check=True, timeout=120)
    lengths = [0]
    for _ in range(kills):
        victim = subprocess.Popen([*command, str(file), str(pieces), steps])
        # Whoever is killed before a checkpoint of its own has nothing to lose.
        while kept(file) == lengths[-1] and victim.poll() is None:
            time.sleep(5e-3)
        time.sleep(random.uniform(0.0, 0.2))
        victim.send_signal(signal.SIGKILL)
        assert victim.wait() == -signal.SIGKILL, "it was still at work"
        lengths.append(kept(file))
    assert lengths == sorted(set(lengths)), "each goes on from where the one before was killed"
    assert not pieces.exists()
    subprocess.run([*command, str(file), str(pieces), steps], check=True, timeout=120)
    np.testing.assert_array_equal(np.load(whole), np.load(pieces))


def test_walkers_never_begin_where_the_density_is_nil() -> None:
    def halved(x: np.ndarray) -> np.ndarray:
        return np.where(x[:, 0] > CENTRE[0], DENSITY(x), -np.inf)

    found = run_ensembles(target(halved, SIZE), around(DENSITY, CENTRE, COVARIANCE), Settings(seed=0, max_steps=60))
    assert np.isfinite(found.log_density).all()
    assert np.all(found.points[..., 0] > CENTRE[0])


def test_a_density_that_is_nil_everywhere_is_refused() -> None:
    with pytest.raises(UsageError) as refused:
        run_ensembles(target(lambda x: np.full(len(x), -np.inf), 2), around(DENSITY, CENTRE, COVARIANCE), Settings())
    assert "walkers find no possible place around it" in str(refused.value)


def test_every_try_to_place_a_walker_is_looked_at() -> None:
    most = 40
    tries: list[int] = []

    def at_last(x: np.ndarray) -> np.ndarray:
        tries.append(len(x))
        return np.full(len(x), 0.0 if len(tries) == most else -np.inf)

    near, random = around(DENSITY, CENTRE, COVARIANCE), np.random.RandomState(0)
    points, found = near.cloud(at_last, 6, random)
    assert np.isfinite(points).all()
    assert np.isfinite(found).all()
    assert tries == [6] * most
    tries[:] = [6] * most
    with pytest.raises(UsageError, match="6 of 6 walkers"):
        near.cloud(at_last, 6, random)
    assert tries == [6] * 2 * most


def test_a_budget_is_kept_and_told() -> None:
    said: list[SamplerProgress] = []
    found = course(0, settings={"max_steps": 40, "ess": 1e9}, progress=said.append)
    assert found.points.shape[1] == 40
    assert not found.converged
    assert all(one.steps <= 40 for one in said)
    late = course(0, settings={"max_seconds": 0.0})
    assert late.points.shape[1] < 10


def test_looks_come_at_steps_that_time_does_not_change() -> None:
    looks = [next_look(0)]
    while len(looks) < 5:
        looks.append(next_look(looks[-1]))
    assert looks == [60, 75, 94, 118, 148]
    assert next_look(61) == 75


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"ensembles": 3}, "ensembles: 3; expected 4 or more."),
        ({"r_hat": 1.0}, "r_hat: 1.0; expected a number above 1, such as 1.01."),
        ({"ess": 0.0}, "ess: 0.0; expected a positive number, such as 400."),
        ({"ess": math.nan}, "ess: nan; expected a positive number, such as 400."),
        ({"r_hat": math.nan}, "r_hat: nan; expected a number above 1, such as 1.01."),
        ({"max_seconds": math.nan}, "max_seconds: nan; expected seconds, 0 or more."),
        ({"walkers": 10**8}, "walkers: 100000000; expected 10000 walkers at most, of all ensembles together."),
        ({"walkers": -4}, "walkers: -4; expected an even number, 2 or more."),
        ({"max_steps": 0}, "max_steps: 0; expected 1 to 781250: draws are kept in memory."),
        ({"max_steps": 10**12}, "max_steps: 1000000000000; expected 1 to 781250: draws are kept in memory."),
        ({"max_steps": 10**5, "walkers": 1000}, "max_steps: 100000; expected 1 to 25000: draws are kept in memory."),
        ({"r_hat_walkers": 1.0}, "r_hat_walkers: 1.0; expected a number above 1, such as 1.15."),
        ({"r_hat_walkers": math.inf}, "r_hat_walkers: inf; expected a number above 1, such as 1.15."),
        ({"threads": 0}, "threads: 0; expected 1 or more."),
        ({"seed": -1}, "seed: -1; expected 0 to 9223372036854775807."),
        ({"interval": 1.0}, "interval: 1.0; expected a probability between 0 and 1."),
    ],
)
def test_settings_that_cannot_work_are_refused(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(UsageError) as refused:
        Settings(**wrong)
    assert str(refused.value) == message


@pytest.mark.parametrize("walkers", [10, 13])
def test_too_few_or_odd_walkers_are_refused(walkers: int) -> None:
    with pytest.raises(UsageError, match=f"walkers: {walkers}; expected an even number from 12 on"):
        Settings(walkers=walkers).walkers_for(5)


def test_walkers_by_default() -> None:
    assert [Settings().walkers_for(n) for n in (1, 9, 15, 40)] == [32, 32, 46, 120]


def test_a_checkpoint_survives_a_failing_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "chains.npz"
    stopped(20, file)
    before = file.read_bytes()

    def fails(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez", fails)
    with pytest.raises(OSError, match="disk full"):
        course(5, settings=LONG, checkpoint_file=file)
    assert file.read_bytes() == before


def chain(correlation: float, seed: int, shape: tuple[int, int, int] = (4, 400, 32)) -> np.ndarray:
    """First-order autoregressions, one a walker."""
    random = np.random.default_rng(seed)
    values = np.empty((shape[0], shape[1], shape[2], 1))
    values[:, 0] = random.standard_normal((shape[0], shape[2], 1))
    for t in range(1, shape[1]):
        fresh = random.standard_normal((shape[0], shape[2], 1))
        values[:, t] = correlation * values[:, t - 1] + np.sqrt(1.0 - correlation**2) * fresh
    return values


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_draws_are_worth_what_theory_says(correlation: float) -> None:
    expected = 4 * 400 * 32 * (1.0 - correlation) / (1.0 + correlation)
    found = mixing(chain(correlation, 0))
    # The autocorrelation time itself is known from 1600 means of steps only.
    assert found.ess_bulk[0] == pytest.approx(expected, rel=0.35)
    assert found.r_hat[0] < 1.01
    assert found.r_hat_walkers[0] < 1.1


def test_walkers_that_move_together_are_not_counted_apart() -> None:
    """Every walker the same: the draws are worth one walker's, however many there are."""
    together = np.repeat(chain(0.5, 1, (4, 400, 1)), 32, axis=2)
    assert mixing(together).ess_bulk[0] == pytest.approx(4 * 400 / 3.0, rel=0.35)


def test_an_ensemble_that_sits_elsewhere_is_seen() -> None:
    found = chain(0.5, 2)
    found[3] += 0.5
    assert mixing(found).r_hat[0] > 1.01
    assert mixing(chain(0.5, 2)).r_hat[0] < 1.01


def test_walkers_frozen_in_two_places_are_seen_though_ensembles_agree() -> None:
    found = chain(0.0, 3)
    found[:, :, ::2] += 20.0
    diagnostics = mixing(found)
    assert diagnostics.r_hat[0] < 1.01
    assert diagnostics.r_hat_walkers[0] > 1.3


def test_a_chain_that_never_moves_has_no_worth() -> None:
    still = np.repeat(chain(0.0, 4)[:, :1], 100, axis=1)
    diagnostics = mixing(still)
    assert diagnostics.ess_bulk[0] < 128
    assert diagnostics.r_hat_walkers[0] > 1e3
