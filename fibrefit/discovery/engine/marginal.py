"""Hypotheses weighed by their marginal likelihood: one noise, one prior, one Gauss-Newton for all of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.discovery.engine.candidates import FREQUENCIES, SHAPES, Ground, absent_values, carried
from fibrefit.discovery.engine.supermodel import Frame, Reactions, residual_rows
from fibrefit.effects.law import Effect
from fibrefit.problem.estimate.evidence import MarginalLikelihood, laplace, weigh
from fibrefit.problem.estimate.gauss_newton import PosteriorMode, Unknowns, arrowhead, mode, place_of
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_residuals, whitening_of

BASE_SD, SHAPE_SD, STRENGTH_SD = 1.0, 1.5, 1.0
"""Priors: of the logarithm of a base parameter about the first fit, of the logarithm of a shape about its typical size,
and of a strength in units of its typical size."""
WEAK = 0.02
"""Strength, as a share of the typical one, at which an effect enters a model that is nearly right."""
WRONG_MINIMUM = 8.0
"""Nats below its parent from which a hypothesis, which contains the parent, lies in a minimum of its own."""
DRAWS = 4
"""Of the errors of inputs, so that the noise they take with them when they are fitted is put back."""
CHUNK = 64
VANISHES = 1e-6
"""Base parameter, as a share of its typical size, below which its logarithm says nothing."""
FURTHEST = 12.0
"""Logarithm of the largest factor by which a base parameter may move."""


@dataclass(frozen=True)
class Yardstick:
    """What all hypotheses of a round are measured with.

    Parameters
    ----------
    noise : tuple of Noise
        Of each channel, in SI units.
    whitening : Coloured
    reactions : Reactions or None
        To errors of measured inputs, whitened.
    """

    noise: tuple[Noise, ...]
    whitening: Coloured
    reactions: Reactions | None

    def on(self, frame: Frame) -> Frame:
        """A frame whose residuals are whitened."""
        return replace(frame, whitening=self.whitening, reactions=self.reactions)


def yardstick_of(frame: Frame, noise: Sequence[Noise]) -> Yardstick:
    """Yardstick for noise of known spectra.

    Parameters
    ----------
    frame : Frame
        Any of the search, not whitened.
    noise : sequence of Noise
    """
    whitening = whitening_of(frame.problem, noise)
    reactions = frame.reactions
    if reactions is not None:
        rows = _whitened_rows(whitening, reactions.rows, len(noise))
        products = jnp.einsum("rwn,rvn->rwv", rows, rows).astype(float)
        inverse = jnp.linalg.inv(products + jnp.eye(rows.shape[1]))
        reactions = reactions._replace(rows=rows, inverse=inverse)
    return Yardstick(tuple(noise), whitening, reactions)


def _whitened_rows(whitening: Coloured, rows: jax.Array, channels: int) -> jax.Array:
    parts = []
    for first in range(0, rows.shape[1], CHUNK):
        some = rows[:, first : first + CHUNK].astype(float)
        split = jnp.moveaxis(some.reshape(*some.shape[:2], channels, -1), 1, 0)
        parts.append(jnp.moveaxis(_whitened(whitening, split), 0, 1).reshape(some.shape).astype(jnp.float32))
    return jnp.concatenate(parts, axis=1)


@jax.jit
def _whitened(whitening: Coloured, rows: jax.Array) -> jax.Array:
    return whitening.whiten_rows(rows)


@dataclass(frozen=True)
class Weighed:
    """A hypothesis and how probable it makes the records.

    Parameters
    ----------
    effects : tuple of Effect classes
        Added to the model the search began with, in the order they were found.
    frame : Frame
        One that holds them, not whitened.
    evidence : MarginalLikelihood
    """

    effects: tuple[type[Effect], ...]
    frame: Frame
    evidence: MarginalLikelihood

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)

    @property
    def local(self) -> np.ndarray:
        """Values of each record at the mode, ``(n_record, n_local)`` in SI units."""
        return self.evidence.mode.local

    @property
    def log(self) -> float:
        """Logarithm of the marginal likelihood."""
        return self.evidence.log

    def moved_to(self, log: float) -> Weighed:
        """The same, told with another marginal likelihood: that of a noise in which it was not weighed."""
        return replace(self, evidence=replace(self.evidence, log=log))

    @property
    def shared(self) -> dict[str, float]:
        """Shared values in SI units, by name."""
        unknowns = self.evidence.mode.unknowns
        return dict(zip(unknowns.names, self.evidence.mode.values.tolist(), strict=False))

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors of the shared values in SI units, by name."""
        unknowns, place = self.evidence.mode.unknowns, self.evidence.mode.place
        error = np.sqrt(np.diag(self.evidence.spread)) * np.abs(unknowns.slope(place.z))
        return dict(zip(unknowns.names, error.tolist(), strict=False))


class Heights(NamedTuple):
    """Heights of a curve among the unknowns, and how much neighbours may differ.

    Parameters
    ----------
    names : tuple of str
    size : float
        Unit of the heights, in SI units.
    walk : float
        Standard deviation of the difference of neighbours, in that unit.
    """

    names: tuple[str, ...]
    size: float
    walk: float

    def precision(self) -> np.ndarray:
        """Prior of the heights ``(n, n)``: a random walk whose level is all but free."""
        steps = np.diff(np.eye(len(self.names)), axis=0) / self.walk
        return steps.T @ steps + np.eye(len(self.names)) / (LEVEL_SD**2 * len(self.names))


LEVEL_SD = 10.0


def unknowns_of(
    frame: Frame,
    ground: Ground,
    effects: Iterable[type[Effect]],
    reference: dict[str, float],
    curve: Heights | None = None,
) -> Unknowns:
    """What is unknown when effects are on, and the priors.

    Parameters
    ----------
    frame : Frame
    ground : Ground
    effects : iterable of Effect classes
    reference : mapping of name to float
        Base parameters of the first fit, in SI units.
    curve : Heights, optional
        Of a probe on top of them.
    """
    subset = ground.subset(effects)
    rows = [_line(frame.declared[name], name, reference.get(name), effects) for name in subset.shared]
    if curve is not None:
        subset = replace(subset, shared=subset.shared + curve.names)
        rows += [(False, 0.0, curve.size, 0.0, np.inf, -np.inf, np.inf, False)] * len(curve.names)
    log, middle, scale, mean, sd, lower, upper, one_sided = (
        np.array([row[i] for row in rows], dtype=kind)
        for i, kind in enumerate((bool, float, float, float, float, float, float, bool))
    )
    precision = np.diag(sd**-2.0)
    if curve is not None:
        precision[-len(curve.names) :, -len(curve.names) :] = curve.precision()
    base = np.array([name in ground.scattering for name in subset.shared], dtype=bool)
    index = {name: i for i, name in enumerate(frame.names)}
    layout = frame.problem.layout
    slots = {slot.name: slot for slot in layout.slots}
    free = np.array(
        [[slots[name].held(r) is None for name in subset.each] for r in range(len(layout.records))], dtype=bool
    ).reshape(len(layout.records), len(subset.each))
    return Unknowns(
        names=(*subset.shared, *subset.each),
        shared=np.array([index[name] for name in subset.shared], dtype=int),
        each=np.array([index[name] for name in subset.each], dtype=int),
        free=free,
        scattering=np.flatnonzero(base & log),
        log=log,
        reference=middle,
        scale=scale,
        mean=mean,
        precision=precision,
        lower=lower,
        upper=upper,
        one_sided=one_sided,
        size=np.array([abs(frame.declared[name].typical) for name in subset.each], dtype=float),
    )


def _line(declared: Parameter, name: str, reference: float | None, effects: Iterable[type[Effect]]) -> tuple:
    """Row of `Unknowns`: log, reference, scale, mean, sd, lower, upper, one_sided."""
    strengths = {f"{effect.name}.{each}" for effect in effects for each in effect.strength}
    typical = declared.typical
    if reference is not None:
        if declared.lower >= 0.0 and reference > VANISHES * abs(typical):
            limits = [max(-FURTHEST, _log(declared.lower / reference)), min(FURTHEST, _log(declared.upper / reference))]
            return True, reference, 1.0, 0.0, BASE_SD, *limits, False
        size = max(abs(typical), abs(reference))
        limits = [(declared.lower - reference) / size, (declared.upper - reference) / size]
        return False, reference, size, 0.0, BASE_SD, *limits, False
    spans = declared.log or declared.reciprocal or (declared.unit == "Hz" and declared.lower >= 0.0)
    if spans:
        return True, typical, 1.0, 0.0, SHAPE_SD, _log(declared.lower / typical), _log(declared.upper / typical), False
    null = declared.null if name in strengths else typical
    scale = typical - null if name in strengths else (abs(typical) or 1.0)
    ends = sorted([(declared.lower - null) / scale, (declared.upper - null) / scale])
    return False, null, scale, 0.0, STRENGTH_SD, *ends, name in strengths and 0.0 in ends


def _log(ratio: float) -> float:
    with np.errstate(divide="ignore"):
        return float(np.log(max(ratio, 0.0)))


class Scales:
    """Weighs hypotheses against one yardstick.

    Parameters
    ----------
    ground : Ground
    reference : mapping of name to float
        Base parameters of the first fit, in SI units.
    yardstick : Yardstick
    """

    def __init__(self, ground: Ground, reference: dict[str, float], yardstick: Yardstick) -> None:
        self.ground, self.reference, self.yardstick = ground, reference, yardstick

    def weigh(
        self,
        frame: Frame,
        effects: tuple[type[Effect], ...],
        local: np.ndarray,
        sigma: np.ndarray | None = None,
        eta: np.ndarray | None = None,
    ) -> Weighed:
        """A hypothesis at its mode, from given values.

        Parameters
        ----------
        frame : Frame
        effects : tuple of Effect classes
        local : (n_record, n_local) in SI units
        sigma : (n_scattering,), optional
            Standard deviations between records to begin with.
        eta : (n_record, n_scattering), optional
            Deviations to begin with.
        """
        unknowns = unknowns_of(frame, self.ground, effects, self.reference)
        return Weighed(effects, frame, weigh(unknowns, place_of(unknowns, local, eta), self._gram(frame), sigma))

    def with_curve(
        self, parent: Weighed, frame: Frame, local: np.ndarray, probe: type[Effect], curve: Heights
    ) -> Weighed:
        """A parent with a curve on top of it, from given values."""
        unknowns = unknowns_of(frame, self.ground, parent.effects, self.reference, curve)
        found = parent.evidence.mode
        start = place_of(unknowns, local, found.place.eta)
        return Weighed((*parent.effects, probe), frame, weigh(unknowns, start, self._gram(frame), found.sigma))

    def glance(
        self,
        frame: Frame,
        effects: tuple[type[Effect], ...],
        local: np.ndarray,
        sigma: np.ndarray,
        eta: np.ndarray,
        curve: Heights | None = None,
    ) -> MarginalLikelihood:
        """What the slopes at given values promise: evidence without a descent."""
        unknowns = unknowns_of(frame, self.ground, effects, self.reference, curve)
        place = place_of(unknowns, local, eta)
        normal = arrowhead(unknowns, place, self._gram(frame))
        return laplace(PosteriorMode(unknowns, place, normal, sigma, np.inf, 1))

    def extended(self, parent: Weighed, frame: Frame, added: Sequence[type[Effect]], starts: int = 1) -> Weighed:
        """A parent with further effects, from where they are weak, each sign and shape of them looked at.

        Parameters
        ----------
        parent : Weighed
        frame : Frame
            One that holds all effects.
        added : sequence of Effect classes
        starts : int
            Descents, from the places where slopes promise most.
        """
        effects, found = (*parent.effects, *added), parent.evidence.mode
        local = carried(frame, absent_values(frame, len(parent.local)), parent.frame, parent.local)
        places = weak_starts(frame, local, added)
        if len(places) > starts:
            promised = [self.glance(frame, effects, place, found.sigma, found.place.eta).log for place in places]
            order = np.argsort([-value if np.isfinite(value) else np.inf for value in promised])
            places = [places[i] for i in order[:starts]]
        ends = [self.weigh(frame, effects, place, found.sigma, found.place.eta) for place in places]
        return max(ends, key=lambda end: end.log)

    def without(self, weighed: Weighed, kept: tuple[type[Effect], ...]) -> Weighed:
        """A hypothesis without some of its effects, from where it is."""
        local, blank = weighed.local.copy(), absent_values(weighed.frame, len(weighed.local))
        for effect in weighed.effects:
            if effect not in kept:
                columns = [weighed.frame.names.index(f"{effect.name}.{p.name}") for p in effect.parameters]
                local[:, columns] = blank[:, columns]
        found = weighed.evidence.mode
        return self.weigh(weighed.frame, kept, local, found.sigma, found.place.eta)

    def again(self, weighed: Weighed) -> Weighed:
        """A hypothesis weighed with another yardstick, from where it is."""
        found = weighed.evidence.mode
        return self.weigh(weighed.frame, weighed.effects, weighed.local, found.sigma, found.place.eta)

    def refined(self, weighed: Weighed) -> Yardstick:
        """Yardstick of the noise a hypothesis leaves."""
        return yardstick_of(weighed.frame, self.noise(weighed))

    def noise(self, weighed: Weighed) -> tuple[Noise, ...]:
        """Noise a hypothesis leaves, in SI units."""
        return noise_of_residuals(weighed.frame.problem, self.residuals(weighed, DRAWS))

    def residuals(self, weighed: Weighed, draws: int = 1) -> np.ndarray:
        """Residuals at the mode ``(n_draw, n_record, n_channel, n_time)``, in units of the noise.

        Where errors of inputs are eliminated, the first is at their best; the others are draws of what is not known of
        them.
        """
        frame, number = weighed.frame, len(self.yardstick.noise)
        rows = residual_rows(frame, weighed.local, self.ground.whole)
        shape = (len(rows), number, -1)
        reactions = self.yardstick.reactions
        if reactions is None or frame.reactions is None:
            return np.asarray(rows).reshape(1, *shape)
        white = _whitened(self.yardstick.whitening, rows.reshape(1, *shape)).reshape(rows.shape)
        random, found = np.random.default_rng(0), []
        for r, row in enumerate(rows):
            best = reactions.inverse[r] @ (reactions.rows[r] @ white[r])
            root = np.linalg.cholesky(np.asarray(reactions.inverse[r]))
            drawn = [np.asarray(best) + (i > 0) * root @ random.standard_normal(len(best)) for i in range(draws)]
            found.append(np.asarray(row) - np.stack(drawn) @ np.asarray(frame.reactions.rows[r]))
        return np.stack(found, axis=1).reshape(draws, *shape)

    def innovations(self, weighed: Weighed) -> np.ndarray:
        """Whitened residuals at the mode, ``(n_record, n_channel, n_time)``."""
        left = jnp.asarray(self.residuals(weighed)[0])
        return np.asarray(_whitened(self.yardstick.whitening, left[None])[0])

    def _gram(self, frame: Frame):  # type: ignore[no-untyped-def]
        seen = self.yardstick.on(frame)
        return lambda local, columns, targets: seen.grams(local, columns, targets, self.ground.whole)


def weak_starts(frame: Frame, local: np.ndarray, added: Sequence[type[Effect]]) -> list[np.ndarray]:
    """Values with added effects weakly present: each sign that makes sense, each shape."""
    choices = [list(product(*(_weak(effect, parameter) for parameter in effect.parameters))) for effect in added]
    starts = []
    for choice in product(*choices):
        values = local.copy()
        for effect, sizes in zip(added, choice, strict=True):
            for parameter, size in zip(effect.parameters, sizes, strict=True):
                values[:, frame.names.index(f"{effect.name}.{parameter.name}")] = size
        starts.append(values)
    return starts


def _weak(effect: type[Effect], parameter: Parameter) -> list[float]:
    if parameter.name not in effect.strength:
        sizes = [factor * parameter.typical for factor in SHAPES] if parameter.log else [parameter.typical]
    elif parameter.unit == "Hz":
        sizes = list(FREQUENCIES * parameter.typical)
    elif parameter.reciprocal:
        sizes = [parameter.typical / WEAK**0.5]
    else:
        step = max(WEAK, effect.singular) * (parameter.typical - parameter.null)
        both = parameter.lower < parameter.null < parameter.upper
        sizes = [parameter.null + step, *([parameter.null - step] if both else [])]
    return [float(np.clip(size, parameter.lower, parameter.upper)) for size in dict.fromkeys(sizes)]


__all__ = ["Scales", "Weighed", "Yardstick", "mode", "unknowns_of", "weak_starts", "yardstick_of"]
