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
from fibrefit.discovery.engine.supermodel import Frame, Reactions, residual_rows, stretch_products
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.effects.law import Effect
from fibrefit.problem.estimate.evidence import MarginalLikelihood, laplace, weigh
from fibrefit.problem.estimate.gauss_newton import (
    RIGID,
    PosteriorMode,
    Unknowns,
    arrowhead,
    local_grams,
    mode,
    place_of,
    score_test,
    solved,
)
from fibrefit.problem.inputs.reactions import whitened
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
        reactions = whitened(reactions, whitening)
    return Yardstick(tuple(noise), whitening, reactions)


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


class Promise(NamedTuple):
    """What slopes promise of an effect.

    Parameters
    ----------
    gain : float
        In nats, what the effect costs beforehand taken off.
    values : mapping of str to float
        Its parameters there, in SI units.
    """

    gain: float
    values: dict[str, float]


class Direction(NamedTuple):
    """A shape of an effect, and the ways in which it enters a model then.

    Parameters
    ----------
    shapes : mapping of str to float
        Parameters besides the strengths, in SI units.
    strengths : tuple of (str, float)
        What is moved, and to where, in SI units.
    """

    shapes: dict[str, float]
    strengths: tuple[tuple[str, float], ...]


def directions(effect: type[Effect]) -> list[Direction]:
    """Every shape of an effect, each of its strengths moved by itself."""
    others = [p for p in effect.parameters if p.name not in effect.strength]
    strengths = []
    for parameter in effect.parameters:
        if parameter.name in effect.strength:
            weak = _weak(effect, parameter)
            # A negative strength does the opposite of a positive one, but each frequency something of its own.
            strengths += [(parameter.name, value) for value in (weak if parameter.unit == "Hz" else weak[:1])]
    found = []
    for sizes in product(*(_weak(effect, parameter) for parameter in others)):
        shapes = dict(zip((parameter.name for parameter in others), sizes, strict=True))
        found.append(Direction(shapes, tuple(strengths)))
    return found


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

    def at_once(self, frame: Frame, effects: tuple[type[Effect], ...], local: np.ndarray, parent: Weighed) -> Weighed:
        """A hypothesis where it is, without a descent."""
        found = parent.evidence.mode
        return Weighed(effects, frame, self.glance(frame, effects, local, found.sigma, np.zeros_like(found.place.eta)))

    def absent(self, parent: Weighed, frame: Frame, added: Sequence[type[Effect]], gain: float) -> Weighed:
        """A parent with further effects at their nulls, and the gain that slopes promise of them."""
        effects, found = (*parent.effects, *added), parent.evidence.mode
        local = carried(frame, absent_values(frame, len(parent.local)), parent.frame, parent.local)
        unknowns = unknowns_of(frame, self.ground, effects, self.reference)
        place, old = place_of(unknowns, local, found.place.eta), parent.evidence
        size = len(unknowns.shared)
        blank = np.full((len(old.grid), size), np.nan)
        covariance = np.full((len(old.grid), size, size), np.nan)
        at = PosteriorMode(unknowns, place, found.normal, found.sigma, 0.0, 0)
        return Weighed(effects, frame, replace(old, mode=at, log=old.log + gain, z=blank, covariance=covariance))

    def extended(self, parent: Weighed, frame: Frame, effect: type[Effect], promise: Promise) -> Weighed:
        """A parent with a further effect, from where slopes promise most of it.

        Parameters
        ----------
        parent : Weighed
        frame : Frame
            One that holds the effect too.
        effect : Effect class
        promise : Promise
            Of the effect on that parent.
        """
        found = parent.evidence.mode
        local = carried(frame, absent_values(frame, len(parent.local)), parent.frame, parent.local)
        for name, value in promise.values.items():
            local[:, frame.names.index(name)] = value
        return self.weigh(frame, (*parent.effects, effect), local, found.sigma, found.place.eta)

    def screened(self, parent: Weighed, frame: Frame, effects: Sequence[type[Effect]]) -> dict[type[Effect], Promise]:
        """What slopes promise of each effect on top of a parent, at the best of its shapes.

        All effects of a frame are looked at together, one simulation each.

        Parameters
        ----------
        parent : Weighed
        frame : Frame
            One that holds all of them.
        effects : sequence of Effect classes
        """
        unknowns, found = unknowns_of(frame, self.ground, parent.effects, self.reference), parent.evidence.mode
        base = carried(frame, absent_values(frame, len(parent.local)), parent.frame, parent.local)
        promised = dict.fromkeys(effects, Promise(-np.inf, {}))
        shapes = {effect: directions(effect) for effect in effects}
        for number in range(max((len(ways) for ways in shapes.values()), default=0)):
            there = {effect: ways[number] for effect, ways in shapes.items() if number < len(ways)}
            local = base.copy()
            for effect, direction in there.items():
                for name, value in direction.shapes.items():
                    local[:, frame.names.index(f"{effect.name}.{name}")] = value
            for effect, promise in self._promises(frame, unknowns, local, found, there):
                promised[effect] = max(promised[effect], promise, key=lambda one: one.gain)
        return promised

    def _promises(
        self,
        frame: Frame,
        unknowns: Unknowns,
        local: np.ndarray,
        found: PosteriorMode,
        there: dict[type[Effect], Direction],
    ) -> list[tuple[type[Effect], Promise]]:
        """Score test of each direction: its gain less what it costs, and where that is."""
        ways = [(effect, name, value) for effect, way in there.items() for name, value in way.strengths]
        columns = np.array([frame.names.index(f"{effect.name}.{name}") for effect, name, _ in ways])
        place = place_of(unknowns, local, found.place.eta)
        values = np.array([value for *_, value in ways])
        grams = local_grams(unknowns, place, self._gram(frame), (columns, values))
        score, information = score_test(unknowns, place, grams, len(columns), found.sigma)
        seen = np.where(information > 0.0, information, np.inf)
        gains = np.where(information > 0.0, 0.5 * score**2 / seen - PRICE, -np.inf)
        found_all = []
        for (effect, name, value), gain, share in zip(ways, gains, -score / seen, strict=True):
            shapes = {f"{effect.name}.{shape}": size for shape, size in there[effect].shapes.items()}
            start = {f"{effect.name}.{name}": _start(frame, f"{effect.name}.{name}", value, share)}
            found_all.append((effect, Promise(float(gain), shapes | start)))
        return found_all

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

    def inflation(self, weighed: Weighed, names: Iterable[str]) -> float:
        """Variance of estimates by the scatter of the scores of parts of the records, over that by the matrices; at least 1.

        It exceeds one where innovations are not what they are taken for: heavy tails, slopes that foretell little, a
        spectrum that is not quite right. A gain counts for as much less.

        Parameters
        ----------
        weighed : Weighed
        names : iterable of str
            Shared values; the largest of their ratios is told.

        Source
        ------
        White, Econometrica 50 (1982).
        """
        found, kept = weighed.evidence.mode, []
        unknowns, frame = found.unknowns, self.yardstick.on(weighed.frame)

        def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
            kept.append(stretch_products(frame, local, columns, targets, self.ground.whole)[0])
            return kept[0].sum(axis=1)

        grams = local_grams(unknowns, found.place, gram)
        raw = np.sqrt(np.maximum(np.einsum("rsii->ri", kept[0]), 1e-300))
        rate = np.sqrt(np.maximum(np.einsum("rii->ri", grams), 0.0)) / raw
        scores = kept[0][..., :-1, -1] * rate[:, None, :-1]
        n, mine = len(unknowns.shared), unknowns.own
        precision = np.concatenate([np.zeros(len(unknowns.each)), np.maximum(found.sigma, RIGID) ** -2.0])
        held = np.concatenate([~unknowns.free, np.zeros_like(found.place.eta, dtype=bool)], axis=1)
        share = solved(found.normal.blocks + np.diag(precision), np.swapaxes(found.normal.cross, 1, 2))
        own = np.where(held[:, None], 0.0, scores[..., mine])
        covariance = weighed.evidence.covariance[int(np.argmax(weighed.evidence.weight))]
        moved = (scores[..., :n] - np.einsum("rsj,rji->rsi", own, share)) @ covariance
        ratio = np.sum(moved**2, axis=(0, 1)) / np.maximum(np.diag(covariance), 1e-300)
        index = [unknowns.names.index(name) for name in names]
        return max(1.0, *(float(ratio[i]) for i in index))

    def innovations(self, weighed: Weighed) -> np.ndarray:
        """Whitened residuals at the mode, ``(n_record, n_channel, n_time)``."""
        left = jnp.asarray(self.residuals(weighed)[0])
        return np.asarray(_whitened(self.yardstick.whitening, left[None])[0])

    def _gram(self, frame: Frame):  # type: ignore[no-untyped-def]
        seen = self.yardstick.on(frame)
        return lambda local, columns, targets: seen.grams(local, columns, targets, self.ground.whole)


def _start(frame: Frame, name: str, weak: float, share: float) -> float:
    """Strength at which slopes see a minimum, a `share` of the way to a `weak` one; no more than typical."""
    declared = frame.declared[name]
    if declared.reciprocal or declared.unit == "Hz":
        return weak
    most = abs(1.0 / WEAK)
    least = 1.0 if declared.lower >= declared.null or declared.upper <= declared.null else -most
    return float(
        np.clip(declared.null + np.clip(share, least, most) * (weak - declared.null), declared.lower, declared.upper)
    )


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


__all__ = ["Scales", "Weighed", "Yardstick", "mode", "unknowns_of", "yardstick_of"]
