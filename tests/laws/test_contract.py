"""What every effect of the catalogue has to keep; a new line there is tested by being there.

What a law of a user's own has to keep as well, declarations, finite values and slopes, and nothing at its null, is
tested of the catalogue in `test_own`.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterable, Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.core.programs import fingerprint
from fibrefit.laws.catalogue import CATALOGUE, find_effect, select_effects, suits
from fibrefit.laws.families import members
from fibrefit.laws.fibre.point_masses import point_masses
from fibrefit.laws.law import (
    DriveLaw,
    Effect,
    FibreLaw,
    GuideLaw,
    PivotLaw,
    PulleyLaw,
    RigLaw,
    SensorLaw,
    StudyLaw,
)
from fibrefit.laws.pushes import PushLaw
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.effects import sections
from fibrefit.rigs.parts.fibre import LOADED, SLACK, Fibre
from fibrefit.simulation.model import Experiment, Model
from tests.simulation.drops import QUICK, dotted, drive, drop, given, jacobian, pendulum, pushed, respond, swung, usual

EFFECTS = [pytest.param(effect, id=name) for name, effect in CATALOGUE.items()]
FIBRE_LAWS = [pytest.param(effect, id=name) for name, effect in CATALOGUE.items() if issubclass(effect, FibreLaw)]
GUIDE_LAWS = [pytest.param(effect, id=name) for name, effect in CATALOGUE.items() if issubclass(effect, GuideLaw)]


def on(kind: str, effects: Iterable[type[Effect]]) -> list[Any]:
    """One case for each effect on a rig, with what it needs."""
    return [
        pytest.param(kind, (*(CATALOGUE[other] for other in effect.needs), effect), id=f"{kind}-{effect.name}")
        for effect in effects
        if suits(effect, RIGS[kind])
    ]


def rigs_of(effect: type[Effect]) -> list[str]:
    """Kinds of rig an effect makes sense on."""
    return [kind for kind, rig in RIGS.items() if suits(effect, rig)]


PULLEYS = [effect for effect in CATALOGUE.values() if not suits(effect, RIGS["fibre_mass"])]
OTHERS = [effect for effect in CATALOGUE.values() if suits(effect, RIGS["fibre_mass"])]
ON_RIGS = [*on("fibre_mass", OTHERS), *on("pulley_drive", PULLEYS)]
#: Effects that act on what neither of those rigs has.
ELSEWHERE = [effect for effect in PULLEYS if not suits(effect, RIGS["pulley_drive"])]
ON_RIGS += [*on("guided_mass", ELSEWHERE), *on("pendulum", ELSEWHERE)]
ON_RIGS += [pytest.param(*case.values, id=case.id, marks=pytest.mark.slow) for case in on("pulley_drive", OTHERS)]
ON_RIGS += [
    pytest.param(*case.values, id=case.id, marks=pytest.mark.slow)
    for case in on("inverted_pendulum", CATALOGUE.values())
]
EVERYWHERE = [case for kind in RIGS for case in on(kind, CATALOGUE.values())]
QUICK_SINGULAR = ("fibre_mass-guide.presliding",)
SINGULAR = [
    pytest.param(*case.values, id=case.id, marks=() if case.id in QUICK_SINGULAR else pytest.mark.slow)
    for case in EVERYWHERE
    if case.values[1][-1].singular
]
#: Laws composed at once: neither those that are stiff or change in time, nor those that bend without end at rest, where
#: the derivative of all others is that of the flow and not that of the step (0.5 to 1.4 % apart).
GROUPS = {
    port: tuple(
        e
        for n, e in CATALOGUE.items()
        if n.startswith(port) and not (e.stiff or e.timed or n.endswith("_speed_exponent"))
    )
    for port in ("guide", "fibre", "sensor")
}

#: Rounding of a function evaluated inside another program, relative to its size.
SAME = 1e-12
#: Greatest change of a reading over its range, from which on it is more than rounding.
TRACE = 1e-6
#: Work done over a cycle may be negative by the error of its quadrature only, relative to the work of the stiffness.
QUADRATURE = 1e-6
#: Differences of a force solved to 1e-7 of its range, against derivatives.
DIFFERENCES = 1e-3
#: The same for many effects at once, each with a kink at reversals.
COMPOSED = 3e-3
#: The same where the derivative is not that of the step, but of the flow the step follows.
STIFF = 5e-3
#: Share of samples that no jump of the reading runs across when a parameter is changed a little.
JUMPS = 0.98
#: Slope, in SI units, below which nothing depends on a parameter.
NOTHING = 1e-12
#: Cosine between the slope at the null and the change that a typical strength makes.
ALIKE = 0.9
#: At its null this law is not told when a fibre without load is still stretched; a few late bounces differ by that.
AT_NULL = {
    "fibre.hysteresis.hysteretic_stiffness": 5e-2,
    # The step that holds their instant is not taken apart while nothing happens there.
    "fibre.knot_slip.slip": 5e-3,
    "fibre.stiffness_step.change": 5e-3,
    "guide.friction_step.change": 5e-3,
}

#: What the points of a fibre take from the weight at a snap is over in a small part of a step; and a power below one
#: bends within a millimetre a second, which the steps cut short.
ROUGH = {
    "fibre.mass.fibre_mass": 3e-2,
    "fibre.stiffness_power_law.change": 2e-3,
    "fibre.stiffness_speed_exponent.exponent": 1e-2,
    "guide.friction_speed_exponent.exponent": 1e-2,
}

STRETCHES = (-1e-3, 0.0, 1e-5, 2e-3)
SPEEDS = (-0.5, -1e-3, 0.0, 1e-3, 0.5)
#: Conditions that a study states, any of which may be wrong.
STATED = sorted({condition.name for rig in RIGS.values() for condition in rig.conditions})


def law_at(effect: type[Effect], choose: str) -> Any:
    values = given({name.rpartition(".")[2]: value for name, value in dotted((effect,), choose).items()})
    return effect(**values)


def answers(law: Any, x: jax.Array, v: jax.Array) -> dict[str, Any]:
    """All a law has to say at one instant: position or stretch `x`, speed or rate `v`."""
    one = jnp.ones(())
    if isinstance(law, FibreLaw):
        memory = tuple(0.3 * x for _ in law.memory)
        return {
            "slack": law.initial_slack(),
            "stiffness": law.stiffness_factor(x, v),
            "damping": law.damping_factor(x, v),
            "tension": law.tension(20e3 * one, x, v, memory),
            "memory": law.memory_rate(x, v, memory, jnp.array(False)),
            "at rest": law.memory_at_rest(x),
            "slack again": law.when_slack(memory),
        }
    if isinstance(law, GuideLaw):
        levels = {f"friction {s}": law.friction(4.0 * one, s * one, v, 30.0 * one) for s in (-1, 1)}
        return levels | {
            "viscosity": law.viscosity(),
            "factor": law.viscosity_factor(v),
            "force": law.force(x, v),
            "compliance": law.compliance(),
            "bristles": law.bristle_damping_coefficient(),
            "loose": law.loose(),
        }
    if isinstance(law, PulleyLaw):
        return {"inertia": law.inertia(), "rubbing": law.rubbing(), "grip": law.grip(2.6 * one, v)}
    if isinstance(law, DriveLaw):
        course = law.passed_on(x * jnp.arange(3.0), v * jnp.ones(3))
        return {"travel": law.travel(x, v, 0.04 * one), "compliance": law.compliance(), "passed on": course}
    if isinstance(law, PushLaw):
        return {"applied": law.applied(x * jnp.arange(3.0), v * jnp.ones(3), 0.01 * jnp.arange(3.0))}
    if isinstance(law, PivotLaw):
        return {"torque": law.torque(x, v)}
    if isinstance(law, SensorLaw):
        told = {name: jnp.ones(3) for name in ("force", "position", *law.feels)}
        readings = law.measure({name: x * one for name, one in told.items()}, jnp.arange(3.0))
        return {"readings": readings, "late": law.late_by(), "lags": law.lags()}
    if isinstance(law, RigLaw):
        known = dict.fromkeys(STATED, x + one)
        return {"known": law.correct(known), "pace": law.pace() if isinstance(law, StudyLaw) else one}
    raise AssertionError(f"{type(law).__name__} is asked nothing")


@pytest.mark.parametrize("effect", EFFECTS)
def test_docstring_has_its_sections(effect: type[Effect]) -> None:
    text = inspect.cleandoc(effect.__doc__ or "")
    for section in ("Law", "Valid range", "Source"):
        assert re.search(rf"^{section}\n-+\n\S", text, re.MULTILINE), f"no section {section}"
    law = sections(effect)["Law"]
    assert all(parameter.symbol in law for parameter in effect.parameters)
    assert all(parameter.symbol for parameter in effect.parameters if parameter.name in effect.strength)


@pytest.mark.parametrize("effect", EFFECTS)
def test_name_finds_its_effect_again(effect: type[Effect]) -> None:
    assert find_effect(effect.name) is effect
    for kind in rigs_of(effect):
        names = [parameter.name for parameter in Model(RIGS[kind], (effect,)).parameters]
        assert [f"{effect.name}.{p.name}" for p in effect.parameters] == names[-len(effect.parameters) :]


@pytest.mark.parametrize("effect", EFFECTS)
def test_programs_with_an_effect_are_kept(effect: type[Effect]) -> None:
    """They are found again by what is in them; a class made by a function says in `_made_of` what that is."""
    everywhere = members(effect, 3)
    assert len({fingerprint(one) for one in everywhere}) == len(everywhere)


def test_a_number_of_point_masses_has_programs_of_its_own() -> None:
    assert fingerprint(point_masses(1)) != fingerprint(point_masses(3)) == fingerprint(point_masses(3))


@pytest.mark.parametrize("effect", EFFECTS)
def test_effect_fits_its_rigs_and_no_others(effect: type[Effect]) -> None:
    assert rigs_of(effect)
    for kind, rig in RIGS.items():
        names = [*effect.needs, effect.name + "@2" * bool(effect.family)]
        if suits(effect, rig):
            assert select_effects(names, rig)[-1] is find_effect(names[-1])
        else:
            with pytest.raises(StudyError, match=f"makes no sense on the rig {kind}"):
                select_effects(names, rig)


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_law_is_absent_at_its_null_and_there_otherwise(effect: type[Effect]) -> None:
    assert law_at(effect, "null").absent()
    assert not law_at(effect, "typical").absent()


@pytest.mark.parametrize("effect", EFFECTS)
def test_compiled_batched_and_plain_agree(effect: type[Effect]) -> None:
    law = law_at(effect, "typical")
    x, v = (grid.ravel() for grid in jnp.meshgrid(jnp.array(STRETCHES), jnp.array(SPEEDS)))
    batched = jax.vmap(answers, (None, 0, 0))(law, x, v)
    compiled = jax.jit(answers)
    for i in range(x.size):
        plain = answers(law, x[i], v[i])
        for other in (compiled(law, x[i], v[i]), jax.tree.map(lambda leaf, i=i: leaf[i], batched)):
            jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=SAME, atol=SAME), plain, other)


@pytest.mark.parametrize("tension_law", ["clamped", "heaviside"])
@pytest.mark.parametrize("effect", FIBRE_LAWS)
def test_a_fibre_that_is_short_goes_slack_stays_so_and_carries_nothing(
    effect: type[FibreLaw], tension_law: str
) -> None:
    fibre = Fibre(jnp.asarray(20e3), jnp.asarray(25.0), (law_at(effect, "typical"),), tension_law)
    loaded, slack = jnp.int32(LOADED), jnp.int32(SLACK)
    # A law may bring a slack of its own.
    free_length = -fibre.stretch(jnp.zeros(()))
    long, short = free_length + 2e-3, free_length - 1e-3
    stretched = fibre.memories(long)
    for v in map(jnp.asarray, SPEEDS):
        assert fibre.margin(short, v, stretched, loaded) < 0.0
        memories, mode = fibre.switch(short, v, stretched, loaded, jnp.array(True))
        assert mode == slack
        assert fibre.margin(short, v, memories, mode) > 0.0
        assert fibre.tension(short, v, memories, mode) == 0.0
    # The negative control: a fibre that rests where it is long.
    assert fibre.margin(long, jnp.zeros(()), stretched, loaded) > 0.0
    assert fibre.margin(long, jnp.zeros(()), stretched, slack) < 0.0
    assert fibre.tension(long, jnp.zeros(()), stretched, loaded) > 0.0


@pytest.mark.parametrize("effect", GUIDE_LAWS)
def test_friction_takes_energy_out(effect: type[GuideLaw]) -> None:
    law = law_at(effect, "typical")
    rest = law.force(jnp.zeros(()), jnp.zeros(()))
    for v in SPEEDS:
        speed = jnp.asarray(v)
        for sign in (-1.0, 1.0):
            assert 4.0 + law.friction(jnp.asarray(4.0), jnp.asarray(sign), speed, jnp.asarray(30.0)) >= 0.0
        # A push that does not depend on speed stores energy and gives it back.
        assert (law.force(jnp.zeros(()), speed) - rest) * speed >= 0.0
        assert law.viscosity() >= 0.0
        assert law.viscosity_factor(speed) >= 0.0


@pytest.mark.parametrize("effect", FIBRE_LAWS)
def test_a_cycle_of_stretching_takes_energy_out(effect: type[FibreLaw]) -> None:
    fibre = Fibre(jnp.asarray(20e3), jnp.asarray(25.0), (law_at(effect, "typical"),))
    size, steps, cycles = 1e-3, 20_000, 6

    def last_cycle(frequency: jax.Array) -> jax.Array:
        """Work done on the fibre in the last of several cycles."""
        omega, span = 2 * np.pi * frequency, cycles / frequency / steps

        def step(carry: Any, time: jax.Array) -> Any:
            memories, work = carry
            length, rate = size * (1.5 - jnp.cos(omega * time)), size * omega * jnp.sin(omega * time)
            change = fibre.memory_rates(length, rate, memories, jnp.int32(1))
            memories = jax.tree.map(lambda m, d: m + d * span, memories, change)
            return (memories, work + span * rate * fibre.pull(length, rate, memories)), work

        begun = fibre.memories(jnp.asarray(0.5 * size)), jnp.zeros(())
        (_, work), history = jax.lax.scan(step, begun, span * jnp.arange(steps))
        return work - history[-steps // cycles]

    work = jax.vmap(last_cycle)(jnp.array([0.5, 10.0, 150.0]))
    assert np.all(np.asarray(work) > -QUADRATURE * 20e3 * size**2)


RECORDS = {
    # A mass is added, so that its error shows.
    "fibre_mass": lambda: drop(801, added_mass=0.5),
    "pulley_drive": lambda: drive(801, QUICK, added_mass=0.5),
    # Without a preload both fibres would begin on a switch.
    "inverted_pendulum": lambda: pendulum(801, preload=20.0),
    "guided_mass": lambda: pushed(801),
    "pendulum": lambda: swung(801),
}


def records(kind: str) -> Experiment:
    return RECORDS[kind]() if kind in RECORDS else usual(kind)


@pytest.mark.parametrize(("kind", "effects"), ON_RIGS)
def test_at_its_null_an_effect_leaves_no_trace_in_any_bit(kind: str, effects: tuple[type[Effect], ...]) -> None:
    others = dotted(effects[:-1], "typical")
    without = respond(records(kind), effects[:-1], **others)
    found = respond(records(kind), effects, **others, **dotted(effects[-1:], "null"))
    for role, reading in without.items():
        assert np.array_equal(found[role], reading), f"{np.sum(found[role] != reading)} readings of {role} differ"


@pytest.mark.parametrize(("kind", "effects"), ON_RIGS)
def test_a_typical_effect_does_leave_a_trace(kind: str, effects: tuple[type[Effect], ...]) -> None:
    without = respond(records(kind), effects[:-1], **dotted(effects[:-1], "typical"))
    found = respond(records(kind), effects, **dotted(effects, "typical"))
    changes = [np.abs(found[role] - reading).max() / np.ptp(reading) for role, reading in without.items()]
    assert np.isfinite(changes).all()
    assert max(changes) > TRACE


@pytest.mark.slow
@pytest.mark.parametrize("kind", RIGS)
def test_all_effects_at_once_leave_no_trace_at_their_nulls(kind: str) -> None:
    effects = tuple(effect for effect in CATALOGUE.values() if suits(effect, RIGS[kind]))
    found, without = respond(records(kind), effects, **dotted(effects, "null")), respond(records(kind))
    for role, reading in without.items():
        assert np.array_equal(found[role], reading)


def slopes_and_differences(
    kind: str, effects: tuple[type[Effect], ...], choose: str
) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Parameter, channel, derivative and difference, at null or typical values; only where both are smooth."""
    values, record = dotted(effects, choose), records(kind)
    if kind == "fibre_mass" and any(
        effect.name.endswith(("inclination_error", "study.inclination")) for effect in effects
    ):
        # Straight down, where a drop is steepest, its error has no slope.
        record = drop(801, added_mass=0.5, inclination=1.0)
    exact = jacobian(record, effects, **values)
    for effect in effects:
        for p in effect.parameters:
            name, at_null = f"{effect.name}.{p.name}", choose == "null" and p.name in effect.strength
            if at_null and (effect.singular or p.reciprocal):
                continue
            size = 1e-6 * abs(p.typical)
            # A strength at its null may have a slope on one side only.
            low = 0.0 if values[name] == p.lower else -size
            up, down = (respond(record, effects, **(values | {name: values[name] + d})) for d in (size, low))
            for role, columns in exact.items():
                yield name, role, columns[name], (up[role] - down[role]) / (size - low)


def relative_error(slope: np.ndarray, difference: np.ndarray) -> float:
    """Root mean square of the error over that of the slope; a difference across a jump of the reading is no slope."""
    error = np.abs(slope - difference)
    smooth = error <= np.quantile(error, JUMPS)
    # A slope that is zero may be a difference of equal terms.
    scale = max(np.sqrt(np.mean(slope**2)), NOTHING)
    return float(np.sqrt(np.mean(error[smooth] ** 2)) / scale)


@pytest.mark.slow
@pytest.mark.parametrize("choose", ["null", "typical"])
@pytest.mark.parametrize("port", ["guide", "fibre", "sensor"])
def test_derivatives_of_composed_effects_are_those_of_the_readings(port: str, choose: str) -> None:
    for name, role, slope, difference in slopes_and_differences("fibre_mass", GROUPS[port], choose):
        allowed = AT_NULL.get(name, COMPOSED) if choose == "null" else COMPOSED
        assert np.isfinite(slope).all()
        assert relative_error(slope, difference) < allowed, f"d {role} / d {name}"


@pytest.mark.slow
@pytest.mark.parametrize("choose", ["null", "typical"])
@pytest.mark.parametrize(("kind", "effects"), EVERYWHERE)
def test_derivatives_are_those_of_the_readings(kind: str, effects: tuple[type[Effect], ...], choose: str) -> None:
    # At the null of a parameter that a law needs, the law itself has no slope.
    others = effects[:-1] if choose == "null" else ()
    for name, role, slope, difference in slopes_and_differences(kind, effects, choose):
        allowed = (AT_NULL if choose == "null" else ROUGH).get(
            name, STIFF if any(e.stiff for e in effects) else DIFFERENCES
        )
        assert np.isfinite(slope).all()
        if not any(name.startswith(other.name) for other in others):
            assert relative_error(slope, difference) < allowed, f"d {role} / d {name}"


@pytest.mark.parametrize(("kind", "effects"), SINGULAR)
def test_the_slope_of_a_singular_effect_at_its_null_points_where_it_goes(
    kind: str, effects: tuple[type[Effect], ...]
) -> None:
    (effect,), record = effects, records(kind)
    (p,) = (p for p in effect.parameters if p.name in effect.strength)
    name, none = f"{effect.name}.{p.name}", dotted(effects, "null")
    role = "angle" if kind == "inverted_pendulum" else "position"
    slope = jacobian(record, effects, **none)[role][name]
    there = respond(record, effects, **dotted(effects, "typical"))[role]
    change = there - respond(record, effects, **none)[role]
    assert np.isfinite(slope).all()
    assert slope @ change / np.linalg.norm(slope) / np.linalg.norm(change) > ALIKE
    # It is that of a small strength, and no other part of it.
    size = effect.singular / p.typical if p.reciprocal else effect.singular * p.typical
    small = respond(record, effects, **none | {name: 1.0 / size if p.reciprocal else p.null + size})[role]
    difference = (small - respond(record, effects, **none)[role]) / size
    assert np.linalg.norm(slope - difference) < 1e-6 * np.linalg.norm(difference)


def test_the_contract_sees_a_law_that_leaves_a_trace() -> None:
    class Leaky(CATALOGUE["guide.viscous_friction"]):  # type: ignore[misc, name-defined]
        """A law that adds a last bit at its null."""

        def viscosity(self) -> jax.Array:
            return self.viscous_coefficient + 1e-13

    found, without = respond(drop(), (Leaky,), **dotted((Leaky,), "null")), respond(drop())
    assert not np.array_equal(found["position"], without["position"])


def test_effects_are_pytrees_that_know_their_values() -> None:
    for effect in CATALOGUE.values():
        law = law_at(effect, "typical")
        assert [p.name for p in effect.parameters] == [field.name for field in dataclasses.fields(effect)]
        assert len(jax.tree.leaves(law)) == len(effect.parameters)
        assert eqx.tree_equal(law, jax.tree.map(lambda leaf: leaf, law))
