"""What is believed of a parameter before the data speak: a distribution, its density, and sensible ones by default."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtr, ndtri

from fibrefit.core.declarations import Parameter
from fibrefit.core.errors import StudyError
from fibrefit.problem import Layout, Range
from fibrefit.sampling.thresholds import WIDE_PRIOR
from fibrefit.simulation.model import Model

if TYPE_CHECKING:  # its module needs pydantic, which this one does not
    from fibrefit.study.parameters import PriorSetting


@dataclass(frozen=True)
class Prior:
    """A normal or an even density between limits, of the value or of its logarithm.

    Parameters
    ----------
    log : bool
        Whether the density is that of the logarithm.
    centre : float
        Mean, or median where `log`; in SI units.
    spread : float
        Standard deviation, of the logarithm where `log`; infinite for an even density.
    lower, upper : float
        Support, in SI units.
    source : str
        Who chose it: ``"study"`` or ``"default"``.
    """

    log: bool
    centre: float
    spread: float
    lower: float = -math.inf
    upper: float = math.inf
    source: str = "study"

    @classmethod
    def of(cls, stated: PriorSetting) -> Prior:
        """From what a study states."""
        if stated.kind in ("uniform", "log_uniform"):
            return cls(stated.kind == "log_uniform", 1.0, math.inf, stated.lower, stated.upper)
        return cls(stated.kind == "log_normal", stated.centre, stated.spread, stated.lower, stated.upper)

    def within(self, lower: float, upper: float, where: str) -> Prior:
        """The part between the limits of a parameter.

        Raises
        ------
        StudyError
            If nothing is left, or next to nothing.
        """
        cut = replace(self, lower=max(self.lower, lower), upper=min(self.upper, upper))
        if not cut.lower < cut.upper:
            raise StudyError(
                where,
                f"the prior allows {self.lower:.4g} to {self.upper:.4g} only",
                f"some overlap with the parameter's limits {lower:.4g} to {upper:.4g}",
                "Widen the prior or the bounds.",
            )
        # Beyond eight standard deviations there are no numbers for what is left.
        if not (cut.even or cut._share[1] - cut._share[0] > np.finfo(float).eps):
            raise StudyError(
                where,
                f"the prior about {self.centre:.4g} has nothing between {cut.lower:.4g} and {cut.upper:.4g}",
                "limits within eight of its standard deviations",
                "Widen the prior or the bounds.",
            )
        return cut

    @property
    def even(self) -> bool:
        """Whether the density is the same everywhere in the support."""
        return math.isinf(self.spread)

    @property
    def proper(self) -> bool:
        """Whether it is a distribution at all: whether its mass is finite."""
        return not self.even or all(math.isfinite(limit) for limit in self._ends)

    @property
    def log_mass(self) -> float:
        """Logarithm of the integral of the unscaled density over the support; zero where that is infinite."""
        if self.even:
            low, high = self._ends
            return math.log(high - low) if self.proper else 0.0
        return math.log(self.spread * math.sqrt(2.0 * math.pi) * (self._share[1] - self._share[0]))

    def cdf(self, values: np.ndarray) -> np.ndarray:
        """Share of the prior below `values` (SI units), 0 to 1; NaN where the prior is not proper."""
        if not self.proper:
            return np.full(np.shape(values), np.nan)
        line = self._line(np.clip(values, self.lower, self.upper))
        if self.even:
            low, high = self._ends
            return (line - low) / (high - low)
        low, high = self._share
        return (ndtr((line - self._line(self.centre)) / self.spread) - low) / (high - low)

    def quantile(self, share: np.ndarray) -> np.ndarray:
        """Values (SI units) below which a `share` of the prior lies; the inverse of `cdf`."""
        share = np.asarray(share, dtype=float)
        if not self.proper:
            return np.full(share.shape, np.nan)
        if self.even:
            low, high = self._ends
            line = low + share * (high - low)
        else:
            low, high = self._share
            line = self._line(self.centre) + self.spread * ndtri(low + share * (high - low))
        return np.clip(np.exp(line) if self.log else line, self.lower, self.upper)

    def _line(self, value: np.ndarray | float) -> np.ndarray:
        with np.errstate(divide="ignore"):
            return np.log(value) if self.log else np.asarray(value, dtype=float)

    @property
    def _ends(self) -> tuple[float, float]:
        lower = max(self.lower, 0.0) if self.log else self.lower
        return float(self._line(lower)), float(self._line(self.upper))

    @property
    def _share(self) -> tuple[float, float]:
        """Shares of the whole normal density below the lower and the upper limit."""
        low, high = ((end - float(self._line(self.centre))) / self.spread for end in self._ends)
        return float(ndtr(low)), float(ndtr(high))


class Density(eqx.Module):
    """Joint density of independent priors, as arrays: problems that differ in the numbers share a compiled program.

    Parameters
    ----------
    log : (n,) bool
    centre, spread, lower, upper, log_mass : (n,)
        See `Prior`; `centre` on the scale of the density.
    """

    log: jax.Array
    centre: jax.Array
    spread: jax.Array
    lower: jax.Array
    upper: jax.Array
    log_mass: jax.Array

    @classmethod
    def of(cls, priors: Sequence[Prior]) -> Density:
        """Density of one value for each prior."""
        centre = [float(prior._line(prior.centre)) for prior in priors]
        columns = [[getattr(p, name) for p in priors] for name in ("spread", "lower", "upper", "log_mass")]
        arrays = (jnp.array(column, dtype=float) for column in (centre, *columns))
        return cls(jnp.array([prior.log for prior in priors], dtype=bool), *arrays)

    def log_density(self, values: jax.Array) -> jax.Array:
        """Logarithm of the density at `values` ``(n,)`` in SI units; minus infinity outside the support."""
        inside = (values >= self.lower) & (values <= self.upper) & (~self.log | (values > 0.0))
        logs = jnp.log(jnp.where(self.log & inside, values, 1.0))
        distance = (jnp.where(self.log, logs, values) - self.centre) / self.spread
        each = -0.5 * distance**2 - logs - self.log_mass
        return jnp.sum(jnp.where(inside, each, -jnp.inf))


@dataclass(frozen=True)
class Priors:
    """One prior for each free value of a layout, in its order."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    each: tuple[Prior, ...]

    @property
    def density(self) -> Density:
        """Their joint density."""
        return Density.of(self.each)

    def draw(self, random: np.random.Generator, count: int) -> np.ndarray:
        """Draws ``(count, n_free)`` in SI units; NaN where a prior is not proper."""
        shares = random.random((count, len(self.each)))
        return np.stack([prior.quantile(shares[:, i]) for i, prior in enumerate(self.each)], axis=1)

    @classmethod
    def of(cls, layout: Layout, model: Model, start: np.ndarray, stated: Mapping[str, PriorSetting | Prior]) -> Priors:
        """The priors of a problem: those stated, defaults for the others.

        Parameters
        ----------
        start : (n_free,) in SI units
            What the data suggest; places in time and space, which have no zero of their own, get a wide prior around
            it.
        stated : mapping of name to Prior, or to what a study states

        Raises
        ------
        StudyError
            If a stated prior and the limits of its parameter have nothing in common.
        """
        declared = {parameter.name: parameter for parameter in model.parameters}
        each = []
        for (slot, _), value in zip(layout.entries, start, strict=True):
            given = stated.get(slot.name)
            if given is not None:
                prior = given if isinstance(given, Prior) else Prior.of(given)
            elif slot.name in declared:
                prior = default_prior(declared[slot.name], slot.range)
            else:
                prior = Prior(False, float(value), WIDE_PRIOR * slot.range.scale, source="default")
            each.append(prior.within(slot.range.lower, slot.range.upper, f"prior of {slot.name}"))
        return cls(layout.free_names, tuple(slot.unit for slot, _ in layout.entries), tuple(each))


def default_prior(declared: Parameter, limits: Range) -> Prior:
    """A prior that excludes nothing sensible and prefers little.

    Returns
    -------
    Prior
        Log-uniform for what spans decades; half-normal for what has a sign; normal for the rest.
    """
    if limits.log and all(limits.bounded):
        return Prior(True, limits.scale, math.inf, limits.lower, limits.upper, "default")
    if limits.log or declared.reciprocal:
        # A positive parameter without limits: a standard deviation of three decades.
        return Prior(True, limits.scale, math.log(1000.0), max(limits.lower, 0.0), limits.upper, "default")
    if limits.upper - limits.lower <= 2.0 * WIDE_PRIOR * limits.scale:
        return Prior(False, 1.0, math.inf, limits.lower, limits.upper, "default")
    centre = min(max(declared.null, limits.lower), limits.upper)
    return Prior(False, centre, WIDE_PRIOR * limits.scale, limits.lower, limits.upper, "default")


def log_slope(layout: Layout, free: jax.Array) -> jax.Array:
    """Logarithm of the volume of values per volume of free coordinates; minus infinity off the branch that is used.

    The map of a value with one limit is even; only its half of positive coordinates counts, or every value would be
    counted twice.

    Parameters
    ----------
    free : (n_free,) free coordinates
    """
    slope = jax.jvp(layout.values, (free,), (jnp.ones_like(free),))[1]
    one_sided = np.array([sum(slot.range.bounded) == 1 for slot, _ in layout.entries], dtype=bool)
    # A limit above is approached downwards: its slope is negative on the branch that is used.
    used = ~one_sided | (free > 0.0)
    return jnp.sum(jnp.where(used, jnp.log(jnp.abs(jnp.where(used, slope, 1.0))), -jnp.inf))
