"""The problem: a model, a layout and observations; the residuals that every method of identification reads."""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.arrays import assembled, functions_for
from fibrefit.core.programs import column_products, kept_program
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.observations import Observations, step_residuals
from fibrefit.simulation.inputs import row
from fibrefit.simulation.model import Experiment, Model, Response, corrected_conditions
from fibrefit.simulation.switched import write


def nearest_side(
    times: jax.Array, distances: jax.Array, instants: jax.Array, heights: jax.Array, number: Any = None
) -> jax.Array:
    """Distances of samples from a signal that jumps; beside a jump, from the nearer of what it is before and after.

    A jump that passes a sample as the parameters move would make the cost jump, by the square of its height in noise
    rms: the search would end at that wall, wherever it first meets it. A sample that a jump comes near goes over to
    whatever between both sides is nearest to it, so the cost is smooth, and a jump on the wrong side of a sample still
    pulls. What is further off than the jump is high is not explained by it: no jump hides a sample that strays.

    Parameters
    ----------
    times : (n_time,) in s
    distances : (n_channel, n_time)
        Simulated less measured.
    instants : (n_jump,) in s
        One after the other in time.
    heights : (n_channel, n_jump) in the unit of the distances
        After less before.
    number : () int, optional
        Jumps that there are; the rest of the rows is not looked at. All by default.
    """
    size = times.shape[0]
    rows = jnp.int32(instants.shape[0]) if number is None else number
    steps = jnp.clip(jnp.searchsorted(times, instants, side="right") - 1, 0, size - 2)
    way = jnp.clip((instants - times[steps]) / (times[steps + 1] - times[steps]), 0.0, 1.0)
    jumps = _Jumps(
        steps,
        jnp.concatenate([jnp.full(1, -2), steps[:-1]]),
        jnp.stack([(1.0 - way) ** 2 * (1.0 + 2.0 * way), way**2 * (3.0 - 2.0 * way)], axis=-1)[:, None],
        jnp.stack([heights, -heights], axis=-1).swapaxes(0, 1),
        jnp.stack([distances[:, steps], distances[:, steps + 1]], axis=-1).swapaxes(0, 1),
    )
    passed = _passed_by(jumps, rows)
    # Each sample is as the last jump beside it leaves it.
    place = jnp.arange(instants.shape[0])
    following = jnp.where(place + 1 < rows, jnp.roll(steps, -1), size)
    first = jnp.where((place < rows) & (following > steps), steps, size)
    second = jnp.where((place < rows) & (following > steps + 1), steps + 1, size)
    for samples, left in ((first, passed[..., 0]), (second, passed[..., 1])):
        distances = distances.at[:, samples].set(left.T, mode="drop")
    return distances


class _Jumps(NamedTuple):
    """What jumps, one after the other in time, do to the two samples beside each of them.

    Parameters
    ----------
    step, before : (n_jump,) int
        The first of these samples, and that of the jump before.
    doubt : (n_jump, 1, 2)
        Share in which a sample may be on the other side.
    other : (n_jump, n_channel, 2)
        What lies between here and there, as seen from each sample.
    here : (n_jump, n_channel, 2)
        Distances of the samples.
    """

    step: jax.Array
    before: jax.Array
    doubt: jax.Array
    other: jax.Array
    here: jax.Array


def _passed_by(jumps: _Jumps, rows: jax.Array) -> jax.Array:
    """Distances of the samples beside the first `rows` jumps when each has passed, ``(n_jump, n_channel, 2)``.

    Few of the rows are filled: one after the other is faster than all at once. The loop holds nothing but these
    samples: one that held all distances would copy them, with all their tangents, at each jump.
    """

    def pass_by(number: jax.Array, carry: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        left, passed = carry
        jump: _Jumps = jax.tree.map(lambda part: row(part, number), jumps)
        # A sample beside two jumps is handed on from one to the next.
        beside = jnp.stack([left[:, 1], jump.here[:, 1]], axis=-1)
        now = jnp.where(jump.step == jump.before, left, jnp.where(jump.step == jump.before + 1, beside, jump.here))
        nearer = jnp.clip(-now, jnp.minimum(jump.other, 0.0), jnp.maximum(jump.other, 0.0))
        left = now + jump.doubt * nearer
        return left, write(passed, number, left)

    start = jnp.zeros_like(jumps.here[0]), jnp.zeros_like(jumps.here)
    return jax.lax.fori_loop(0, rows, pass_by, start)[1]


class Linearised(NamedTuple):
    """Residuals and how they move with each record's own free values.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time), in units of the noise
    slopes : (n_record, n_channel, n_time, n_local_free), per SI unit of the value
    """

    residuals: Any
    slopes: Any


class Trajectories(NamedTuple):
    """The motion behind the readings, by record.

    Parameters
    ----------
    channels : dict of (n_record, n_time) in SI units
        Readings.
    states, modes : pytrees of (n_record, n_time)
        As of `Solution`.
    trouble : (n_record,) bool
        Whether the integrator had to give up on locating switches somewhere.
    fibres : tuple of pairs of (n_record, n_time)
        Stretch [m] and its rate [m/s] of each fibre.
    """

    channels: dict[str, Any]
    states: Any
    modes: Any
    trouble: Any
    fibres: tuple[tuple[Any, Any], ...]


class Problem(eqx.Module):
    """All that is needed to compare a model with records; a pytree whose leaves are the data.

    Parameters
    ----------
    soft_beyond : float or None
        Residuals larger than this many times the noise count less than quadratically (soft L1); None: they do not.
    """

    model: Model = eqx.field(static=True)
    layout: Layout = eqx.field(static=True)
    observations: Observations
    soft_beyond: float | None = eqx.field(static=True, default=None)

    def predict(self, local: jax.Array, experiment: Experiment) -> dict[str, jax.Array]:
        """What the model says of records, those that were measured or others.

        Parameters
        ----------
        local : (n_record, n_local) in SI units
        experiment : Experiment
            Leaves ``(n_record, ...)``.

        Returns
        -------
        dict of (n_record, n_time) in SI units
        """
        return jax.lax.map(lambda row: self._respond(*row).channels, (local, experiment))

    def residuals(self, values: jax.Array) -> jax.Array:
        """Simulated minus measured in units of the noise, ``(n_record, n_channel, n_time)``; zero where not measured.

        Parameters
        ----------
        values : (n_free,) in SI units
        """
        return self.residuals_at(self.layout.local(values))

    def residuals_at(self, local: jax.Array) -> jax.Array:
        """The same from the values of each record, ``(n_record, n_local)`` in SI units."""
        return jax.lax.map(lambda row: self.record_residuals(*row), (local, self.observations))

    def linearised(self, values: Any) -> Linearised:
        """Residuals at `values` ``(n_free,)`` and their slopes with respect to each record's own free values.

        A record depends on few of a problem's values; the full Jacobian, mostly zeros, is never made.
        """
        return self.linearised_at(self.layout.local(values))

    def linearised_at(self, local: Any) -> Linearised:
        """As `linearised`, from the values of each record, ``(n_record, n_local)`` in SI units."""
        return self.evaluate_at(local)[0]

    def evaluate(self, local: np.ndarray) -> tuple[Linearised, Trajectories]:
        """As `evaluate_at`, outside compiled programs; where it was evaluated at the same place last, that value.

        Noise, products, checks and motion are needed at one place by those who do not know of each other.
        """
        local = np.asarray(local)
        place, known = local.tobytes(), _LAST.get(_ONE)
        if known is not None and known.problem() is self and known.place == place:
            return known.found
        found = self.evaluate_at(local)
        _LAST[_ONE] = _Remembered(weakref.ref(self, _forget), place, found)
        return found

    # Compiled under their own names, they are traced once for all the programs that contain them.
    @kept_program
    def evaluate_at(self, local: jax.Array) -> tuple[Linearised, Trajectories]:
        """Residuals and slopes with the motion behind them, from the values of each record, ``(n_record, n_local)``.

        One program for both: the integrator is what takes long to compile.
        """
        # One after the other: what belongs to one record stays in the fast memory of a processor.
        return jax.lax.map(lambda row: self.evaluate_record(*row), (local, self.observations))

    @kept_program
    def trajectories_at(self, local: jax.Array) -> Trajectories:
        """The motion alone, from the values of each record, ``(n_record, n_local)`` in SI units."""

        def one(row: tuple[jax.Array, Observations]) -> Trajectories:
            local, data = row
            return self._moved(local, data.experiment, self._respond(local, data.experiment))

        return jax.lax.map(one, (local, self.observations))

    @kept_program
    def evaluate_record(self, local: jax.Array, data: Observations) -> tuple[Linearised, Trajectories]:
        """As `evaluate_at`, of one record, from its values ``(n_local,)`` and its data."""
        columns = jnp.array(self.layout.local_free, dtype=int)

        def move(part: jax.Array) -> tuple[jax.Array, tuple[jax.Array, Response]]:
            response = self._respond(local.at[columns].set(part), data.experiment)
            residuals = self._residuals_of(response, data)
            return residuals, (residuals, response)

        slopes, (residuals, response) = jax.jacfwd(move, has_aux=True)(local[columns])
        return Linearised(residuals, slopes), self._moved(local, data.experiment, response)

    def gram(self, values: jax.Array) -> jax.Array:
        """Products of all columns of the Jacobian and the residuals, ``[J r]' [J r]``, beliefs among the residuals.

        All that Gauss-Newton methods, profiles and plain covariances need of the records, in a matrix of the size of
        the problem.

        Parameters
        ----------
        values : (n_free,) in SI units

        Returns
        -------
        (n_free + 1, n_free + 1), per SI units of the values
        """

        def one(row: tuple[jax.Array, Observations]) -> jax.Array:
            linear, _ = self.evaluate_record(*row)
            columns = jnp.concatenate([linear.slopes, linear.residuals[..., None]], axis=-1)
            columns = columns.reshape(-1, columns.shape[-1])
            return column_products(columns, columns)

        local = jax.lax.map(one, (self.layout.local(values), self.observations))
        size, index = self.layout.size, self.layout.local_columns
        rows = jnp.concatenate([index, jnp.full((index.shape[0], 1), size)], axis=1)
        return assembled(local, rows, size + 1) + self.layout.prior_gram(values)

    def until(self, counts: Any) -> Problem:
        """The problem of the first ``counts`` samples ``(n_record,)`` of each record."""
        data = self.observations
        xp = functions_for(counts)
        counts = xp.minimum(counts, data.experiment.count)
        early = xp.arange(data.experiment.times.shape[1]) < counts[:, None]
        weight = {c: xp.where(early, w, 0.0) for c, w in data.weight.items()}
        shorter = data._replace(experiment=data.experiment._replace(count=counts), weight=weight)
        return eqx.tree_at(lambda problem: problem.observations, self, shorter)

    def shortened(self, samples: int) -> Problem:
        """The problem in arrays of the first `samples` of each record: a program of its own, that takes less time.

        Not inside compiled programs.
        """
        data = self.observations
        count = np.minimum(np.asarray(data.experiment.count), samples)
        cut = partial(jax.tree.map, lambda rows: jax.device_put(np.asarray(rows)[:, :samples]))
        experiment = data.experiment._replace(
            times=cut(data.experiment.times), count=jax.device_put(count), inputs=cut(data.experiment.inputs)
        )
        fewer = data._replace(experiment=experiment, measured=cut(data.measured), weight=cut(data.weight))
        return eqx.tree_at(lambda problem: problem.observations, self, fewer)

    @property
    def n_measured(self) -> int:
        """Number of samples that count; not inside compiled programs."""
        return int(sum(np.count_nonzero(np.asarray(weight)) for weight in self.observations.weight.values()))

    def _respond(self, local: jax.Array, experiment: Experiment) -> Response:
        return self.model.respond(dict(zip(self.layout.names, local, strict=True)), experiment)

    def record_residuals(self, local: jax.Array, data: Observations) -> jax.Array:
        """Residuals ``(n_channel, n_time)`` of one record from its values ``(n_local,)`` and its data."""
        return self._residuals_of(self._respond(local, data.experiment), data)

    def _moved(self, local: jax.Array, experiment: Experiment, response: Response) -> Trajectories:
        solution = response.solution
        fibres = self.model.stretched(dict(zip(self.layout.names, local, strict=True)), experiment, solution)
        return Trajectories(response.channels, solution.states, solution.modes, solution.trouble, fibres)

    def _residuals_of(self, response: Response, data: Observations) -> jax.Array:
        channels, jumps = self.model.rig.channels, response.jumps
        distances = jnp.stack([response.channels[c] - data.measured[c] for c in channels])
        heights = jnp.stack([jumps.heights[c] for c in channels])
        near = nearest_side(data.experiment.times, distances, jumps.instants, heights, jumps.number)
        in_units = []
        for channel, distance in zip(channels, near, strict=True):
            weight, steps = data.weight[channel], data.steps.get(channel)
            in_units.append(
                distance * weight if steps is None else step_residuals(distance, steps) * (weight * steps.level)
            )
        plain = jnp.stack(in_units)
        if self.soft_beyond is None:
            return plain
        # The square of this is the soft-L1 loss; near zero it is the residual itself.
        limit = self.soft_beyond
        share = jnp.sqrt(1.0 + (plain / limit) ** 2)
        return plain * jnp.sqrt(2.0 / (share + 1.0))

    def values_elsewhere(
        self, row: np.ndarray, before: Mapping[str, Any], after: Mapping[str, Any], chosen: Mapping[str, float]
    ) -> np.ndarray:
        """Values of a record at hand as they are in a further one like it, taken under other conditions.

        A condition that is a value of each record is the one that is chosen, and the start is that of a rig at rest.

        Parameters
        ----------
        row : (n_local,) in SI units
            Of the record at hand.
        before, after : mapping of str to float, in SI units
            Conditions of that record as stated, and of the further one.
        chosen : mapping of str to float, in SI units
            Those conditions of the further one that are chosen.

        Returns
        -------
        (n_local,) in SI units
        """

        def at_rest(values: np.ndarray, stated: Mapping[str, Any]) -> Mapping[str, float]:
            """Nuisances by which the rig would start at rest under the conditions that a model has in a record."""
            if (planned := self.model.rig.planned) is None:
                return {}
            named = dict(zip(self.layout.names, values, strict=True))
            return planned(corrected_conditions(dict(stated), named, self.model.laws(named)))

        names, values = self.layout.names, row.copy()
        started = at_rest(row, before)
        for name, value in chosen.items():
            if name in names:
                values[names.index(name)] = value
        for name, value in at_rest(values, after).items():
            if name in names:
                j = names.index(name)
                limits = self.layout.slots[j].range
                values[j] = np.clip(values[j] + value - started[name], limits.lower, limits.upper)
        return values


class _Remembered(NamedTuple):
    """A problem, the bytes of a place ``(n_record, n_local)``, and what was found there."""

    problem: weakref.ref[Problem]
    place: bytes
    found: tuple[Linearised, Trajectories]


_ONE = "last"
_LAST: dict[str, _Remembered] = {}


def _forget(problem: weakref.ref[Problem]) -> None:
    """Let go of what a problem said that is there no more."""
    known = _LAST.get(_ONE)
    if known is not None and known.problem is problem:
        _LAST.pop(_ONE, None)
