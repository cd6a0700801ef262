"""Where a law may act, in code, and what it may change with besides its own variable."""

from __future__ import annotations

from typing import NamedTuple

from fibrefit.discovery.curves.probes import Curve
from fibrefit.discovery.laws.forms import Term


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
    more : str
        A further line of the class; empty for most.
    signed : bool
        Whether the variable has two signs.
    """

    port: str
    base: str
    hook: str
    variable: str
    more: str = ""
    signed: bool = False


_ON = "    acts_on: ClassVar[frozenset[Capability]] = frozenset({{Capability.{}}})\n"
_DRIVEN = "    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.DRIVE})\n"
_FRICTION = (
    "friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array",
    '"""Addition to the level of friction, in N."""',
)
_TENSION = (
    "tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array",
    '"""Tension added, in N."""',
)


NOW = "self.STRENGTH"
_STIFFNESS = (
    "stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array",
    '"""Factor on the elastic tension."""',
)
_DAMPING = (
    "damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array",
    '"""Factor on the viscous tension."""',
)
_FACTOR = f"jnp.maximum(1.0 + {NOW}, ALWAYS_LEFT)"
_TIMED = "    timed: ClassVar[bool] = True\n"
_OVER = _TIMED + '    history: ClassVar[tuple[str, ...]] = ("{}",)\n'
AS_OF = '''    def as_of(self, moment: Moment) -> Self:
        """The law by then, as its strength."""
        return dataclasses.replace(self, STRENGTH=self._at(moment.VARIABLE))

'''
"""A law over the course of a record."""


class SecondVariable(NamedTuple):
    """What a law may change with besides its own variable: it is multiplied by ``1 + d y``.

    Parameters
    ----------
    variable, unit : str
        Of y, in SI units.
    argument : str
        Of the method in which the law acts, where y is found in it.
    code : str
        y in the code of a law.
    hook : str
        Method that knows y where no argument does.
    more : str
        A further line of the class.
    """

    variable: str
    unit: str
    argument: str
    code: str
    hook: str = ""
    more: str = ""


_BY_THEN = '''    def as_of(self, moment: Moment) -> Self:
        """The law by then."""
        return self.scaled(1.0 + self.{} * {})

'''
_IN_RECORD = '''    def in_record(self, number: jax.Array, duration: jax.Array) -> Self:
        """The law in a record, by its place in the series."""
        return self.scaled(1.0 + self.{} * {})

'''
SECOND = Term("second", "relative change over the second variable", "second", "d")
SECOND_VARIABLES: tuple[SecondVariable, ...] = (
    SecondVariable("direction", "-", "direction", "direction"),
    SecondVariable("speed", "m/s", "velocity", "jnp.abs(velocity)"),
    SecondVariable("tension", "N", "tension", "tension"),
    SecondVariable("stretch", "m", "stretch", "stretch"),
    SecondVariable("stretch rate", "m/s", "rate", "rate"),
    SecondVariable("time", "s", "", "moment.time", _BY_THEN, _TIMED),
    SecondVariable("time", "s", "times", "(times - times[0])"),
    SecondVariable("path", "m", "", "moment.path", _BY_THEN, _OVER.format("path")),
    SecondVariable("time at rest", "s", "", "moment.rest", _BY_THEN, _OVER.format("rest")),
    SecondVariable("load cycles", "-", "", "moment.cycles", _BY_THEN, _OVER.format("cycles")),
    SecondVariable("order of the record", "-", "", "(number - 1.0)", _IN_RECORD),
)
"""All of them; which ones a law may change with is told by its place."""
PORTS_OF_HISTORY = {"path": ("guide",), "time at rest": ("guide",), "load cycles": ("fibre",)}
"""Ports that what comes together in a motion may change."""


def second_variables(probe: type[Curve]) -> list[SecondVariable]:
    """What a law in the place of a curve may change with besides its own variable."""
    place = PLACES[probe.name]
    arguments = place.hook.partition(")")[0]
    found = []
    for one in SECOND_VARIABLES:
        # A sensor reads what has come together already: it is told the times, and not what a motion is told by then.
        by_then = one.hook is _BY_THEN and (probe.timed or place.port == "sensor")
        known = f"{one.argument}: " in arguments if one.argument else not by_then
        if (
            known
            and place.variable not in (one.code, one.variable)
            and place.port in PORTS_OF_HISTORY.get(one.variable, (place.port,))
        ):
            found.append(one)
    return found


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
    "probe.tension_of_stretch": PortPlace("fibre", "FibreLaw", _method(_TENSION), "stretch"),
    "probe.tension_of_rate": PortPlace("fibre", "FibreLaw", _method(_TENSION), "rate", signed=True),
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
        "force", _ON.format("FIBRE"),
    ),
    "probe.position_error_of_position": PortPlace(
        "sensor", "SensorLaw",
        _method(("measure(self, channels: Channels, times: jax.Array) -> Channels", '"""Readings of position."""'),
                'channels | {"position": channels["position"] + self._at(channels["position"])}'),
        "position", _ON.format("PLACE"),
    ),
    "probe.friction_of_time": PortPlace("guide", "GuideLaw", _method(_FRICTION, NOW), "time", more=_TIMED),
    "probe.friction_of_path": PortPlace(
        "guide", "GuideLaw", _method(_FRICTION, NOW), "path", more=_OVER.format("path")
    ),
    "probe.friction_of_rest": PortPlace(
        "guide", "GuideLaw", _method(_FRICTION, NOW), "rest", more=_OVER.format("rest")
    ),
    "probe.stiffness_of_time": PortPlace("fibre", "FibreLaw", _method(_STIFFNESS, _FACTOR), "time", more=_TIMED),
    "probe.stiffness_of_cycles": PortPlace(
        "fibre", "FibreLaw", _method(_STIFFNESS, _FACTOR), "cycles", more=_OVER.format("cycles")
    ),
    "probe.stiffness_of_drive_speed": PortPlace(
        "fibre", "FibreLaw", _method(_STIFFNESS, _FACTOR), "drive_speed", more=_TIMED + _DRIVEN
    ),
    "probe.damping_of_drive_speed": PortPlace(
        "fibre", "FibreLaw", _method(_DAMPING, _FACTOR), "drive_speed", more=_TIMED + _DRIVEN
    ),
    "probe.damping_of_time": PortPlace("fibre", "FibreLaw", _method(_DAMPING, _FACTOR), "time", more=_TIMED),
    "probe.damping_of_cycles": PortPlace(
        "fibre", "FibreLaw", _method(_DAMPING, _FACTOR), "cycles", more=_OVER.format("cycles")
    ),
}  # fmt: skip
"""Of each probe: a law that is composed acts where a free curve does."""
