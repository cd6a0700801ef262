"""Several independent ensembles of walkers, run until they agree (convergence by R-hat)."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from emcee import EnsembleSampler, State
from emcee.moves import DEMove, MHMove, Move, StretchMove

from fibrefit.sampling.approximation import Approximation
from fibrefit.sampling.chains import checkpoint
from fibrefit.sampling.chains.checkpoint import Chain
from fibrefit.sampling.diagnostics import Mixing, mixing
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.target import Target

FIRST_CHECK = 60
"""Steps after which the chains are first looked at."""
GROWTH = 1.25
"""Each look comes when the chains are longer by this factor: the looks cost little and cannot be chosen by luck."""
WARM_UP = 1.0 / 3.0
"""Share of the steps that is discarded as warm-up: the way from the start to the posterior."""
BLOCK_SECONDS = 1.0
"""Time between two words of progress."""


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
class _Ensemble:
    """One sampler with the course it has taken so far."""

    sampler: EnsembleSampler
    state: State
    start: np.ndarray
    start_log_density: np.ndarray
    points: list[np.ndarray] = field(default_factory=list)
    log_density: list[np.ndarray] = field(default_factory=list)

    def advance(self, steps: int) -> None:
        for state in self.sampler.sample(self.state, iterations=steps, store=False, skip_initial_state_check=True):
            self.points.append(np.array(state.coords))
            self.log_density.append(np.array(state.log_prob))
            self.state = state

    @property
    def chain(self) -> Chain:
        points = np.array(self.points).reshape(-1, *self.start.shape)
        log_density = np.array(self.log_density).reshape(-1, len(self.start))
        return Chain(self.start, self.start_log_density, points, log_density, self.sampler.random_state)


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
    ensembles = [_begin(target, approximation, settings, i) for i in range(settings.ensembles)]
    if checkpoint_file is not None and checkpoint_file.exists():
        _take_up(ensembles, checkpoint.load(checkpoint_file, [e.chain for e in ensembles]))
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
    look = FIRST_CHECK
    while look <= steps:
        look = int(np.ceil(look * GROWTH))
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
            converged = _enough(last, settings)
            if converged or over:
                return last, converged
        keeper.save_now_and_then(ensembles)
        if progress and steps:
            progress(_progress(ensembles, settings, last, time.perf_counter() - began))
        at_once = max(1, min(block, next_look(steps) - steps, settings.max_steps - steps))
        since = time.perf_counter()
        # Not by `map`, which takes back what has not begun where it is interrupted.
        for one in [pool.submit(ensemble.advance, at_once) for ensemble in ensembles]:
            one.result()
        took = time.perf_counter() - since
        # The course does not depend on how it is cut into blocks.
        block = int(np.clip(at_once * BLOCK_SECONDS / max(took, 1e-3), 1, 4 * block))


def _enough(found: Mixing, settings: Settings) -> bool:
    ess = np.minimum(found.ess_bulk, found.ess_tail)
    agree = found.r_hat.max() < settings.r_hat and found.r_hat_walkers.max() < settings.r_hat_walkers
    return bool(agree and ess.min() > settings.ess)


def _begin(target: Target, approximation: Approximation, settings: Settings, number: int) -> _Ensemble:
    seeds = np.random.SeedSequence(settings.seed).spawn(settings.ensembles)[number].generate_state(624)
    random = np.random.RandomState(np.random.MT19937())
    random.set_state(("MT19937", seeds.astype(np.uint32), 624, 0, 0.0))
    start, log_density = approximation.cloud(target.log_density, settings.walkers_for(target.size), random)
    sampler = EnsembleSampler(len(start), target.size, target.log_density, moves=_moves(approximation), vectorize=True)
    sampler.random_state = random.get_state()
    state = State(start, log_prob=log_density, random_state=random.get_state())
    return _Ensemble(sampler, state, start, log_density)


def _moves(approximation: Approximation) -> list[tuple[Move, float]]:
    """Fresh draws from the approximation while it is good, moves that need none of it where it is not."""
    return [(MHMove(approximation.propose), 0.4), (DEMove(), 0.3), (StretchMove(), 0.2), (DEMove(gamma0=1.0), 0.1)]


def _take_up(ensembles: list[_Ensemble], chains: list[Chain]) -> None:
    for ensemble, chain in zip(ensembles, chains, strict=True):
        ensemble.points, ensemble.log_density = list(chain.points), list(chain.log_density)
        points, log_density = chain.last
        ensemble.sampler.random_state = chain.random
        ensemble.state = State(points.copy(), log_prob=log_density.copy(), random_state=chain.random)


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
        checkpoint.save(self._file, [ensemble.chain for ensemble in ensembles])
        self._last = time.perf_counter()
        self._took = self._last - began


def _acceptance(points: np.ndarray) -> np.ndarray:
    moves = points.shape[1] - 1
    return np.any(np.diff(points, axis=1) != 0.0, axis=-1).sum(axis=1) / max(moves, 1)


def _progress(ensembles: list[_Ensemble], settings: Settings, last: Mixing | None, seconds: float) -> SamplerProgress:
    steps = len(ensembles[0].points)
    recent = np.stack([e.points[-20:] for e in ensembles])
    acceptance = float(_acceptance(recent).mean()) if steps > 1 else np.nan
    if last is None:
        return SamplerProgress(steps, settings.max_steps, seconds, np.nan, acceptance)
    ess, r_hat = float(np.minimum(last.ess_bulk, last.ess_tail).min()), float(last.r_hat.max())
    # Draws grow with the steps, and so does what R-hat still lacks.
    factor = max(settings.ess / max(ess, 1.0), (r_hat - 1.0) / (settings.r_hat - 1.0), 1.0)
    remaining = min(factor * steps, settings.max_steps) - steps
    return SamplerProgress(
        steps, settings.max_steps, seconds, seconds / steps * max(remaining, 0.0), acceptance, r_hat, ess
    )
