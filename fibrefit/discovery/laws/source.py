"""A law as the source of an effect: what is tried in a search and what a study names afterwards are the same file."""

from __future__ import annotations

import hashlib
import math
import re
import sys
import types
from collections.abc import Collection, Sequence
from itertools import count
from textwrap import indent
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import SI
from fibrefit.discovery.curves.probes import Curve
from fibrefit.discovery.laws.forms import STEEP, FittedForm, Form, Term
from fibrefit.discovery.laws.places import AS_OF, NOW, PLACES, SECOND, PortPlace, SecondVariable
from fibrefit.laws.law import Effect
from fibrefit.laws.template import class_name

_SOURCE = '''"""{says}

Composed by `fibrefit discover`: nothing of the catalogue accounted for what the records show.
"""

from __future__ import annotations

{head}

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import {imports}


class {cls}({base}):
    """{says}

    Law
    ---
    ``{law}`` in {unit}, x the {variable} in {variable_unit}{also}.

    Valid range
    -----------
    {variable_says} from {low:.6g} to {high:.6g} {variable_unit}{second_range}, where the records saw it.

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

PART = 0.1
"""Share of the range of a variable that a law takes to reach its usual size, which acts in a part of the range alone:
between one knot of a curve and all of it. An end stop of 101 N/m had been 8 to 12 times what was usual over 0.1 m."""


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
    second : SecondVariable, optional
        What it changes with, too.
    span : float
        How far that goes in the records, in its unit.
    """

    probe: type[Curve]
    fitted: FittedForm
    name: str
    says: str
    expression: str
    source: str
    second: SecondVariable | None = None
    span: float = 1.0

    @property
    def terms(self) -> tuple[Term, ...]:
        """Its numbers."""
        return self.fitted.form.quantities if self.second is None else (*self.fitted.form.quantities, SECOND)

    @property
    def title(self) -> str:
        """Name of the class in the file."""
        return class_name(self.name.partition(".")[2])

    @property
    def port(self) -> str:
        """Where it acts, and on what: ``guide.friction``."""
        quantity = self.probe.name.partition(".")[2].partition("_of_")[0].removesuffix("_error")
        return f"{self.name.partition('.')[0]}.{quantity}"

    @property
    def variables(self) -> dict[str, str]:
        """What it depends on, and SI units."""
        second = {} if self.second is None else {self.second.variable: self.second.unit}
        return {self.probe.variable: SI[self.probe.variable], **second}

    @property
    def file(self) -> str:
        """Name of the file."""
        return f"{self.name.partition('.')[2]}.py"


def composed(
    probe: type[Curve], form: FittedForm, knots: np.ndarray, taken: Collection[str] = (),
    second: SecondVariable | None = None, span: float = 1.0,
) -> Composed:  # fmt: skip
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
    second : SecondVariable, optional
        What it changes with, too.
    span : float
        How far that goes in the records, in its unit.
    """
    place, low, high = PLACES[probe.name], float(knots[0]), float(knots[-1])
    unit, effect = SI[probe.variable], _name(probe, form.form, place.port, taken)
    says = f"{probe.says[0].upper()}{probe.says[1:]}: it {form.form.says} {probe.variable}"
    says += "." if second is None else f", and changes with the {second.variable}."
    sizes = {"height": probe.size, "slope": probe.size / (high - low), "place": high - low, "length": high - low}
    sizes["steep"] = sizes["slope"] / PART
    fields = [_field(quantity, probe.unit, unit, sizes, (low, high)) for quantity in form.form.quantities]
    hook, more = f"{AS_OF if probe.timed else ''}{place.hook}", place.more
    if second is not None:
        hook, more = _with_second(place, hook, second), f"{more}{second.more}"
        fields.append(_field(SECOND, probe.unit, second.unit, {"second": 1.0 / span}, (low, high)))
    hook = hook.replace("STRENGTH", form.form.quantities[0].name)
    kinds = [word for word in ("ALWAYS_LEFT", "Channels", "Memory", "Moment", "of_force") if word in hook]
    ends, mirrored = form.form.ends(low, high, place.signed), place.signed and form.form.begins
    expression = _expression(form.form, ends, mirrored)
    expression = expression if second is None else f"({expression}) (1 + {SECOND.symbol} y)"
    source = _SOURCE.format(
        says=says, imports=", ".join(sorted([*kinds, place.base, "quantity"], key=str.lower)),
        head="import dataclasses\nfrom typing import ClassVar, Self" if probe.timed
        else f"from typing import ClassVar{', Self' if 'Self' in hook else ''}",
        also="" if second is None else f", y the {second.variable} in {second.unit}",
        cls=class_name(effect), base=place.base, law=expression, unit=probe.unit, variable=probe.variable,
        variable_unit=unit, variable_says=probe.variable.capitalize(), low=low, high=high,
        second_range="" if second is None else f", {second.variable} of at most {span:.6g} {second.unit}",
        name=f"{place.port}.{effect}", more=more, fields="\n".join(fields),
        code=_code(form.form, ends, mirrored), hook=hook.replace("VARIABLE", place.variable),
    )  # fmt: skip
    return Composed(probe, form, f"{place.port}.{effect}", says, expression, source, second, span)


def _with_second(place: PortPlace, hook: str, second: SecondVariable) -> str:
    """The methods of a law that changes with a second variable."""
    if second.hook:
        return second.hook.format(SECOND.name, second.code) + hook
    changed = f" * (1.0 + self.{SECOND.name} * {second.code})"
    return (
        hook.replace(NOW, NOW + changed)
        if NOW in place.hook
        else re.sub(r"_at\([^()]*\)", lambda at: f"{at.group()}{changed}", hook)
    )


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
    slope = height if variable == "-" else slope
    units = {
        "height": height, "slope": slope, "steep": slope, "place": variable, "length": variable, "number": "-",
        "turn": "rad",
        "second": "-" if variable == "-" else f"1/({variable})" if "/" in variable else f"1/{variable}",
    }  # fmt: skip
    return units[quantity.kind]


def _field(quantity: Term, height: str, variable: str, sizes: dict[str, float], ends: tuple[float, float]) -> str:
    unit = _unit(quantity, height, variable)
    if quantity.kind in ("height", "slope", "steep"):
        more = f"{sizes[quantity.kind]:.6g}"
    elif quantity.kind == "second":
        # None is as likely as any: the prior is wide beside what doubles the law over the records.
        more = f"{sizes['second']:.6g}, spread={2.0 * sizes['second']:.6g}"
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
        # What its classes say of their module is looked up there as they are made.
        sys.modules[title] = module
        try:
            exec(compile(law.source, law.file, "exec"), module.__dict__)
        except BaseException:
            del sys.modules[title]
            raise
    found: type[Effect] = getattr(module, law.title)
    return found


def start_of_law(law: Composed) -> dict[str, float]:
    """Values the regression found, by the names of the effect's parameters, in SI units."""
    values = (*law.fitted.values, 0.0)[: len(law.terms)]
    return {f"{law.name}.{term.name}": value for term, value in zip(law.terms, values, strict=True)}


def heights_of(law: Composed, places: np.ndarray, values: Sequence[float] | None = None) -> np.ndarray:
    """A law at places along its variable, as the regression found it unless values are given; all in SI units."""
    values = list(start_of_law(law).values()) if values is None else values
    return np.asarray(effect_of_law(law)(*map(jnp.asarray, values))._at(jnp.asarray(places)))  # type: ignore[attr-defined]
