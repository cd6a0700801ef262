"""Tangents of a motion: the same however they are asked for, and those of its differences."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import Experiment, Model
from fibrefit.simulation.sensitivity import MANY
from tests.simulation.drops import OF_RIG, QUICK, drive, drop, given, jacobian, kind_of, respond

#: The same formulas in another program: sums are taken in another order.
SAME = 1e-9
#: Central differences of readings that are good to rounding.
AS_DIFFERENCES = 2e-6
#: With a memory, the derivatives of the true flow, which ours are, differ from those of the steps by their error.
AS_THE_FLOW = 3e-4

NAMES = ("stiffness", "damping", "friction", "release", "position_zero")
BRANCH = "fibre.maxwell_branch"


def readings(samples: int = 801) -> Callable[[jax.Array], jax.Array]:
    """Both channels of a drop that bounces, sticks and rests, from its values in the order of `NAMES`."""
    model, experiment = Model(RIGS["fibre_mass"]), drop(samples)

    def channels(values: jax.Array) -> jax.Array:
        found = model.respond(dict(zip(NAMES, values, strict=True)), experiment).channels
        return jnp.stack([found["force"] / 100.0, found["position"] / 0.01])

    return channels


def lanes(number: int = 3) -> jax.Array:
    point = jnp.array([2e4, 25.0, 4.0, 0.01, 1e-3])
    return point * jnp.linspace(0.8, 1.2, number)[:, None]


def close(found: jax.Array, expected: jax.Array) -> bool:
    size = jnp.max(jnp.abs(expected), axis=tuple(range(expected.ndim - 1)))
    return bool(jnp.all(jnp.abs(found - expected) <= SAME * size))


@pytest.fixture(scope="module")
def one_by_one() -> jax.Array:
    slopes = jax.jit(jax.jacfwd(readings()))
    return jnp.stack([slopes(row) for row in lanes()])


@pytest.mark.parametrize("nested", ["vmap of jacfwd", "map of jacfwd", "vmap of a compiled jacfwd", "jacfwd of vmap"])
def test_a_batch_of_jacobians_is_each_of_them(one_by_one: jax.Array, nested: str) -> None:
    one = readings()
    slopes = jax.jacfwd(one)
    if nested == "jacfwd of vmap":
        # Rows depend on their own values only: moving all rows alike gives the slopes of each.
        found = jax.jit(jax.jacfwd(lambda d: jax.vmap(one)(lanes() + d)))(jnp.zeros(len(NAMES)))
    elif nested == "map of jacfwd":
        found = jax.jit(lambda rows: jax.lax.map(slopes, rows))(lanes())
    else:
        found = jax.jit(jax.vmap(jax.jit(slopes) if "compiled" in nested else slopes))(lanes())
    assert close(found, one_by_one)


@pytest.mark.parametrize("number", [1, 2, 4, 7, MANY + 3])
def test_any_number_of_tangents_is_carried(one_by_one: jax.Array, number: int) -> None:
    point, directions = lanes()[0], jnp.eye(len(NAMES))[jnp.arange(number) % len(NAMES)] * lanes()[0]
    push = jax.jit(jax.vmap(lambda d: jax.jvp(readings(), (point,), (d,))[1]))
    assert close(jnp.moveaxis(push(directions), 0, -1), one_by_one[0] @ directions.T)


@pytest.mark.slow
@pytest.mark.parametrize("effect", [None, pytest.param("pulley.inertia", marks=pytest.mark.slow)])
def test_many_tangents_of_an_input_are_those_of_a_few(effect: str | None) -> None:
    effects = (CATALOGUE[effect],) if effect else ()
    model, experiment = Model(RIGS["pulley_drive"], effects), drive(401, QUICK)
    values = given(OF_RIG["pulley_drive"] | ({"pulley.inertia.rim_mass": 0.02} if effect else {}))

    def channels(stiffness: jax.Array, signal: Signals) -> jax.Array:
        there = experiment._replace(inputs={"drive": signal})
        found = model.respond({**values, "stiffness": stiffness}, there).channels
        return jnp.stack([found["force"] / 100.0, found["position"] / 0.01])

    def along(stiffness: jax.Array, wave: Signals) -> jax.Array:
        here = (values["stiffness"], experiment.inputs["drive"])
        return jax.jvp(channels, here, (stiffness, wave))[1]

    pace = 30.0 * jnp.arange(1, MANY + 2)[:, None]
    coefficients = Signals(1e-4 * jnp.cos(pace * experiment.times), -1e-4 * pace * jnp.sin(pace * experiment.times))
    tangents = jnp.where(jnp.arange(MANY + 1) % 5 == 0, 100.0, 0.0), coefficients
    many = jax.jit(jax.vmap(along))(*tangents)
    few = jax.jit(lambda tangents: jax.lax.map(lambda row: along(*row), tangents))(tangents)
    assert close(jnp.moveaxis(many, 0, -1), jnp.moveaxis(few, 0, -1))


def test_a_single_tangent_without_a_batch(one_by_one: jax.Array) -> None:
    point = lanes()[1]
    found = jax.jit(lambda d: jax.jvp(readings(), (point,), (d,))[1])(point)
    assert close(found[..., None], (one_by_one[1] @ point)[..., None])


def test_the_padding_of_a_record_changes_nothing() -> None:
    short, long = drop(801), drop(1601)
    padded = long._replace(count=jnp.int32(801))
    mine, theirs = jacobian(short), jacobian(padded)
    for channel, columns in mine.items():
        for name, column in columns.items():
            np.testing.assert_allclose(theirs[channel][name][:801], column, rtol=1e-12, atol=1e-12)


def differences(experiment: Experiment, effects: tuple, name: str, **values: float) -> dict[str, np.ndarray]:
    value = (OF_RIG[kind_of(experiment)] | values)[name]
    step = 1e-5 * (abs(value) or 1e-3)
    up, down = (respond(experiment, effects, **(values | {name: value + side})) for side in (step, -step))
    return {channel: (up[channel] - down[channel]) / (2.0 * step) for channel in up}


def agree(found: np.ndarray, expected: np.ndarray, within: float = AS_DIFFERENCES) -> bool:
    # A sample on the other side of a jump differs by its height; there are few of those.
    away = np.sort(np.abs(found - expected))[: -max(len(found) // 50, 1)]
    return bool(away.max() <= within * np.abs(expected).max())


@pytest.mark.parametrize("name", ["stiffness", "damping", "friction", "release"])
def test_slopes_go_on_at_rest(name: str) -> None:
    """The weight rests after half a second: nothing moves there, but where it rests depends on everything before."""
    experiment = drop(2401)
    found, expected = jacobian(experiment), differences(experiment, (), name)
    rest = np.asarray(respond(experiment)["position"])
    assert (rest[1600:] == rest[-1]).all()
    for channel, column in expected.items():
        assert agree(found[channel][name], column)
    assert (found["position"][name][1600:] == found["position"][name][-1]).all()


@pytest.mark.parametrize("parameter", ["stiffness", f"{BRANCH}.relaxation_time"])
def test_slopes_go_on_while_a_memory_fades_in_a_weight_at_rest(parameter: str) -> None:
    effects, experiment = (CATALOGUE[BRANCH],), drop(2401)
    values = {f"{BRANCH}.{p.name}": p.typical for p in CATALOGUE[BRANCH].parameters}
    values[f"{BRANCH}.relaxation_time"] = 0.05
    found, expected = jacobian(experiment, effects, **values), differences(experiment, effects, parameter, **values)
    for channel, column in expected.items():
        assert agree(found[channel][parameter], column, AS_THE_FLOW)
    late = found["force"][parameter][1800:]
    # The reading creeps on where the weight is at rest: the shortcut for rest must not take it for still.
    assert len(np.unique(late)) > len(late) // 2


@pytest.mark.parametrize("name", ["stiffness", "friction", "start_tension"])
def test_a_drive_wakes_a_weight_at_rest(name: str) -> None:
    """It rests before the drive moves and at every turn: rest there is none of the kind that lasts."""
    experiment = drive(801, QUICK)
    found, expected = jacobian(experiment), differences(experiment, (), name)
    for channel, column in expected.items():
        assert agree(found[channel][name], column)


def test_tangents_of_a_measured_drive_are_carried() -> None:
    experiment, values = drive(401, QUICK), given(OF_RIG["pulley_drive"])
    model = Model(RIGS["pulley_drive"])

    def force(more: jax.Array) -> jax.Array:
        signal = jax.tree.map(lambda column: column * (1.0 + more), experiment.inputs["drive"])
        return model.respond(values, experiment._replace(inputs={"drive": signal})).channels["force"]

    found, force = np.asarray(jax.jit(jax.jacfwd(force))(jnp.zeros(()))), jax.jit(force)
    assert agree(found, np.asarray(force(1e-6) - force(-1e-6)) / 2e-6)
    assert np.abs(found).max() > 1.0
