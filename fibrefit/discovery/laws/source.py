"""A law as the source of an effect: what is tried in a search and what a study names afterwards are the same file."""

from __future__ import annotations

import hashlib
import math
import sys
import types
from collections.abc import Collection
from itertools import count
from textwrap import indent
from typing import NamedTuple

import numpy as np

from fibrefit.core.roles import HISTORY, ROLES, STATES
from fibrefit.discovery.curves.probes import Curve
from fibrefit.discovery.laws.forms import STEEP, FittedForm, Form, Term
from fibrefit.laws.law import Effect
from fibrefit.laws.template import class_name

SI = ROLES | STATES | HISTORY
"""SI unit of each variable."""


class PortPlace(NamedTuple):
    """Where a law acts, in code.

    Parameters
    ----------
    port : str
        Of the name.
    base : str
        Class of laws.
    hook : str
        Signature and body of the method, ``VALUE`` for the law and ``VARIABLE`` for the variable.
    variable : str
        Of the curve, as the method knows it.
    absorbed : int
        Degree of the polynomial in the variable that base parameters take up.
    more : str
        A further line of the class; empty for most.
    signed : bool
        Whether the variable has two signs.
    """

    port: str
    base: str
    hook: str
    variable: str
    absorbed: int = 0
    more: str = ""
    signed: bool = False


_ON = "    acts_on: ClassVar[frozenset[Capability]] = frozenset({{Capability.{}}})\n"
_FRICTION = (
    "friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array",
    '"""Addition to the level of friction, in N."""',
)
_TENSION = (
    "tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array",
    '"""Tension added, in N."""',
)


_NOW = "self.STRENGTH"
_TIMED = "    timed: ClassVar[bool] = True\n"
_WORN = f"{_TIMED}    worn: ClassVar[bool] = True\n"
_AS_OF = '''    def as_of(self, moment: Moment) -> Self:
        """The law by then, as its strength."""
        return dataclasses.replace(self, STRENGTH=self._at(moment.VARIABLE))

'''
"""A law over the course of a record."""


def _method(head: tuple[str, str], answer: str = "self._at(VARIABLE)") -> str:
    return f"    def {head[0]}:\n        {head[1]}\n        return {answer}\n"


PLACES: dict[str, PortPlace] = {
    "probe.force_of_position": PortPlace(
        "guide", "GuideLaw",
        _method(("force(self, position: jax.Array, velocity: jax.Array) -> jax.Array",
                 '"""Force on the weight against the + direction, in N."""')),
        "position",
    ),
    "probe.friction_of_position": PortPlace(
        "guide", "GuideLaw",
        _method(("roughness(self, position: jax.Array) -> jax.Array", '"""Addition to the friction, in N."""')),
        "position",
    ),
    "probe.friction_of_speed": PortPlace("guide", "GuideLaw", _method(_FRICTION), "jnp.abs(velocity)"),
    "probe.friction_of_tension": PortPlace("guide", "GuideLaw", _method(_FRICTION), "tension"),
    "probe.tension_of_stretch": PortPlace("fibre", "FibreLaw", _method(_TENSION), "stretch", 1),
    "probe.tension_of_rate": PortPlace("fibre", "FibreLaw", _method(_TENSION), "rate", 1, signed=True),
    "probe.damping_of_stretch": PortPlace(
        "fibre", "FibreLaw",
        _method(("damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array",
                 '"""Factor on the viscous tension."""'),
                "jnp.maximum(1.0 + self._at(VARIABLE), ALWAYS_LEFT)"),
        "stretch",
    ),
    "probe.force_error_of_force": PortPlace(
        "sensor", "SensorLaw",
        _method(("measure(self, channels: Channels, times: jax.Array) -> Channels", '"""Readings of force."""'),
                "of_force(channels, lambda force: force + self._at(force))"),
        "force", 1, _ON.format("FIBRE"),
    ),
    "probe.position_error_of_position": PortPlace(
        "sensor", "SensorLaw",
        _method(("measure(self, channels: Channels, times: jax.Array) -> Channels", '"""Readings of position."""'),
                'channels | {"position": channels["position"] + self._at(channels["position"])}'),
        "position", 1, _ON.format("PLACE"),
    ),
    "probe.friction_of_time": PortPlace("guide", "GuideLaw", _method(_FRICTION, _NOW), "time", more=_TIMED),
    "probe.friction_of_path": PortPlace("guide", "GuideLaw", _method(_FRICTION, _NOW), "path", more=_WORN),
    "probe.stiffness_of_time": PortPlace(
        "fibre", "FibreLaw",
        _method(("stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array",
                 '"""Factor on the elastic tension."""'),
                f"jnp.maximum(1.0 + {_NOW}, ALWAYS_LEFT)"),
        "time", more=_TIMED,
    ),
    "probe.damping_of_time": PortPlace(
        "fibre", "FibreLaw",
        _method(("damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array",
                 '"""Factor on the viscous tension."""'),
                f"jnp.maximum(1.0 + {_NOW}, ALWAYS_LEFT)"),
        "time", more=_TIMED,
    ),
}  # fmt: skip
"""Of each probe: a law that is composed acts where a free curve does."""

_SOURCE = '''"""{says}

Composed by `fibrefit discover`: nothing of the catalogue accounted for what the records show.
"""

from __future__ import annotations

{head}

import jax
import jax.numpy as jnp

from fibrefit.core.capability import Capability
from fibrefit.laws.law import {imports}


class {cls}({base}):
    """{says}

    Law
    ---
    ``{law}`` in {unit}, x the {variable} in {variable_unit}.

    Valid range
    -----------
    {variable_says} from {low:.6g} to {high:.6g} {variable_unit}, where the records saw it.

    Source
    ------
    Composed from a small grammar of forms, and fitted to records.
    """

    name: ClassVar[str] = "{name}"
{more}{fields}

    def _at(self, x: jax.Array) -> jax.Array:
        """The law at `x`, in {unit}."""
{code}

{hook}'''


class Composed(NamedTuple):
    """A law that was composed.

    Parameters
    ----------
    probe : Curve class
        The curve it stands for.
    fitted : FittedForm
    name : str
        Of the effect, ``port.effect``.
    says : str
    expression : str
        Its equation, x the variable in SI units.
    source : str
        Of the file.
    """

    probe: type[Curve]
    fitted: FittedForm
    name: str
    says: str
    expression: str
    source: str

    @property
    def title(self) -> str:
        """Name of the class in the file."""
        return class_name(self.name.partition(".")[2])

    @property
    def variable_unit(self) -> str:
        """SI unit of the variable."""
        return SI[self.probe.variable]

    @property
    def file(self) -> str:
        """Name of the file."""
        return f"{self.name.partition('.')[2]}.py"


def composed(probe: type[Curve], form: FittedForm, knots: np.ndarray, taken: Collection[str] = ()) -> Composed:
    """Source of a law.

    Parameters
    ----------
    probe : Curve class
        Where it acts, and on what it depends.
    form : FittedForm
    knots : (n_knot,) in SI units
        Range of the variable that the records saw.
    taken : collection of str
        Names of effects that it must not have.
    """
    place, low, high = PLACES[probe.name], float(knots[0]), float(knots[-1])
    unit, effect = SI[probe.variable], _name(probe, form.form, place.port, taken)
    says = f"{probe.says[0].upper()}{probe.says[1:]}: it {form.form.says} {probe.variable}."
    sizes = {"height": probe.size, "slope": probe.size / (high - low), "place": high - low, "length": high - low}
    fields = [_field(quantity, probe.unit, unit, sizes, (low, high)) for quantity in form.form.quantities]
    hook = f"{_AS_OF if probe.timed else ''}{place.hook}".replace("STRENGTH", form.form.quantities[0].name)
    kinds = [word for word in ("ALWAYS_LEFT", "Channels", "Memory", "Moment", "of_force") if word in hook]
    ends, mirrored = form.form.ends(low, high, place.signed), place.signed and form.form.begins
    expression = _expression(form.form, ends, mirrored)
    source = _SOURCE.format(
        says=says, imports=", ".join(sorted([*kinds, place.base, "quantity"], key=str.lower)),
        head="import dataclasses\nfrom typing import ClassVar, Self" if probe.timed else "from typing import ClassVar",
        cls=class_name(effect), base=place.base, law=expression, unit=probe.unit, variable=probe.variable,
        variable_unit=unit, variable_says=probe.variable.capitalize(), low=low, high=high,
        name=f"{place.port}.{effect}", more=place.more, fields="\n".join(fields),
        code=_code(form.form, ends, mirrored), hook=hook.replace("VARIABLE", place.variable),
    )  # fmt: skip
    return Composed(probe, form, f"{place.port}.{effect}", says, expression, source)


def _name(probe: type[Curve], form: Form, port: str, taken: Collection[str]) -> str:
    """Name of a law within its port; numbered where there is such a law already, as where a search goes on from one."""
    plain = f"{probe.name.partition('.')[2]}_{form.name}"
    names = (plain if number == 1 else f"{plain}_{number}" for number in count(1))
    return next(name for name in names if f"{port}.{name}" not in taken)


def _code(form: Form, ends: tuple[float, float], mirrored: bool) -> str:
    """Body of the law as a method."""
    low, span = ends
    code = f"return {form.code}".replace("LOW", f"{low:.9g}").replace("SPAN", f"{span:.9g}")
    if mirrored:
        code = f"side, x = jnp.sign(x), jnp.abs(x)\n{code.replace('return ', 'return side * ', 1)}"
    return indent(code, " " * 8)


def _expression(form: Form, ends: tuple[float, float], mirrored: bool) -> str:
    """Equation of a form with all that is not fitted as numbers."""
    low, span = ends
    begins = "|x|" if mirrored else "x" if low == 0.0 else f"x {'-' if low > 0.0 else '+'} {abs(low):.6g}"
    law = form.law.replace("(x - x0)", f"({begins})" if " " in begins else begins).replace("x - x0", begins)
    law = law.replace("X", f"{span:.6g}").replace("W", f"{STEEP * span:.3g}")
    return f"sign(x) {law}" if mirrored else law


def _unit(quantity: Term, height: str, variable: str) -> str:
    slope = f"{height}/({variable})" if "/" in variable else f"{height.replace('-', '1')}/{variable}"
    units = {"height": height, "slope": slope, "place": variable, "length": variable, "number": "-", "turn": "rad"}
    return units[quantity.kind]


def _field(quantity: Term, height: str, variable: str, sizes: dict[str, float], ends: tuple[float, float]) -> str:
    unit = _unit(quantity, height, variable)
    if quantity.kind in ("height", "slope"):
        more = f"{sizes[quantity.kind]:.6g}"
    elif quantity.kind == "place":
        # Zero of a position or a time is nothing special: the prior is as wide as the range.
        middle, spread = (ends[0] + ends[1]) / 2.0, sizes["place"] / 2.0
        more = f"{middle:.6g}, lower={ends[0]:.9g}, upper={ends[1]:.9g}, spread={spread:.6g}"
    elif quantity.kind == "length":
        more = f"{0.3 * sizes['length']:.6g}, lower={1e-3 * sizes['length']:.6g}, log=True"
    elif quantity.kind == "number":
        more = "1.5, lower=0.05, upper=20.0, log=True"
    else:
        more = f"1.0, spread={math.pi:.6g}"
    said = f'"{unit}", "{quantity.says}", {more}, symbol="{quantity.symbol}"'
    return f"    {quantity.name}: jax.Array = quantity({said})"


def effect_of_law(law: Composed) -> type[Effect]:
    """The effect of a law's source."""
    title = f"fibrefit_composed_{hashlib.sha256(law.source.encode()).hexdigest()[:16]}"
    module = sys.modules.get(title)
    if module is None:
        module = types.ModuleType(title)
        sys.modules[title] = module
        exec(compile(law.source, law.file, "exec"), module.__dict__)
    found: type[Effect] = getattr(module, law.title)
    return found


def start_of_law(law: Composed) -> dict[str, float]:
    """Values the regression found, by the names of the effect's parameters, in SI units."""
    named = zip(law.fitted.form.quantities, law.fitted.values, strict=True)
    return {f"{law.name}.{quantity.name}": value for quantity, value in named}


__all__ = ["PLACES", "Composed", "Form", "PortPlace", "composed", "effect_of_law", "start_of_law"]
