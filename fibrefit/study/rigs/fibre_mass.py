"""A weight in an inclined guide that falls into a fibre."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from fibrefit.study.quantity import Distance, Instant, Length, Mass, MassOrNone, Points, Position, Slope
from fibrefit.study.rigs.common import (
    OF_FIBRE_MASS,
    OF_POINTS,
    Channels,
    NoiseLevels,
    RecordTable,
    RigLimits,
    instead,
    optional,
    required,
)
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable


class FibreMassConstants(StudyTable):
    """Constants of a weight on one fibre in an inclined guide."""

    weight_mass: Mass = required("Mass of the moving weight.")
    added_mass: MassOrNone | None = optional("Mass added to the weight.")
    inclination: Slope = required("Angle of the guide to the horizontal; 90 deg is free fall.")
    fibre_length: Length | None = optional("Free length of the fibre; kept with the result, not used by the model.")
    fibre_mass: MassOrNone | None = optional(OF_FIBRE_MASS.format("the fibre"))


class FibreMassRecord(FibreMassConstants, RecordTable):
    """One drop: the weight is lifted, held, and let go."""

    lift: Distance | None = optional(
        "Height above the point where the fibre is just taut; found from the data when absent."
    )
    release: Instant | None = instead("When the weight was let go; found from the data when absent.")
    position_zero: Position | None = instead("Reading of the position where the fibre is just taut; found when absent.")


class FibreMassRig(FibreMassConstants):
    """``[rig]`` of a fibre-mass rig."""

    kind: Literal["fibre_mass"]
    masses_per_fibre: Points | None = optional(OF_POINTS)
    measured: Literal["force and position", "force"] = Field(
        default="force and position", description="force: no position was recorded; the lift is found then."
    )


class FibreMassLimits(RigLimits):
    """What a rig can do in which a weight falls into a fibre."""

    lift: tuple[Distance, Distance] | None = optional("Height above the point where the fibre is just taut.")
    inclination: tuple[Slope, Slope] | None = optional("Angle of the guide to the horizontal.")
    added_mass: tuple[MassOrNone, MassOrNone] | None = optional("Mass added to the weight.")


class FibreMassStudy(Study):
    """Study of a fibre-mass rig."""

    @property
    def variant(self) -> str:
        """``force_only`` where no position was measured."""
        return "force_only" if self.rig.measured == "force" else ""

    base_parameters: ClassVar[dict[str, str]] = {"stiffness": "N/m", "damping": "N s/m", "friction": "N"}
    rig: FibreMassRig
    channels: Channels = Channels()
    noise: NoiseLevels = NoiseLevels()
    limits: FibreMassLimits = FibreMassLimits()
    records: tuple[FibreMassRecord, ...] = Field(min_length=1)
