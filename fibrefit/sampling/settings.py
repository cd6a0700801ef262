"""How a posterior is sampled."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fibrefit.core.errors import UsageError
from fibrefit.core.limits import refuse_seed
from fibrefit.core.threads import THREADS
from fibrefit.sampling.density.kinds import KINDS
from fibrefit.sampling.thresholds import FEWEST_ENSEMBLES

AS_A_FIT = "fit"
"""The noise that a fit takes, from what the model leaves of the records."""
NOISE_KINDS = (AS_A_FIT, "auto", *KINDS)
"""Kinds of noise that can be requested."""
USUAL_WALKERS = 32
"""Of an ensemble, where nobody says how many."""


@dataclass(frozen=True)
class Settings:
    """Settings of the sampler.

    Parameters
    ----------
    seed : int
        Of everything random, zero or more; the same seed gives the same bits.
    ensembles : int
        Independent ensembles; agreement between fewer than four says little.
    walkers : int or None
        Of each ensemble; None: as many as the number of coordinates needs.
    r_hat : float
        R-hat between ensembles below which they have converged.
    r_hat_walkers : float
        R-hat between walkers, which are many and short, below which they mix.
    ess : float
        Effective sample size to gather for each parameter, bulk and tail.
    max_seconds : float or None
        Budget of each mode. One in seconds ends a run at a step that depends on the machine.
    threads : int
        Ensembles advanced at the same time, one or more; makes no difference to the result.
    interval : float
        Probability of the reported intervals.
    """

    seed: int = 0
    ensembles: int = FEWEST_ENSEMBLES
    walkers: int | None = None
    r_hat: float = 1.01
    r_hat_walkers: float = 1.15
    ess: float = 400.0
    max_steps: int = 4000
    max_seconds: float | None = None
    checkpoint_seconds: float = 5.0
    threads: int = THREADS
    interval: float = 0.95

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        self._refuse(self.ensembles < FEWEST_ENSEMBLES, "ensembles", f"{FEWEST_ENSEMBLES} or more")
        # Of all ensembles together: a hundred times what is usual, beyond which they take gigabytes.
        most_walkers = 10_000
        walkers = f"{most_walkers} walkers at most, of all ensembles together"
        self._refuse(self.ensembles > most_walkers, "ensembles", walkers)
        self._refuse(self.walkers is not None and self.walkers * self.ensembles > most_walkers, "walkers", walkers)
        self._refuse(self.walkers is not None and self.walkers < 2, "walkers", "an even number, 2 or more")
        # Written so that a number that is none is refused too: it compares with nothing.
        self._refuse(not 1.0 < self.r_hat < math.inf, "r_hat", "a number above 1, such as 1.01")
        self._refuse(not 1.0 < self.r_hat_walkers < math.inf, "r_hat_walkers", "a number above 1, such as 1.15")
        refuse_seed(self.seed)
        self._refuse(self.threads < 1, "threads", "1 or more")
        self._refuse(not 0.0 < self.ess < math.inf, "ess", "a positive number, such as 400")
        self._refuse(self.max_seconds is not None and not self.max_seconds >= 0.0, "max_seconds", "seconds, 0 or more")
        self._refuse(not self.checkpoint_seconds >= 0.0, "checkpoint_seconds", "seconds, 0 or more")
        # A thousand times the draws that are usual: of three parameters they take 2.4 GB.
        most = 100_000_000 // (self.ensembles * (self.walkers or USUAL_WALKERS))
        self._refuse(not 1 <= self.max_steps <= most, "max_steps", f"1 to {most}: draws are kept in memory")
        self._refuse(not 0.0 < self.interval < 1.0, "interval", "a probability between 0 and 1")

    def walkers_for(self, size: int) -> int:
        """Number of walkers for `size` coordinates; even, and at least twice as many and two.

        Raises
        ------
        UsageError
            If a number that was requested is too small.
        """
        fewest = 2 * size + 2
        if self.walkers is None:
            return max(USUAL_WALKERS, 3 * size + size % 2)
        self._refuse(self.walkers < fewest or self.walkers % 2 == 1, "walkers", f"an even number from {fewest} on")
        return self.walkers

    def batch_for(self, size: int) -> int:
        """Points evaluated at once: an even part of half an ensemble, which is what a move asks for, 32 at most."""
        half = self.walkers_for(size) // 2
        return max(part for part in range(1, 33) if half % part == 0)

    def _refuse(self, wrong: bool, name: str, expected: str) -> None:
        if wrong:
            raise UsageError(name, str(getattr(self, name)), expected)
