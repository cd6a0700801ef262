"""What every law has to keep, of the catalogue or a user's own: a right declaration, finite values, none at its null.

What can be seen without asking a law anything, its port, its name, its parameters and its methods, comes first.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import ByInverse, Capability, Parameter
from fibrefit.core.errors import StudyError, did_you_mean
from fibrefit.core.units import is_si
from fibrefit.laws.law import HISTORY_OF_MOTION, Effect
from fibrefit.laws.ports import ANNOUNCED, PORTS, hooks_of, overridden_hooks, port_of

MOVED = {
    "rigs": "Name what the rig must have in acts_on, a set of Capability.",
    "sought": "A search tries an effect of your own where you name it in also.",
    "costly": "Take it out: a search asks it of its own catalogue only.",
    "like": "Take it out: a search asks it of its own catalogue only.",
    "worn": 'Write history = ("path",) for what depends on the path travelled.',
}
"""Attributes of laws that have no meaning there any more."""
AT_ONCE = ("sensor", "push", "rig", "study")
"""Ports whose laws are asked once for a whole record, and no moment of it."""
KINDS = "a subclass of GuideLaw, FibreLaw, PulleyLaw, DriveLaw, PushLaw, PivotLaw, SensorLaw or RigLaw"
PLACES = (-1e-3, 0.0, 1e-5, 2e-3)
SPEEDS = (-0.5, -1e-3, 0.0, 1e-3, 0.5)
"""Where a law is tried, in m and m/s: positions or stretches, and their rates; among them all places of switching."""
FAR = 0.1
"""Further position or stretch on either side, in m: a law may act far out alone, as a stop does."""
SET: dict[str, Any] = {"coulomb": 4.0, "tension": 30.0, "stiffness": 20e3, "wrap_angle": 2.6, "radius": 0.04}
"""What else hooks are given, in SI units."""
SAMPLES = 3
WITHOUT_A_TRACE = ("memory_rate", "memory_at_rest", "when_slack", "bristle_damping_coefficient", "loose")
"""Hooks whose answer means nothing by itself: another one must be zero."""
FOR_ARRAYS = "Laws are compiled: write jnp.where(condition, a, b) for `if`, and jnp for math and np."


def refusals(effect: type[Effect], where: str) -> Iterator[StudyError]:
    """Reasons for which no model can hold an effect, as errors that are not raised.

    Parameters
    ----------
    effect : Effect class
    where : str
        How messages name it.
    """
    title = getattr(effect, "name", "")
    if not isinstance(title, str) or title.count(".") != 1:
        yield StudyError(where, f"its name is {title!r}", 'a name = "port.effect"', "Set the class attribute `name`.")
    elif (named := title.partition(".")[0]) not in PORTS:
        near = did_you_mean(named, PORTS) or "The name begins with the port the law acts on."
        yield StudyError(where, f'unknown port "{named}" in its name', f"one of {', '.join(PORTS)}", near)
    if port_of(effect) is None:
        yield StudyError(where, "it is a law of no port", KINDS, "Derive the class from one of them.")
        return
    if wrong := [*_of_types(effect, where)]:
        yield from wrong
        return
    yield from _of_parameters(effect, where)
    yield from _of_methods(effect, where)


def omissions(effect: type[Effect], where: str) -> Iterator[StudyError]:
    """What an effect should say and does not; a model could do without it, a reader could not.

    Parameters
    ----------
    effect, where
        As for `refusals`.
    """
    text = inspect.cleandoc(effect.__doc__ or "")
    if not text or text.startswith(f"{effect.__name__}("):
        yield StudyError(where, "no docstring", "one sentence, and sections Law, Valid range, Source")
    elif "\nLaw\n---" not in text:
        yield StudyError(where, "no section Law in its docstring", "its equation under that title")
    for p in effect.parameters:
        place = f"{where}, parameter {p.name}"
        if not p.doc:
            yield StudyError(place, "no words for it", "a sentence that says what it is")
        if not p.lower < p.typical < p.upper:
            yield StudyError(place, f"typical {p.typical:g}", f"a value between {p.lower:g} and {p.upper:g}")
        if p.name in effect.strength and not p.lower <= p.null <= p.upper:
            yield StudyError(place, f"null {p.null:g} is out of its range", f"{p.lower:g} to {p.upper:g}")
        if p.log and p.lower <= 0.0:
            yield StudyError(place, f"searched by its logarithm from {p.lower:g}", "a positive lower limit")


def _of_types(effect: type[Effect], where: str) -> Iterator[StudyError]:
    """Declarations that are of another kind than they are taken for, of which nobody would say so later."""
    for name in ("strength", "needs", "excludes", "stands_for"):
        said: Any = getattr(effect, name)
        if not isinstance(said, tuple | frozenset) or not all(isinstance(one, str) for one in said):
            do = f'Write {name} = ("{said}",).' if isinstance(said, str) else f"Write {name} = {tuple(said)!r}."
            yield StudyError(f"{where}, {name}", f"{said!r}", "a tuple of names", do)
    said = effect.acts_on
    if not isinstance(said, set | frozenset) or not all(isinstance(one, Capability) for one in said):
        yield StudyError(
            f"{where}, acts_on", f"{said!r}", "a set of Capability", "Write frozenset({Capability.GUIDE})."
        )
    for p in effect.parameters:
        for name in ("typical", "lower", "upper", "null"):
            if isinstance(number := getattr(p, name), bool | str) or not hasattr(number, "__float__"):
                do = 'Write quantity("N", "what it is", 1.0).'
                yield StudyError(f"{where}, parameter {p.name}, {name}", f"{number!r}", "a number", do)
        for name in ("unit", "doc"):
            if not isinstance(text := getattr(p, name), str):
                yield StudyError(f"{where}, parameter {p.name}, {name}", f"{text!r}", "text", "")


def _of_parameters(effect: type[Effect], where: str) -> Iterator[StudyError]:
    names = [p.name for p in effect.parameters]
    if not names:
        yield StudyError(where, "it declares no parameter", "a field made with quantity(...)", "Declare its strength.")
    for field in dataclasses.fields(effect):
        if field.name not in names:
            do = f'Write {field.name}: jax.Array = quantity("N", "what it is", 1.0), or ClassVar for a constant.'
            yield StudyError(f"{where}, field {field.name}", "not declared as a parameter", "quantity(...)", do)
    for name in effect.strength:
        if name not in names:
            do = did_you_mean(name, names)
            yield StudyError(f"{where}, strength", f'no parameter "{name}"', f"one of {', '.join(names)}", do)
    for p in (p for p in effect.parameters if p.name in effect.strength and p.typical == p.null):
        do = "Write the size it usually has: at its null a law does nothing."
        yield StudyError(f"{where}, parameter {p.name}", f"typical {p.typical:g} is its null", "another value", do)
    if effect.timed and (port := port_of(effect)) in AT_ONCE:
        do = (
            "Write what changes with `times` in measure."
            if port == "sensor"
            else "Let an effect for each record differ."
        )
        yield StudyError(f"{where}, timed", "True", f"a law that takes part in the motion; not one of a {port}", do)
    asked: Any = effect.history
    for name in [name for name in asked if name not in HISTORY_OF_MOTION] if isinstance(asked, tuple) else [asked]:
        expected = f"a tuple of {', '.join(map(repr, HISTORY_OF_MOTION))}"
        yield StudyError(f"{where}, history", f"{name!r}", expected, did_you_mean(str(name), HISTORY_OF_MOTION))
    for p in effect.parameters:
        if p.reciprocal != math.isinf(p.null):
            expected = "reciprocal=True where the null is infinite, and only there"
            yield StudyError(f"{where}, parameter {p.name}", f"null {p.null:g}", expected)
    for p in effect.parameters:
        place, known = f"{where}, parameter {p.name}", is_si(p.unit)
        if known is None:
            yield StudyError(place, f'unknown unit "{p.unit}"', 'an SI unit such as N, N s/m or 1/m, "-" for none')
        elif not known:
            yield StudyError(place, f'unit "{p.unit}" is not SI', "the unit the law computes in", "Inside, all is SI.")


def _of_methods(effect: type[Effect], where: str) -> Iterator[StudyError]:
    """Public names of a user's classes that mean nothing to the port."""
    port = port_of(effect) or ""
    own = [cls for cls in effect.__mro__ if issubclass(cls, Effect) and not cls.__module__.startswith("fibrefit.")]
    known = {name for cls in effect.__mro__ if cls not in own for name in dir(cls)} | {"name"}
    fields = {field.name for field in dataclasses.fields(effect)}
    hooks = hooks_of(port)
    for cls in own:
        for name, value in vars(cls).items():
            if name.startswith("_") or name in known | fields:
                continue
            place = f"{where}, {name}"
            if name in MOVED:
                yield StudyError(place, "means nothing in a law", "", MOVED[name])
            elif callable(value) or isinstance(value, staticmethod | classmethod | property):
                do = did_you_mean(name, hooks) or "The name of a helper begins with an underscore."
                yield StudyError(place, f"no hook of the port {port}", f"one of {', '.join(hooks)}", do)
            elif near := did_you_mean(name, known - set(hooks)):
                yield StudyError(place, "means nothing in a law", "", f"{near} A constant begins with an underscore.")


def violations(effect: type[Effect], conditions: Mapping[str, float], where: str = "") -> tuple[StudyError, ...]:
    """All that is wrong with a law, as errors that are not raised.

    Parameters
    ----------
    effect : Effect class
    conditions : mapping of str to float, in SI units
        Those of a rig that a `RigLaw` may change.
    where : str
        How messages name it; its class where empty.
    """
    where = where or f'effect "{effect.__name__}"'
    found = [*refusals(effect, where), *omissions(effect, where)]
    if port_of(effect) is None or not effect.parameters:
        return tuple(found)
    try:
        laws = _made(effect, where)
    except StudyError as error:
        return (*found, error)
    said = overridden_hooks(effect)
    for hook, flag in ANNOUNCED.get(port_of(effect) or "", {}).items():
        if hook in said and not getattr(effect, flag):
            found.append(StudyError(f"{where}, {hook}", f"never called, as {flag} is not set", f"{flag} in the class"))
    hooks = [_Hook(name, effect, conditions) for name in said]
    found += [error for hook in hooks for error in _of_hook(hook, laws, f"{where}, {hook.name}")]
    if not found and all(_changed(hook, laws["typical"], (-FAR, *PLACES, FAR)) is None for hook in hooks):
        probed = f"positions and stretches to {1e3 * FAR:g} mm on either side, speeds to {max(SPEEDS):g} m/s"
        expected = f"an answer to one hook at least, somewhere at {probed}"
        found.append(StudyError(where, "changes nothing at its typical value", expected))
    return tuple(found)


def unusable(effect: type[Effect], where: str) -> Iterator[StudyError]:
    """What keeps a law from being compiled into a model: it cannot be made, or a hook fails or answers otherwise.

    Parameters
    ----------
    effect : Effect class
        One of which the declaration is right.
    where : str
        How messages name it.
    """
    try:
        laws = _made(effect, where)
    except StudyError as error:
        yield error
        return
    # What is asked at once of a whole record hangs on its channels, its conditions and its length.
    for name in overridden_hooks(effect) if port_of(effect) not in AT_ONCE else ():
        yield from _compiled(_Hook(name, effect, {}), laws, f"{where}, {name}")


def _made(effect: type[Effect], where: str) -> dict[str, Any]:
    """The law at its typical values, and with its strengths zero."""

    def array(parameter: Parameter, value: float) -> Any:
        return ByInverse(jnp.asarray(1.0 / value)) if parameter.reciprocal else jnp.asarray(float(value))

    try:
        typical = {p.name: array(p, p.typical) for p in effect.parameters}
        zero = {p.name: array(p, p.null) for p in effect.parameters if p.name in effect.strength}
        return {"typical": effect(**typical), "null": effect(**typical | zero)}
    except Exception as error:
        raise StudyError(where, f"cannot be made: {_shown(error)}", "a class without __init__ of its own") from None


class _Hook(NamedTuple):
    """A hook of a kind of law, as it is asked, under conditions that a `RigLaw` may change."""

    name: str
    effect: type[Effect]
    conditions: Mapping[str, float]

    def answer(self, law: Any, x: jax.Array, v: jax.Array) -> Any:
        """Of a law at a place and a speed; of None, what adds nothing."""
        row = jnp.ones(SAMPLES)
        known: dict[str, Any] = {name: jnp.asarray(value) for name, value in SET.items()}
        known |= {"stretch": x, "position": x, "angle": x, "rate": v, "velocity": v, "slack": jnp.array(False)}
        known["memory"] = tuple(0.3 * x for _ in getattr(self.effect, "memory", ()))
        known["direction"] = jnp.where(v < 0.0, -1.0, 1.0)
        known["channels"] = {"force": 30.0 + v * row, "position": x * row}
        known["channels"] |= dict.fromkeys(getattr(self.effect, "feels", ()), v * row)
        known |= {"times": jnp.arange(float(SAMPLES)), "course": x * jnp.arange(float(SAMPLES)), "rates": v * row}
        known |= {"force": known["course"], "conditions": {n: jnp.asarray(c) for n, c in self.conditions.items()}}
        plain = hooks_of(port_of(self.effect) or "")[self.name]
        given = [known[name] for name in inspect.signature(plain).parameters if name != "self"]
        return plain(_Nothing(), *given) if law is None else getattr(law, self.name)(*given)


class _Nothing:
    """A law of any port that adds nothing."""

    memory = ()


def _of_hook(hook: _Hook, laws: Mapping[str, Any], where: str) -> Iterator[StudyError]:
    """What is wrong with the answers of one hook."""
    if wrong := list(_compiled(hook, laws, where)):
        yield from wrong
        return

    def with_slope(law: Any, x: jax.Array, v: jax.Array) -> Any:
        """Answer, and how it changes where all that it depends on does."""
        return jax.jvp(hook.answer, (law, x, v), jax.tree.map(jnp.ones_like, (law, x, v)))

    places = _grid(PLACES)
    for choose, law in laws.items():
        slopes = jax.jit(jax.vmap(with_slope, (None, 0, 0)))(law, *places)
        for what, answer in zip(("value", "gradient"), slopes, strict=True):
            if (row := _first(answer, lambda leaf: ~np.isfinite(leaf))) is not None:
                yield StudyError(where, f"{what} not finite at its {choose} value, {_place(places, row)}", "a number")
                return
    if hook.name not in WITHOUT_A_TRACE and (row := _changed(hook, laws["null"], PLACES)) is not None:
        said = _place(places, row)
        yield StudyError(where, f"does not vanish at its null: {said}", "exactly what the hook answers without the law")


def _compiled(hook: _Hook, laws: Mapping[str, Any], where: str) -> Iterator[StudyError]:
    """Why a hook cannot be compiled, or that its answer has another form; nothing is computed."""
    zero = jnp.zeros(())
    try:
        shape = jax.eval_shape(hook.answer, laws["typical"], zero, zero)
    except Exception as error:
        yield StudyError(where, f"fails with {_shown(error)}", "an answer", FOR_ARRAYS)
        return
    whole = isinstance(shape, tuple)
    if hook.name in ("memory_rate", "memory_at_rest", "when_slack"):
        number = len(laws["null"].memory)
        right = whole and len(shape) == number and all(leaf.shape == () for leaf in shape)
        expected = f"a tuple of {number}, one for each name in memory"
    elif hook.name == "lags":
        right = whole and all(isinstance(lag, tuple) and len(lag) == 2 for lag in shape)
        expected = "a tuple of pairs, weight and time constant"
    else:
        plain = jax.eval_shape(lambda x: hook.answer(None, x, x), zero)
        alike: bool = jax.tree.structure(shape) == jax.tree.structure(plain)  # type: ignore[operator]
        right = alike and [a.shape for a in jax.tree.leaves(shape)] == [b.shape for b in jax.tree.leaves(plain)]
        expected = _shape(plain)
    if not right:
        yield StudyError(where, f"answers {_shape(shape)}", expected)


def _shape(shape: Any) -> str:
    if hasattr(shape, "shape"):
        return "one number" if shape.shape == () else f"an array of shape {shape.shape}"
    if isinstance(shape, dict):
        return f"a mapping with {', '.join(shape)}"
    return f"a tuple of {len(shape)}" if isinstance(shape, tuple) else type(shape).__name__


def _grid(places: tuple[float, ...]) -> tuple[Any, Any]:
    x, v = (grid.ravel() for grid in jnp.meshgrid(jnp.array(places), jnp.array(SPEEDS)))
    return x, v


def _changed(hook: _Hook, law: Effect, places: tuple[float, ...]) -> int | None:
    """First place at which a hook answers anything but what it does without the law."""
    x, v = _grid(places)
    if hook.name == "lags":
        lags = hook.answer(law, x[0], v[0])
        whole = sum(np.real(weight) for weight, _ in lags) if lags else 1.0
        return None if whole == 1.0 and all(np.all(constant == 0.0) for _, constant in lags) else 0
    answer, plain = (jax.vmap(lambda x, v, law=law: hook.answer(law, x, v))(x, v) for law in (law, None))
    return _first(jax.tree.map(lambda a, b: np.asarray(a) != np.asarray(b), answer, plain), lambda leaf: leaf)


def _first(answer: Any, wrong: Callable[[np.ndarray], np.ndarray]) -> int | None:
    """First of the places at which some leaf is wrong."""
    rows = [np.asarray(wrong(np.asarray(leaf))) for leaf in jax.tree.leaves(answer)]
    bad = [int(np.argmax(row.reshape(len(row), -1).any(axis=1))) for row in rows if row.any()]
    return min(bad, default=None)


def _place(places: tuple[Any, Any], row: int) -> str:
    return f"position or stretch {float(places[0][row]):g} m, speed {float(places[1][row]):g} m/s"


def _shown(error: Exception) -> str:
    first = str(error).strip().partition("\n")[0]
    return f"{type(error).__name__}: {first}" if first else type(error).__name__
