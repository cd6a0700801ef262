"""Errors in what is known of a rig and its records, and in what a study states of them."""

from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import FibreLaw, RigLaw, StudyLaw, quantity


class ShareOfStated(StudyLaw):
    """A condition that is off by a share of what is stated."""

    error: jax.Array = quantity("-", "relative error of what is stated", 0.05, symbol="δ")

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """That condition times 1 + δ."""
        return conditions | {self.condition: conditions[self.condition] * (1.0 + self.error)}


class SizeOfStated(StudyLaw):
    """A condition that is off by as much as its own unit tells."""

    error: jax.Array = quantity("-", "error of what is stated", 0.01, symbol="δ")

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """That condition and δ."""
        return conditions | {self.condition: conditions[self.condition] + self.error}


class WeightMass(ShareOfStated):
    """A weight whose mass is not what the study says.

    Law
    ---
    ``m (1 + δ)`` instead of m.

    Valid range
    -----------
    A few percent.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.weight_mass"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    condition: ClassVar[str] = "weight_mass"
    error: jax.Array = quantity(
        "-", "relative error of the mass that is stated", 0.02, lower=-0.5, upper=1.0, symbol="δ"
    )


class AddedMass(ShareOfStated):
    """A mass added to the weight that is not what the study says.

    Law
    ---
    ``m_a (1 + δ)`` instead of m_a.

    Valid range
    -----------
    Records of which some have a mass added, and some another or none.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.added_mass"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    condition: ClassVar[str] = "added_mass"
    error: jax.Array = quantity(
        "-", "relative error of the added mass that is stated", 0.05, lower=-1.0, upper=2.0, symbol="δ"
    )


class Inclination(SizeOfStated):
    """A guide whose slope is not what the study says.

    Law
    ---
    ``α + δ`` instead of α.

    Valid range
    -----------
    A few degrees; straight down it shows in its square only.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.inclination"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    condition: ClassVar[str] = "inclination"
    error: jax.Array = quantity("rad", "error of the slope that is stated", 0.01, lower=-0.2, upper=0.2, symbol="δ")


class Lift(SizeOfStated):
    """A weight that falls from another height than the study says.

    Law
    ---
    ``h + δ`` instead of h, in all records.

    Valid range
    -----------
    The same error in all records.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.lift"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FALL})
    condition: ClassVar[str] = "lift"
    error: jax.Array = quantity("m", "error of the height that is stated", 0.0002, lower=-0.05, upper=0.05, symbol="δ")


class WrapAngle(ShareOfStated):
    """A pulley that the fibre lies on over another angle than the study says.

    Law
    ---
    ``φ (1 + δ)`` instead of φ.

    Valid range
    -----------
    With friction on the pulley; its coefficient takes the error up in full.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.wrap_angle"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PULLEY})
    condition: ClassVar[str] = "wrap_angle"
    needs: ClassVar[tuple[str, ...]] = ("pulley.capstan_friction",)
    error: jax.Array = quantity(
        "-", "relative error of the angle that is stated", 0.05, lower=-0.5, upper=1.0, symbol="δ"
    )


class Gain(ShareOfStated):
    """A drive whose force on the mass is not what the study says.

    Law
    ---
    ``g (1 + δ)`` instead of g.

    Valid range
    -----------
    Mass, friction and offset take the error up in full unless they are held.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.gain"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PUSH})
    condition: ClassVar[str] = "gain"
    error: jax.Array = quantity(
        "-", "relative error of the gain that is stated", 0.02, lower=-0.5, upper=1.0, symbol="δ"
    )


class ClockError(StudyLaw):
    """A logger whose clock, or sampling rate, is not what the study or the file says.

    Law
    ---
    ``t (1 + δ)`` instead of t: with δ > 0 a record lasts longer than it says.

    Valid range
    -----------
    Constant over all records.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.clock"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    retimes: ClassVar[bool] = True
    error: jax.Array = quantity(
        "-", "relative error of the times that are stated", 0.01, lower=-0.5, upper=1.0, symbol="δ"
    )

    def pace(self) -> jax.Array:
        """1 + δ."""
        return 1.0 + self.error


class OtherFibre(FibreLaw):
    """A record that was taken with another fibre than the others.

    Law
    ---
    Elastic tension ``k e (1 + a)`` and viscous tension ``b e' (1 + c)`` in that record.

    Valid range
    -----------
    a, c > -1.

    Source
    ------
    Two fibres, two pairs of constants.
    """

    name: ClassVar[str] = "study.other_fibre"
    family: ClassVar[str] = "in"
    strength: ClassVar[tuple[str, ...]] = ("stiffness_change", "damping_change")
    # Relative, so that a search moves the logarithm of 1 + a: along it the valley is straight in which the record's own
    # deviation explains the change as well.
    stiffness_change: jax.Array = quantity(
        "-", "relative change of the stiffness", 0.2, lower=-0.95, upper=20.0, relative=True, symbol="a"
    )
    damping_change: jax.Array = quantity(
        "-", "relative change of the damping", 0.2, lower=-0.95, upper=20.0, relative=True, symbol="c"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + a."""
        return 1.0 + self.stiffness_change

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + c."""
        return 1.0 + self.damping_change


class InclinationError(RigLaw):
    """A guide whose slope is not quite what was noted.

    Law
    ---
    ``α + δ`` instead of α.

    Valid range
    -----------
    A few degrees. Records do not tell it from `study.inclination`, which a search tries; this one is tried where it is
    named.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "rig.inclination_error"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    angle: jax.Array = quantity("rad", "error of the noted inclination", 0.01, lower=-0.1, upper=0.1, symbol="δ")

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """α + δ."""
        return conditions | {"inclination": conditions["inclination"] + self.angle}
