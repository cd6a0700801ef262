"""What a study may say of a rig whose declaration says it all: its conditions, channels, noise and base parameters."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Protocol

from pydantic import Field, create_model

from fibrefit.core.declarations import ROLES, Parameter
from fibrefit.study.channels import ChannelEntry
from fibrefit.study.quantity import Unit
from fibrefit.study.rigs.common import RecordTable, optional, required
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable


class RigDeclaration(Protocol):
    """What is required of a rig."""

    @property
    def kind(self) -> str:
        """Name in a study."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the base model."""

    @property
    def conditions(self) -> tuple[Parameter, ...]:
        """What must be known of a record; one that is typically NaN has to be stated."""

    @property
    def measured(self) -> tuple[str, ...]:
        """Channels that a record must hold."""


def derived_study(rig: RigDeclaration) -> type[Study]:
    """Model of the studies of a rig.

    Returns
    -------
    type of Study
        With one key for each condition, under ``[rig]`` or in a record, and one for each channel and its noise.
    """
    title, said = "".join(word.capitalize() for word in rig.kind.split("_")), rig.kind.replace("_", " ")
    constants: dict[str, Any] = {condition.name: _key(condition) for condition in rig.conditions}
    channels: dict[str, Any] = dict.fromkeys(("time", *rig.measured), (ChannelEntry | None, None))
    noise: dict[str, Any] = {role: (_quantity(ROLES[role], above=True) | None, None) for role in rig.measured}
    kind: dict[str, Any] = {"kind": (Literal[rig.kind], ...)}

    def table(part: str, what: str, base: type[StudyTable], keys: dict[str, Any]) -> type[StudyTable]:
        return create_model(f"{title}{part}", __base__=base, __doc__=f"{what} of a {said}.", **keys)

    record = table("Record", "One record", RecordTable, constants)
    columns = table("Channels", "Channels", StudyTable, channels)
    levels = table("Noise", "Noise", StudyTable, noise)
    study: type[Study] = create_model(
        f"{title}Study",
        __base__=Study,
        __doc__=f"Study of a {said}.",
        rig=(table("Rig", "``[rig]``", StudyTable, kind | constants), ...),
        channels=(columns, columns()),
        noise=(levels, levels()),
        records=(tuple[record, ...], Field(min_length=1)),  # type: ignore[valid-type]
    )
    study.base_parameters = {parameter.name: parameter.unit for parameter in rig.parameters}
    return study


def _key(condition: Parameter) -> tuple[Any, Any]:
    """Type and field of a condition: one that has a typical value may be left out."""
    unit, doc, value = condition.unit, condition.doc[:1].upper() + condition.doc[1:], condition.typical
    above = condition.lower == 0.0 and value != 0.0
    kind = _quantity(unit, condition.lower, condition.upper, above=above)
    if math.isnan(value):
        return kind, required(f"{doc}.")
    return kind | None, optional(f"{doc}; {value:g}{'' if unit == '-' else f' {unit}'} when absent.")


def _quantity(unit: str, lower: float = 0.0, upper: float = math.inf, *, above: bool) -> Any:
    """Type of a number that is written with its unit, or plainly where it has none."""
    if unit == "-":
        return Annotated[float, Field(gt=lower, le=upper) if above else Field(ge=lower, le=upper)]
    return Annotated[float, Unit(unit, f"1 {unit}", lower, upper, lower_allowed=not above)]
