"""Which effects a set of records could tell apart, before or after measuring: from the model's sensitivities alone.

Source
------
The projection and its smallest detectable strength are those of a t-test in a linear model; choosing the next record by
the worst pair follows Hunter and Reiner, Technometrics 7 (1965).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.discover.candidates import SMALL, Ground
from fibrefit.discover.evidence import CHANCE
from fibrefit.discover.frame import Frame
from fibrefit.discover.refit import STEP
from fibrefit.effects.law import Effect

INSEPARABLE = 0.98
"""Cosine beyond which two effects change the records in the same way."""
UNIQUE = 0.02
"""Share of an effect's change that must not be imitable by the base parameters, for the effect to be visible at all."""


@dataclass(frozen=True)
class Direction:
    """What one effect would do to the records.

    Parameters
    ----------
    effect, parameter, unit : str
    detectable : float
        Smallest strength that would be found in these records, in `unit`; infinite if none would. For a parameter that
        vanishes at infinity, the largest value.
    unique : float
        Share of the change that base parameters and nuisances cannot imitate, 0 to 1.
    """

    effect: str
    parameter: str
    unit: str
    detectable: float
    unique: float


@dataclass(frozen=True)
class Confusion:
    """How alike effects are in a set of records.

    Parameters
    ----------
    directions : tuple of Direction
    cosine : (n_effect, n_effect)
        Of the changes two effects make beyond what base parameters can imitate, without sign; 1 is inseparable.
    """

    directions: tuple[Direction, ...]
    cosine: np.ndarray

    @property
    def invisible(self) -> tuple[str, ...]:
        """Effects these records cannot show."""
        return tuple(d.effect for d in self.directions if not np.isfinite(d.detectable))

    def pairs(self, beyond: float = INSEPARABLE) -> tuple[tuple[str, str, float], ...]:
        """Pairs whose cosine is beyond a limit, the most alike first."""
        names = [direction.effect for direction in self.directions]
        found = [
            (names[i], names[j], float(self.cosine[i, j]))
            for i in range(len(names))
            for j in range(i)
            if self.cosine[i, j] > beyond
        ]
        return tuple(sorted(found, key=lambda pair: -pair[2]))


def confusion(
    frame: Frame, ground: Ground, local: np.ndarray, effects: Sequence[type[Effect]], kappa: float
) -> Confusion:
    """Compare what effects of a frame would do to its records.

    Parameters
    ----------
    frame : Frame
    ground : Ground
    local : (n_record, n_local) in SI units
        Values of the base model, with every effect that may be missing absent.
    effects : sequence of Effect classes
        Those of the frame that may be missing.
    kappa : float
        Power of what is no effect, where effects act, in units of the noise: its colour, see `evidence.colour`, or more
        where the records are known to hold more than noise.

    Returns
    -------
    Confusion
    """
    strengths = _strengths(effects)
    columns, targets, sizes = _varied(frame, ground, local, strengths)
    grams = frame.grams(local, columns, targets, ground.whole)[:, :-1, :-1]
    norms, unique, cosine = _compared(grams, ground)
    visible = unique > UNIQUE
    needed = np.sqrt(kappa * CHANCE)
    directions = []
    for (name, parameter), size, norm, share, seen in zip(strengths, sizes, norms, unique, visible, strict=True):
        least = needed / norm if seen else np.inf
        strength = (1.0 / (least * size) if np.isfinite(least) else np.inf) if parameter.reciprocal else least * size
        directions.append(Direction(name, parameter.name, parameter.unit, float(strength), float(share)))
    return Confusion(tuple(directions), cosine)


@dataclass(frozen=True)
class Split:
    """The further record that best tells two effects apart.

    Parameters
    ----------
    pair : tuple of str
    record : int
        Its place in the menu.
    before, after : float
        Cosine of the pair without it and with it.
    """

    pair: tuple[str, str]
    record: int
    before: float
    after: float


def best_split(
    frame: Frame,
    ground: Ground,
    local: np.ndarray,
    pair: Sequence[type[Effect]],
    menu: Sequence[Mapping[str, float]],
) -> Split:
    """Search a menu of further records for the one that splits a pair best.

    Parameters
    ----------
    frame : Frame
    ground : Ground
    local : (n_record, n_local) in SI units
    pair : sequence of Effect classes
        Two.
    menu : sequence of mapping of condition to value in SI units
        Each a record like the first one under other conditions.

    Returns
    -------
    Split
    """
    strengths = _strengths(pair)
    columns, targets, _ = _varied(frame, ground, local, strengths)
    grams = frame.grams(local, columns, targets, ground.whole)[:, :-1, :-1]
    before = float(_compared(grams, ground)[2][0, 1])
    further = _menu_grams(frame, ground, local, columns, targets, menu)
    after = [float(_compared(np.concatenate([grams, gram[None]]), ground)[2][0, 1]) for gram in further]
    best = int(np.argmin(after))
    return Split((pair[0].name, pair[1].name), best, before, after[best])


def _menu_grams(
    frame: Frame,
    ground: Ground,
    local: np.ndarray,
    columns: np.ndarray,
    targets: np.ndarray,
    menu: Sequence[Mapping[str, float]],
) -> list[np.ndarray]:
    """Gram matrix of each record of a menu; in batches as long as the study, for which the program is compiled."""
    records, found = len(local), []
    for start in range(0, len(menu), records):
        batch = [menu[min(start + r, len(menu) - 1)] for r in range(records)]
        data = jax.tree.map(lambda leaf: jnp.repeat(leaf[:1], records, axis=0), frame.problem.observations)
        conditions = dict(data.experiment.conditions)
        for name in menu[0]:
            conditions[name] = jnp.array([choice[name] for choice in batch])
        planned = data._replace(experiment=data.experiment._replace(conditions=conditions))
        problem = eqx.tree_at(lambda p: p.observations, frame.problem, planned)
        same = [np.repeat(values[:1], records, axis=0) for values in (local, targets, ground.whole)]
        elsewhere = replace(frame, task=replace(frame.task, problem=problem), reactions=None)
        found += list(elsewhere.grams(same[0], columns, same[1], same[2])[:, :-1, :-1])
    return found[: len(menu)]


def _strengths(effects: Sequence[type[Effect]]) -> list[tuple[str, Parameter]]:
    return [(effect.name, next(p for p in effect.parameters if p.name == effect.strength[0])) for effect in effects]


def _compared(grams: np.ndarray, ground: Ground) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size of each effect's own change, its share of the whole change, and the cosines."""
    projected, whole = _projected(grams, len(ground.base), len(ground.each))
    norms = np.sqrt(np.maximum(np.diag(projected), 0.0))
    total = np.sqrt(np.diag(whole))
    unique = np.divide(norms, total, out=np.zeros_like(norms), where=total > 0.0)
    visible = unique > UNIQUE
    safe = np.where(visible, norms, 1.0)
    cosine = np.abs(projected / np.outer(safe, safe)) * np.outer(visible, visible)
    np.fill_diagonal(cosine, 1.0)
    return norms, unique, cosine


def _varied(
    frame: Frame, ground: Ground, local: np.ndarray, strengths: Sequence[tuple[str, Parameter]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns, the values they are set to, and the size of each effect's change (of its inverse where it has one)."""
    names = [*ground.base, *ground.each, *(f"{effect}.{parameter.name}" for effect, parameter in strengths)]
    columns = np.array([frame.names.index(name) for name in names])
    targets = local[:, columns].copy()
    n = len(ground.base) + len(ground.each)
    scale = np.array([abs(frame.declared[name].typical) for name in names[:n]])
    targets[:, :n] += STEP * np.maximum(np.abs(targets[:, :n]), 0.01 * scale)
    sizes = []
    for i, (_, parameter) in enumerate(strengths):
        if parameter.reciprocal:
            targets[:, n + i] = parameter.typical / SMALL**0.5
            sizes.append(SMALL**0.5 / parameter.typical)
        else:
            change = SMALL * (parameter.typical - parameter.null)
            targets[:, n + i] = parameter.null + change
            sizes.append(abs(change))
    return columns, targets, np.array(sizes)


def _projected(grams: np.ndarray, shared: int, own: int) -> tuple[np.ndarray, np.ndarray]:
    """Gram matrix of the effects' columns, base parameters and nuisances projected off, and without projection."""
    n = shared + own
    records = len(grams)
    size = shared + records * own
    base, cross = np.zeros((size, size)), np.zeros((size, grams.shape[1] - n))
    for r, gram in enumerate(grams):
        place = np.r_[np.arange(shared), shared + r * own + np.arange(own)]
        base[np.ix_(place, place)] += gram[:n, :n]
        cross[place] += gram[:n, n:]
    whole = grams[:, n:, n:].sum(axis=0)
    scale = np.sqrt(np.where(np.diag(base) > 0.0, np.diag(base), 1.0))
    solved = np.linalg.lstsq(base / np.outer(scale, scale), cross / scale[:, None], rcond=1e-10)[0]
    return whole - (cross / scale[:, None]).T @ solved, whole
