"""A supermodel: a model with many effects at once, all absent until they are switched on.

Every effect vanishes exactly at its null value, so one compiled program stands for every subset of its effects. A
search over effects and pairs of effects then compiles a few programs; only the values differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Parameter
from fibrefit.core.limits import check_time
from fibrefit.core.programs import kept_program
from fibrefit.discovery.engine.slopes import Slopes
from fibrefit.laws.law import Effect, SensorLaw, extends
from fibrefit.problem import (
    BlockFilter,
    InputSensitivities,
    Layout,
    Observations,
    Problem,
    Range,
    Slot,
    StepLikelihood,
    Task,
    corrected,
    downweighted,
    input_errors,
    instant_weights,
)

WIDTH = 12
"""Columns a program varies; more take several runs, each with one more of the residuals, a twelfth of the work. To make
a wider program takes seconds, and each of its runs, of one column too, fills as many rows: with 256 columns 84 MB."""

BUCKET = 4
"""Rows are whitened and multiplied in multiples of this."""
STRETCHES = 64
"""Equal parts of a record whose say in the values is reported one by one."""
ANYWHERE = Range(-np.inf, np.inf, 1.0)
OWN_KIND = ("guide", "fibre", "sensor")
"""Places with so many effects that they have supermodels of their own."""


@dataclass(frozen=True)
class Supermodel:
    """A task whose model holds many effects.

    Parameters
    ----------
    task : Task
        Its layout frees all values; which are active is decided at each call.
    sensitivities : InputSensitivities, optional
    whitening : BlockFilter, optional
        Of the residuals, and of the sensitivities, before their products are taken; none by default.
    in_steps : StepLikelihood, optional
        Of channels whose readings are taken for what coarse steps say of them.
    groups : tuple of tuple of Effect classes
        Effects that are simulated together, apart from all others, see `simulation_groups`; none where all are.
    """

    task: Task
    sensitivities: InputSensitivities | None = None
    whitening: BlockFilter | None = None
    in_steps: StepLikelihood | None = None
    groups: tuple[tuple[type[Effect], ...], ...] = ()

    @property
    def problem(self) -> Problem:
        """The problem with all effects."""
        return self.task.problem

    @cached_property
    def samples(self) -> np.ndarray:
        """Number of samples that count of each record, ``(n_record,)``."""
        # Each instant counts by the number of channels read then.
        weight = 1.0 if self.sensitivities is None else self.sensitivities.downweight
        return instant_weights(self.problem, weight).sum(axis=1)

    @cached_property
    def effects(self) -> tuple[type[Effect], ...]:
        """The effects it holds."""
        return self.problem.model.effects

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of a record's values, in their order."""
        return self.problem.layout.names

    @cached_property
    def declared(self) -> dict[str, Parameter]:
        """Declaration of each parameter and nuisance by name."""
        model = self.problem.model
        return {p.name: p for p in (*model.parameters, *model.rig.nuisances, *model.rig.conditions)}

    def sizes(self, names: Iterable[str]) -> np.ndarray:
        """Usual sizes of values in SI units; the unit itself of a lift, of which none is usual."""
        usual = np.array([abs(self.declared[name].typical) for name in names], dtype=float)
        return np.where(np.isfinite(usual), usual, 1.0)

    @cached_property
    def _bare(self) -> Problem:
        """The problem without what no simulation asks for, so that a program serves every study."""
        slots = tuple(Slot(name, "", ANYWHERE) for name in self.names)
        layout = Layout(slots, ("",) * len(self.problem.layout.records))
        return Problem(self.problem.model, layout, self.problem.observations)

    @property
    def _offset(self) -> jax.Array | None:
        # Offsets are those of readings taken for fine ones.
        fine = self.sensitivities if self.in_steps is None else self.in_steps.fine
        return None if fine is None else jnp.asarray(fine.offset)

    def holds(self, effects: Sequence[type[Effect]]) -> bool:
        """Whether all these effects are in it."""
        return set(effects) <= set(self.effects)

    def widened(self, effects: Sequence[type[Effect]]) -> Supermodel:
        """A supermodel with further effects, of the same readings and of inputs without the same errors."""
        return replace(supermodel_of(self.task, effects), sensitivities=self.sensitivities)

    def grams(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Local Gram matrices by differences, ``(n_record, n_active + 1, n_active + 1)``; residuals come last.

        Differences rather than tangents: a run is a native loop, while the tangents of a model with all effects at
        once are hundreds of megabytes; with switches located to rounding, differences are good to seven digits.

        Parameters
        ----------
        local : (n_record, n_local) in SI units
        columns : (n_active,) int
            Which values to vary.
        targets : (n_record, n_active) in SI units
            To what; a column is the change of the residuals, not divided by that of the value.
        counts : (n_record,) int
            Horizon of each record in samples.

        Raises
        ------
        OutOfTimeError
            If there is no time left, see `time_limit`.
        """
        return self.slopes(local, columns, targets, counts).grams(self.sensitivities)

    def slopes(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> Slopes:
        """Whitened residuals and their changes, and their products with what errors of inputs do.

        Parameters and errors as `grams`.
        """
        rows = self.rows(local, columns, targets, counts)
        white = whitened_rows(rows, len(self.problem.observations.weight), self.whitening)
        kept = np.asarray(white)[:, : 1 + len(columns)]
        return Slopes(kept, None if self.sensitivities is None else self.sensitivities.products(kept))

    def rows(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> jax.Array:
        """Residuals, then their changes, ``(n_record, n_row, n_channel * n_time)``; padded with zero, not whitened.

        Parameters and errors as `grams`.
        """
        if self.groups:
            return self._rows_by_group(local, columns, targets, counts)
        runs = list[jax.Array]()
        for i in range(0, max(len(columns), 1), WIDTH):
            check_time()
            found = self._of_some(local, columns[i : i + WIDTH], targets[:, i : i + WIDTH], counts)
            runs.append(found[:, 1:] if runs else found)
        return self.seen(runs[0] if len(runs) == 1 else jnp.concatenate(runs, axis=1))

    def residuals(self, local: np.ndarray, counts: np.ndarray) -> jax.Array:
        """Residuals of each record, ``(n_record, n_channel * n_time)``, those of noisy inputs without their errors.

        Parameters
        ----------
        local : (n_record, n_local) in SI units
        counts : (n_record,) int
        """
        if self.groups:
            part, places = self.parts[0]
            return part.residuals(local[:, places], counts)
        nothing = np.zeros(0, dtype=np.int32), np.zeros((len(local), 0))
        return self.seen(self._of_some(local, *nothing, counts))[:, 0]

    def _of_some(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> jax.Array:
        """Rows of at most `WIDTH` columns, of readings taken for fine ones."""
        rows = _rows(*self._called(local, columns, targets, counts), self._offset)
        return rows[:, : 1 + -(-len(columns) // BUCKET) * BUCKET]

    def _called(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> tuple:
        """What the program of its rows is called with, before what these are counted from."""
        active = len(columns)
        padded = np.zeros(1 + WIDTH, dtype=np.int32)
        padded[1 : 1 + active] = columns
        # The first row is of the values as they are: the first of them goes to where it is.
        values = np.repeat(local[:, :1], 1 + WIDTH, axis=1)
        values[:, 1 : 1 + active] = targets
        varied = jnp.asarray(padded), jnp.asarray(values), jnp.asarray(1 + active, dtype=jnp.int32)
        return self._bare, jnp.asarray(local), varied, jnp.asarray(counts, dtype=jnp.int32)

    def make_program(self) -> None:
        """Make the program of its rows, or take it up; errors of inputs are not in it."""
        nothing = np.zeros((len(self.problem.layout.records), 0))
        local, counts = np.zeros((len(nothing), len(self.names))), np.zeros(len(nothing))
        _rows.make(*self._called(local, np.zeros(0, dtype=np.int32), nothing, counts), None)

    @cached_property
    def parts(self) -> tuple[tuple[Supermodel, np.ndarray], ...]:
        """The supermodel of each group, as a search makes it, and where its values ``(n_part,)`` are among these."""
        model, apart = self.problem.model, {effect for group in self.groups for effect in group}
        left_out = {f"{effect.name}.{parameter.name}" for effect in apart for parameter in effect.parameters}
        slots = tuple(slot for slot in self.problem.layout.slots if slot.name not in left_out)
        base = Problem(
            replace(model, effects=tuple(effect for effect in model.effects if effect not in apart)),
            Layout(slots, self.problem.layout.records),
            self.problem.observations,
        )
        task, found = replace(self.task, problem=base), []
        for group in self.groups:
            part = supermodel_of(task, sorted(group, key=lambda effect: effect.name))
            part = replace(part, sensitivities=self.sensitivities, in_steps=self.in_steps)
            found.append((part, np.array([self.names.index(name) for name in part.names])))
        return tuple(found)

    def _rows_by_group(
        self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray
    ) -> jax.Array:
        """Rows of effects that are absent in each other's models, where residuals are the same therefore."""
        rows: dict[int, jax.Array] = {}
        for part, places in self.parts:
            own = [i for i, column in enumerate(columns) if column in places and 1 + i not in rows]
            if not own and rows:
                continue
            within = np.array([np.flatnonzero(places == columns[i])[0] for i in own], dtype=int)
            found = part.rows(local[:, places], within, targets[:, own], counts)
            rows.setdefault(0, found[:, 0])
            rows.update({1 + i: found[:, 1 + j] for j, i in enumerate(own)})
        whole = jnp.stack([rows[i] for i in range(1 + len(columns))], axis=1)
        return jnp.pad(whole, ((0, 0), (0, -len(columns) % BUCKET), (0, 0)))

    def seen(self, rows: jax.Array) -> jax.Array:
        """Rows ``(n_record, n_row, n_channel * n_time)`` of readings taken for fine ones as what readings say."""
        return rows if self.in_steps is None else self.in_steps.rows(rows, self.problem.observations.weight)

    def costs(self, local: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Sum of squared residuals of each record, ``(n_record,)``."""
        # A Gram matrix of nothing but residuals: a program of its own would have to be compiled too.
        nothing = np.zeros(0, dtype=np.int32)
        return self.grams(local, nothing, np.zeros((len(local), 0)), counts)[:, 0, 0]


def stretch_products(
    supermodel: Supermodel, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Products of changes and residuals within each stretch of a record, whitened of noise and errors of inputs.

    Parameters
    ----------
    supermodel : Supermodel
        Whitened.
    local, columns, targets, counts : as `Supermodel.grams`

    Returns
    -------
    (n_record, STRETCHES, n_active + 1, n_active + 1)
        The residuals last.
    """
    return _products_by_stretch(supermodel, supermodel.slopes(local, columns, targets, counts))


def change_products(supermodel: Supermodel, local: np.ndarray, other: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """The same of one change, that from all values of one place ``(n_record, n_local)`` to those of another at once."""
    nothing = np.zeros(0, dtype=np.int32), np.zeros((len(local), 0))
    here, there = (supermodel.slopes(values, *nothing, counts) for values in (local, other))
    return _products_by_stretch(supermodel, here.beside(there).differences())


def _products_by_stretch(supermodel: Supermodel, slopes: Slopes) -> np.ndarray:
    rows = slopes.whitened(supermodel.sensitivities)
    rows = rows[:, np.r_[1 : rows.shape[1], 0]]
    channels = len(supermodel.problem.observations.weight)
    whole = rows.reshape(*rows.shape[:2], channels, -1)
    size = -(-whole.shape[-1] // STRETCHES)
    whole = np.pad(whole, [(0, 0)] * 3 + [(0, STRETCHES * size - whole.shape[-1])])
    parts = whole.reshape(*whole.shape[:3], STRETCHES, size).transpose(0, 3, 1, 2, 4)
    parts = parts.reshape(*parts.shape[:3], channels * size)
    products: np.ndarray = parts @ np.swapaxes(parts, 2, 3)
    return products


def is_quick(effect: type[Effect]) -> bool:
    """Whether it slows down no others it is simulated with, as what is stiff or changes with time does."""
    return not effect.stiff and not extends(effect)


def group_of(effect: type[Effect], effects: Sequence[type[Effect]], stiff: bool = False) -> tuple[type[Effect], ...]:
    """Those of `effects` tried together with one of them: its kind, as a model with all effects takes long to run.

    One that makes the equations of motion stiff would slow down all others, and stays alone. So does a law with a
    memory where they are `stiff` already: that is a state of each segment of a fibre, and a step solves for all of them
    together.
    """
    alone = lambda other: other.stiff or (stiff and bool(getattr(other, "memory", ())))  # noqa: E731
    if alone(effect):
        return (effect,)
    return tuple(other for other in effects if not alone(other) and _kind(other) == _kind(effect))


def simulation_groups(effects: Sequence[type[Effect]], stiff: bool = False) -> tuple[tuple[type[Effect], ...], ...]:
    """All effects, each in its `group_of`: together their program would take many minutes to compile."""
    return tuple(dict.fromkeys(group_of(effect, effects, stiff) for effect in effects))


def _kind(effect: type[Effect]) -> tuple[str, bool, bool, bool, bool]:
    """Where it acts; whether it is a sensor that answers late, and changes with time, at once, or in each record."""
    place = effect.name.partition(".")[0]
    late = issubclass(effect, SensorLaw) and (
        effect.late_by is not SensorLaw.late_by or effect.lags is not SensorLaw.lags
    )
    return place if place in OWN_KIND else "", late, extends(effect), effect.sudden, bool(effect.recurs)


def supermodel_of(
    task: Task, effects: Sequence[type[Effect]], sensitivities: InputSensitivities | None = None
) -> Supermodel:
    """Supermodel with the effects of a task's model and more.

    Parameters
    ----------
    task : Task
    effects : sequence of Effect classes
        Added to those the model has already.
    sensitivities : InputSensitivities, optional
    """
    old = task.problem.model
    model = replace(old, effects=tuple(dict.fromkeys((*old.effects, *effects))))
    layout = task.problem.layout.of_parameters(model.parameters)
    problem = Problem(model, layout, task.problem.observations)
    if sensitivities is not None:
        problem = downweighted(
            corrected(problem, input_errors(task), sensitivities.coefficients), sensitivities.downweight
        )
    return Supermodel(replace(task, problem=problem), sensitivities)


def _residuals(problem: Problem, local: jax.Array, data: Observations, count: jax.Array) -> jax.Array:
    early = jnp.arange(data.experiment.times.shape[0]) < count
    shorter = data._replace(
        experiment=data.experiment._replace(count=jnp.minimum(count, data.experiment.count)),
        weight={channel: jnp.where(early, weight, 0.0) for channel, weight in data.weight.items()},
    )
    return problem.record_residuals(local, shorter).ravel()


@kept_program
def _rows(
    problem: Problem,
    local: jax.Array,
    varied: tuple[jax.Array, jax.Array, jax.Array],
    counts: jax.Array,
    offset: jax.Array | None,
) -> jax.Array:
    """Residuals, then their changes, ``(n_record, n_row, n_channel * n_time)``.

    What is varied: columns of the values, padded; what each is set to; and how many rows are needed.
    """
    columns, targets, active = varied

    def one(row: tuple) -> jax.Array:
        local, target, data, count, offset = row

        def vary(i: jax.Array, rows: jax.Array) -> jax.Array:
            there = _residuals(problem, local.at[columns[i]].set(target[i]), data, count)
            return rows.at[i].set(there - rows[0])

        # The first row is of the values as they are; a program with a second copy of the model takes longer to make.
        channels = [data.weight[channel] for channel in problem.model.rig.channels]
        rows = jnp.zeros((len(columns), len(channels) * channels[0].size))
        rows = jax.lax.fori_loop(0, active, vary, rows)
        if offset is not None:
            counted = jnp.stack(channels) * (jnp.arange(channels[0].size) < count) > 0.0
            rows = rows.at[0].add(jnp.where(counted.ravel(), offset, 0.0))
        return rows

    return jax.lax.map(one, (local, targets, problem.observations, counts, offset))


@kept_program
def whitened_rows(rows: jax.Array, number: int, whitening: BlockFilter | None) -> jax.Array:
    """Rows ``(n_record, n_row, number * n_time)`` of `number` channels, whitened."""
    if whitening is None:
        return rows
    split = jnp.moveaxis(rows.reshape(*rows.shape[:2], number, -1), 1, 0)
    return jnp.moveaxis(whitening.whiten_rows(split), 0, 1).reshape(rows.shape)
