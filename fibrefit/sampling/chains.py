"""Chains: several independent ensembles of walkers (emcee), run until they agree, and their checkpoints on disk."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from emcee import EnsembleSampler, State
from emcee.moves import DEMove, MHMove, StretchMove

from fibrefit.core.errors import UsageError
from fibrefit.sampling.density.prior import Prior
from fibrefit.sampling.mode import Approximation
from fibrefit.sampling.settings import Settings

WARM_UP = 1.0 / 3.0
"""Share of the steps that is discarded as warm-up: the way from the start to the posterior."""
FORM = 1
"""Version of a checkpoint's layout."""


@dataclass(frozen=True)
class Target:
    """A log density over coordinates without limits.

    Parameters
    ----------
    names, units : tuple of str
        Of the values the coordinates stand for.
    log_density : callable ``(n_point, n) -> (n_point,)``
        Unscaled; minus infinity where a point is impossible. The same points give the same bits.
    values : callable ``(n_point, n) -> (n_point, n)``
        Values in SI units of points, coordinate by coordinate.
    priors : tuple of Prior
        Of the values; empty where there are none.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    log_density: Callable[[np.ndarray], np.ndarray]
    values: Callable[[np.ndarray], np.ndarray]
    priors: tuple[Prior, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.names)


@dataclass(frozen=True)
class Mixing:
    """Diagnostics of each coordinate, ``(n,)``.

    Parameters
    ----------
    r_hat : (n,)
        Rank-normalised split R-hat between ensembles.
    r_hat_walkers : (n,)
        The same between all walkers: large where walkers sit in places they do not leave.
    ess_bulk, ess_tail : (n,)
        Effective number of draws for the middle and for the 5 % tails.

    Source
    ------
    Vehtari, Gelman, Simpson, Carpenter and Buerkner, Bayesian Analysis 16 (2021).
    """

    r_hat: np.ndarray
    r_hat_walkers: np.ndarray
    ess_bulk: np.ndarray
    ess_tail: np.ndarray


def mixing(chain: np.ndarray) -> Mixing:
    """Diagnostics of a chain of several ensembles.

    Walkers of one ensemble move with regard to each other, so they are no independent chains. What is independent are
    the ensembles, and how well a mean is known shows in how the ensembles' means move from step to step.

    Parameters
    ----------
    chain : (n_ensemble, n_step, n_walker, n)
    """
    from scipy.special import ndtri
    from scipy.stats import rankdata

    ensembles, steps, walkers, size = chain.shape
    columns = [chain[..., i] for i in range(size)]
    # Normal scores of the ranks, by Blom's formula.
    scores = [ndtri((rankdata(one).reshape(one.shape) - 0.375) / (one.size + 0.25)) for one in columns]
    of_ensembles = np.stack([z.reshape(ensembles, steps * walkers) for z in scores])
    of_walkers = np.stack([np.swapaxes(z, 1, 2).reshape(ensembles * walkers, steps) for z in scores])
    tails = [
        [effective_draws((one <= np.quantile(one, share)).astype(float)) for share in (0.05, 0.95)] for one in columns
    ]
    return Mixing(
        r_hat=_r_hat(of_ensembles),
        r_hat_walkers=_r_hat(of_walkers),
        ess_bulk=np.array([effective_draws(z) for z in scores]),
        ess_tail=np.array([min(ends) for ends in tails]),
    )


def _r_hat(columns: np.ndarray) -> np.ndarray:
    """R-hat of columns ``(n, n_chain, n_draw)``; infinite where a chain has not moved at all."""
    from arviz_stats.base import array_stats

    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.array([array_stats.rhat(column, chain_axis=0, draw_axis=1) for column in columns], dtype=float)
    return np.where(np.isfinite(found), found, np.inf)


def effective_draws(values: np.ndarray) -> float:
    """Effective number of draws of `values` ``(n_ensemble, n_step, n_walker)``, from the means of the ensembles."""
    from arviz_stats.base import array_stats

    means = values.mean(axis=2)
    spread = means.var(ddof=1)
    if not spread > 0.0 or means.shape[1] < 4:
        return 0.0
    steps = float(array_stats.ess(means, chain_axis=0, draw_axis=1, method="mean"))
    # The variance of the grand mean is that of one step's mean over the effective number of steps.
    return float(np.nan_to_num(steps * values.var(ddof=1) / spread))


@dataclass(frozen=True)
class SamplerProgress:
    """How far a run has come.

    Parameters
    ----------
    seconds, seconds_left : float
        The latter is an estimate, NaN before the first look at the chains.
    acceptance : float
        Share of moves accepted.
    r_hat, ess : float
        The worst of all coordinates at the last look; NaN before it.
    """

    steps: int
    max_steps: int
    seconds: float
    seconds_left: float
    acceptance: float
    r_hat: float = np.nan
    ess: float = np.nan


@dataclass(frozen=True)
class ChainHistory:
    """What a run ended with.

    Parameters
    ----------
    points : (n_ensemble, n_step, n_walker, n)
        All steps, warm-up included.
    log_density : (n_ensemble, n_step, n_walker)
    warm_up : int
        Steps to leave out.
    acceptance : (n_ensemble, n_walker)
        Share of moves accepted after the warm-up.
    mixing : Mixing
        After the warm-up.
    seconds : float
        Of this run; one that was resumed does not know the earlier ones'.
    """

    points: np.ndarray
    log_density: np.ndarray
    warm_up: int
    acceptance: np.ndarray
    mixing: Mixing
    converged: bool
    seconds: float

    @property
    def kept(self) -> np.ndarray:
        """Points after the warm-up, ``(n_ensemble, n_step, n_walker, n)``."""
        return self.points[:, self.warm_up :]

    @property
    def kept_log_density(self) -> np.ndarray:
        """Log densities after the warm-up, ``(n_ensemble, n_step, n_walker)``."""
        return self.log_density[:, self.warm_up :]


@dataclass
class Chain:
    """The course of one ensemble so far, all that a run needs to go on bit for bit.

    Parameters
    ----------
    start : (n_walker, n)
        Where the walkers began.
    start_log_density : (n_walker,)
    random : tuple
        State of the random generator after the last step, as NumPy's legacy generator gives it.
    points : sequence of (n_walker, n)
        Of each step.
    log_density : sequence of (n_walker,)
    """

    start: np.ndarray
    start_log_density: np.ndarray
    random: tuple[Any, ...]
    points: Sequence[np.ndarray] = ()
    log_density: Sequence[np.ndarray] = ()


def save_checkpoint(path: Path, chains: list[Chain]) -> None:
    """Write a checkpoint; an older one stays until the new one is complete on disk."""
    content: dict[str, np.ndarray] = {"form": np.array(FORM), "ensembles": np.array(len(chains))}
    for i, chain in enumerate(chains):
        name, keys, position, has_gauss, gauss = chain.random
        content |= {
            f"{i}.start": chain.start,
            f"{i}.start_log_density": chain.start_log_density,
            f"{i}.points": np.array(chain.points).reshape(-1, *chain.start.shape),
            f"{i}.log_density": np.array(chain.log_density).reshape(-1, len(chain.start)),
            f"{i}.random_name": np.array(name),
            f"{i}.random_keys": np.asarray(keys, dtype=np.uint32),
            f"{i}.random_place": np.array([position, has_gauss], dtype=np.int64),
            f"{i}.random_gauss": np.array(gauss, dtype=float),
        }
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with temporary.open("wb") as file:
            np.savez(file, **content)  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def load_checkpoint(path: Path, starts: list[Chain]) -> list[Chain]:
    """Chains of a checkpoint, if it belongs to the run that begins as `starts` do.

    Raises
    ------
    UsageError
        If it cannot be read, or its walkers began elsewhere: another study, other data, settings or versions.
    """
    chains = []
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            if int(file["form"]) != FORM:
                raise ValueError(f"form {int(file['form'])}")
            for i in range(int(file["ensembles"])):
                position, has_gauss = (int(part) for part in file[f"{i}.random_place"])
                state = (str(file[f"{i}.random_name"]), file[f"{i}.random_keys"], position, has_gauss)
                random = (*state, float(file[f"{i}.random_gauss"]))
                start, its_density = file[f"{i}.start"], file[f"{i}.start_log_density"]
                chains.append(Chain(start, its_density, random, file[f"{i}.points"], file[f"{i}.log_density"]))
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        raise UsageError(
            str(path), f"no checkpoint: {error}", "one of this program", "Start anew, with --force."
        ) from None
    same = len(chains) == len(starts) and all(
        np.array_equal(a.start, b.start) and np.array_equal(a.start_log_density, b.start_log_density)
        for a, b in zip(chains, starts, strict=True)
    )
    if not same:
        raise UsageError(
            str(path),
            "the checkpoint of another run: its walkers began elsewhere",
            "the same study, data, seed, settings and versions",
            "Start anew, with --force, or go back to what the run was started with.",
        )
    return chains


class _Ensemble:
    """One sampler with the course it has taken so far, from its start on with random numbers of its own."""

    def __init__(self, target: Target, approximation: Approximation, settings: Settings, number: int) -> None:
        seeds = np.random.SeedSequence(settings.seed).spawn(settings.ensembles)[number].generate_state(624)
        random = np.random.RandomState(np.random.MT19937())
        random.set_state(("MT19937", seeds.astype(np.uint32), 624, 0, 0.0))
        start, density = approximation.cloud(target.log_density, settings.walkers_for(target.size), random)
        # Fresh draws from the approximation while it is good, moves that need none of it where it is not.
        moves = [(MHMove(approximation.propose), 0.4), (DEMove(), 0.3), (StretchMove(), 0.2), (DEMove(gamma0=1.0), 0.1)]
        self.sampler = EnsembleSampler(len(start), target.size, target.log_density, moves=moves, vectorize=True)
        self.sampler.random_state = random.get_state()
        self.resume(Chain(start, density, self.sampler.random_state))

    def resume(self, chain: Chain) -> None:
        self.start, self.start_log_density = chain.start, chain.start_log_density
        self.points, self.log_density = list(chain.points), list(chain.log_density)
        last = (chain.points[-1], chain.log_density[-1]) if self.points else (chain.start, chain.start_log_density)
        self.sampler.random_state = chain.random
        self.state = State(last[0].copy(), log_prob=last[1].copy(), random_state=chain.random)

    def advance(self, steps: int) -> None:
        for state in self.sampler.sample(self.state, iterations=steps, store=False, skip_initial_state_check=True):
            self.points.append(np.array(state.coords))
            self.log_density.append(np.array(state.log_prob))
            self.state = state

    @property
    def chain(self) -> Chain:
        return Chain(self.start, self.start_log_density, self.sampler.random_state, self.points, self.log_density)


class _Keeper:
    """Writes checkpoints now and then, and never for more than a small share of the time."""

    def __init__(self, file: Path | None, seconds: float) -> None:
        self._file, self._seconds, self._last, self._took = file, seconds, time.perf_counter(), 0.0

    def save_now_and_then(self, ensembles: list[_Ensemble]) -> None:
        if time.perf_counter() - self._last > max(self._seconds, 20.0 * self._took):
            self.save(ensembles)

    def save(self, ensembles: list[_Ensemble]) -> None:
        if self._file is None or len({len(ensemble.log_density) for ensemble in ensembles}) > 1:
            return  # one of them has failed inside a block: the last checkpoint stays
        began = time.perf_counter()
        save_checkpoint(self._file, [ensemble.chain for ensemble in ensembles])
        self._last = time.perf_counter()
        self._took = self._last - began


def run_ensembles(
    target: Target,
    approximation: Approximation,
    settings: Settings,
    checkpoint_file: Path | None = None,
    progress: Callable[[SamplerProgress], None] | None = None,
) -> ChainHistory:
    """Sample until the ensembles agree and enough draws are gathered, or the budget is spent.

    Parameters
    ----------
    approximation : Approximation
        Of the mode the walkers begin in.
    checkpoint_file : pathlib.Path or None
        Holds the chains while they grow, rewritten every few seconds and when the run is interrupted. Where there is
        one, they go on from there.
    progress : callable, optional
        Called about every second.

    Returns
    -------
    ChainHistory
        The same bits for the same arguments, in one go or resumed, unless ``settings.max_seconds`` ends it.

    Raises
    ------
    UsageError
        If the checkpoint belongs to another run.
    """
    began = time.perf_counter()
    ensembles = [_Ensemble(target, approximation, settings, i) for i in range(settings.ensembles)]
    if checkpoint_file is not None and checkpoint_file.exists():
        known = load_checkpoint(checkpoint_file, [e.chain for e in ensembles])
        for ensemble, chain in zip(ensembles, known, strict=True):
            ensemble.resume(chain)
    keeper = _Keeper(checkpoint_file, settings.checkpoint_seconds)
    with ThreadPoolExecutor(settings.threads) as pool:
        try:
            found = _until_converged(ensembles, settings, pool, keeper, progress, began)
        except BaseException:
            # Every ensemble finishes its block, also where threads are fewer; what all have done by then is kept.
            pool.shutdown(wait=True)
            keeper.save(ensembles)
            raise
    keeper.save(ensembles)
    points, log_density = (np.stack([getattr(e, name) for e in ensembles]) for name in ("points", "log_density"))
    warm_up = int(WARM_UP * points.shape[1])
    acceptance = _acceptance(points[:, warm_up:])
    seconds = time.perf_counter() - began
    return ChainHistory(points, log_density, warm_up, acceptance, *found, seconds)


def next_look(steps: int) -> int:
    """Number of steps at which chains of `steps` steps are next looked at."""
    look = 60
    while look <= steps:
        # Each time a quarter longer: the looks cost little and cannot be chosen by luck.
        look = int(np.ceil(look * 1.25))
    return look


def _until_converged(
    ensembles: list[_Ensemble],
    settings: Settings,
    pool: ThreadPoolExecutor,
    keeper: _Keeper,
    progress: Callable[[SamplerProgress], None] | None,
    began: float,
) -> tuple[Mixing, bool]:
    block, last = 1, None
    while True:
        steps = len(ensembles[0].points)
        late = settings.max_seconds is not None and time.perf_counter() - began > settings.max_seconds
        over = steps >= settings.max_steps or (late and steps > 0)
        if over or next_look(steps - 1) == steps:
            last = mixing(np.stack([e.points[int(WARM_UP * steps) :] for e in ensembles]))
            ess = np.minimum(last.ess_bulk, last.ess_tail)
            agree = last.r_hat.max() < settings.r_hat and last.r_hat_walkers.max() < settings.r_hat_walkers
            converged = bool(agree and ess.min() > settings.ess)
            if converged or over:
                return last, converged
        keeper.save_now_and_then(ensembles)
        if progress and steps:
            recent = np.stack([e.points[-20:] for e in ensembles])
            acceptance = float(_acceptance(recent).mean()) if steps > 1 else np.nan
            seconds, remaining, r_hat, ess = time.perf_counter() - began, np.nan, np.nan, np.nan
            if last is not None:
                r_hat, ess = float(last.r_hat.max()), float(np.minimum(last.ess_bulk, last.ess_tail).min())
                # Draws grow with the steps, and so does what R-hat still lacks.
                factor = max(settings.ess / max(ess, 1.0), (r_hat - 1.0) / (settings.r_hat - 1.0), 1.0)
                remaining = max(min(factor * steps, settings.max_steps) - steps, 0.0)
            seconds_left = seconds / steps * remaining
            progress(SamplerProgress(steps, settings.max_steps, seconds, seconds_left, acceptance, r_hat, ess))
        at_once = max(1, min(block, next_look(steps) - steps, settings.max_steps - steps))
        since = time.perf_counter()
        # Not by `map`, which takes back what has not begun where it is interrupted.
        for one in [pool.submit(ensemble.advance, at_once) for ensemble in ensembles]:
            one.result()
        took = time.perf_counter() - since
        # As many steps as take a second; the course does not depend on how it is cut into blocks.
        block = int(np.clip(at_once / max(took, 1e-3), 1, 4 * block))


def _acceptance(points: np.ndarray) -> np.ndarray:
    moves = points.shape[1] - 1
    return np.any(np.diff(points, axis=1) != 0.0, axis=-1).sum(axis=1) / max(moves, 1)
