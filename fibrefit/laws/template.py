"""A law to begin with: the source of a small class that says something, and every hook of its port to take from."""

from __future__ import annotations

import inspect
import re
import textwrap
from typing import NamedTuple

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Effect
from fibrefit.laws.ports import ANNOUNCED, PORTS, hooks_of


class Beginning(NamedTuple):
    """What the law of a new file says before it is changed into one's own.

    Parameters
    ----------
    law, hook, answer : str
        Equation, hook that is answered, and the answer in code.
    field : str
        Arguments of `quantity` of its one parameter.
    more : str
        A further line of the class; empty for most.
    """

    law: str
    hook: str
    answer: str
    field: str
    more: str = ""


_INCLINED = Beginning(
    "The guide is inclined by ``c`` more than stated.",
    "correct",
    'conditions | {"inclination": conditions["inclination"] + self.coefficient}',
    '"rad", "error of the inclination", 0.01',
    "    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})\n",
)
BEGINNINGS = {
    "guide": Beginning(
        "Force ``c v^3`` against the motion.",
        "force",
        "self.coefficient * velocity**3",
        '"N s^3/m^3", "drag over the cube of the speed", 50.0, lower=0.0',
    ),
    "fibre": Beginning(
        "Elastic tension ``k e (1 + c e)``.",
        "stiffness_factor",
        "1.0 + self.coefficient * stretch",
        '"1/m", "relative growth of the stiffness over the stretch", 20.0',
    ),
    "pulley": Beginning(
        "Tension on the weight ``T (1 - c phi v)``, phi the angle of the fibre on the pulley.",
        "grip",
        "1.0 - self.coefficient * wrap_angle * velocity",
        '"s/m", "relative loss of tension over angle and speed", 0.05, lower=0.0',
    ),
    "drive": Beginning(
        "Fibre taken in ``(1 + c) x``.",
        "travel",
        "(1.0 + self.coefficient) * position, (1.0 + self.coefficient) * rate",
        '"-", "relative error of the drive", 0.01',
    ),
    "sensor": Beginning(
        "Reading ``(1 + c) F`` of each force gauge.",
        "measure",
        "of_force(channels, lambda force: (1.0 + self.coefficient) * force)",
        '"-", "relative error of the force gauge", 0.01',
        "    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})\n",
    ),
    "push": Beginning(
        "The mass is pushed by ``(1 + c) F``, F the measured force.",
        "applied",
        "(1.0 + self.coefficient) * force, (1.0 + self.coefficient) * rates",
        '"-", "relative error of the force that pushes", 0.01',
    ),
    "pivot": Beginning(
        "Torque ``c r^3`` against the motion, r the rate of the angle.",
        "torque",
        "self.coefficient * rate**3",
        '"N m s^3", "drag over the cube of the rate", 1e-4, lower=0.0',
    ),
    "rig": _INCLINED,
    "study": _INCLINED._replace(law="The guide is inclined by ``c`` more than the study says."),
}

_SOURCE = '''"""A law of my own."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
{imports}


class {cls}({base}):
    """One sentence that says what it is.

    Law
    ---
    {law}

    Valid range
    -----------
    Where the law holds.

    Source
    ------
    Where it comes from.
    """

    name: ClassVar[str] = "{name}"
{more}    # SI unit, words, typical size; lower, upper: its range; null: where the law vanishes exactly, 0 unless said;
    # symbol: in the law.
    coefficient: jax.Array = quantity(
        {field}
    )

{hook}
    # {others_said}
{announced}{others}
    # What else may be said of the class, each a line such as `stiff: ClassVar[bool] = True`:
    # strength   names of the parameters at whose null values the law vanishes; the first one unless said
{acts_on}
    # needs, excludes   names of effects that must, or must not, be in the model too
    # stiff      True where it brings rates that are fast against the sampling
    # singular   0.1, say, where the model changes its kind at the null (a new state, a rigid part that gives way)
    # speeds     speeds in m/s between which it bends so sharply that no step may run across them
    # timed      True where it changes within a record: as_of(self, moment) says what it is then
    # sudden     True where that happens at one instant, its parameter `instant`, a share of the record
'''


WIDTH = 120
"""Columns of a line of code."""
OTHERS = "What else a law at this port can say; what it does not say adds nothing. To use one, take its # away."


def template(name: str) -> str:
    """Source of a law that can be used as it is.

    Parameters
    ----------
    name : str
        ``"port.effect"``, the port one of `PORTS`.
    """
    port, _, effect = name.partition(".")
    begun, kind = BEGINNINGS[port], PORTS[port]
    hooks = {hook: textwrap.dedent(inspect.getsource(method)) for hook, method in hooks_of(port).items()}
    head = re.sub(r"    return .*", lambda _: f"    return {begun.answer}", hooks[begun.hook])
    others = [_commented(source) for hook, source in hooks.items() if hook != begun.hook]
    announced = "".join(
        f"    # {hook} is called only of a class with {'names in ' if flag == 'memory' else ''}{flag}"
        f"{'' if flag == 'memory' else ' = True'}.\n"
        for hook, flag in ANNOUNCED.get(port, {}).items()
    )
    types = [word for word in ("Channels", "Memory") if any(re.search(rf"\b{word}\b", s) for s in hooks.values())]
    used = {Effect.__module__: [*types, *(["of_force"] if "of_force" in begun.answer else []), "quantity"]}
    # A kind of law may have a module of its own.
    used.setdefault(kind.__module__, []).insert(len(types), kind.__name__)
    acts_on = f"what a rig must have, a set of Capability: {', '.join(Capability.__members__)}"
    return _SOURCE.format(
        imports="\n".join(f"from {module} import {', '.join(names)}" for module, names in used.items()),
        cls=class_name(effect),
        base=kind.__name__,
        name=name,
        law=begun.law,
        field=f'{begun.field}, symbol="c"',
        more=begun.more,
        hook=textwrap.indent(head, "    "),
        announced=announced,
        others_said=OTHERS if others else "It is all that a law at this port can say.",
        others="".join(f"\n{other}" for other in others),
        acts_on=textwrap.fill(acts_on, WIDTH, initial_indent="    # acts_on    ", subsequent_indent=f"    #{' ' * 12}"),
    )


def class_name(effect: str) -> str:
    """``my_drag`` is ``MyDrag``."""
    return "".join(word.capitalize() for word in effect.split("_"))


def _commented(source: str) -> str:
    """A hook in comments, in lines that fit."""
    head, _, rest = source.partition("\n")
    if len(head) > WIDTH - len("    # "):
        source = re.sub(r"\((.*)\) ->", r"(\n    \1\n) ->", head) + f"\n{rest}"
    return textwrap.indent(source, "    # ", lambda line: True).replace("    # \n", "    #\n")
