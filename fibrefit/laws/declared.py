"""What can be seen of an effect without asking it anything: its port, its name, its parameters, its methods."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Iterator
from typing import Any

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.core.errors import StudyError, did_you_mean
from fibrefit.core.units import is_si
from fibrefit.laws.law import Effect
from fibrefit.laws.moment import HISTORY_OF_MOTION
from fibrefit.laws.ports import PORTS, hooks_of, own_classes, port_of

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
    yield from (error for p in effect.parameters for error in _of_unit(p, f"{where}, parameter {p.name}"))


def _of_unit(parameter: Parameter, where: str) -> Iterator[StudyError]:
    known = is_si(parameter.unit)
    if known is None:
        yield StudyError(where, f'unknown unit "{parameter.unit}"', 'an SI unit such as N, N s/m or 1/m, "-" for none')
    elif not known:
        yield StudyError(
            where, f'unit "{parameter.unit}" is not SI', "the unit the law computes in", "Inside, all is SI."
        )


def _of_methods(effect: type[Effect], where: str) -> Iterator[StudyError]:
    """Public names of a user's classes that mean nothing to the port."""
    own, port = own_classes(effect), port_of(effect) or ""
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
