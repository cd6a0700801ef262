"""Constants of the simulated rigs, and which of them each effect sets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

GRAVITY = 9.81
DROP, DRIVE = "fibre_mass", "pulley_drive"
BOTH = (DROP, DRIVE)
NOMINAL_WEIGHT = 3.096 * GRAVITY


class Laws(NamedTuple):
    """Everything a kernel needs to know, SI; the defaults are the base model with nothing added.

    `side` is +1 where the fibre pulls the weight towards + (pulley_drive) and -1 where it pulls towards - (fibre_mass);
    `pull` is the share of gravity along the guide, with sign; a reciprocal stands for what is infinite by default.
    """

    stiffness: float = 2e4
    damping: float = 25.0
    friction: float = 4.0
    mass: float = 3.096
    pull: float = 0.0
    side: float = -1.0
    heaviside: float = 0.0
    # guide
    viscous_coefficient: float = 0.0
    viscous_asymmetry: float = 0.0
    breakaway_excess: float = 0.0
    stribeck_velocity: float = 0.02
    load_coefficient: float = 0.0
    drag_coefficient: float = 0.0
    asymmetry: float = 0.0
    bristle_stiffness: float = 0.0
    bristle_damping: float = 0.0
    gauge_force: float = 0.0
    gauge_spring: float = 0.0
    # fibre
    hardening: float = 0.0
    toe_depth: float = 0.0
    toe_length: float = 1e-3
    branch_stiffness: float = 0.0
    relaxation_time: float = 1.0
    damping_rate_factor: float = 0.0
    stiffness_rate_factor: float = 0.0
    hysteretic_stiffness: float = 0.0
    beta: float = 0.0
    gamma: float = 0.0
    length_offset: float = 0.0
    # pulley and drive
    rim_mass: float = 0.0
    bearing_friction: float = 0.0
    capstan: float = 0.0
    eccentricity: float = 0.0
    pulley_radius: float = 0.04
    mount_compliance: float = 0.0
    lateral_offset: float = 0.0
    guide_distance: float = 1.0
    # outside the catalogue
    roughness: float = 0.0
    roughness_length: float = 5e-3
    stop_stiffness: float = 0.0
    stop_position: float = 1.0
    slip_length: float = 0.0
    slip_instant: float = 1e9
    detent_force: float = 0.0
    detent_pitch: float = 5e-3
    kink: float = 0.0
    kink_stretch: float = 1e-3
    warm_up: float = 0.0
    warm_up_time: float = 0.5
    drive_speed_factor: float = 0.0
    fade: float = 0.0
    fade_time: float = 1.0
    load_damping: float = 0.0
    wear: float = 0.0
    wear_path: float = 0.1
    heating: float = 0.0
    eddy_coefficient: float = 0.0
    eddy_velocity: float = 0.2
    # of a series
    stiffness_exponent: float = 0.0
    damping_exponent: float = 0.0
    friction_exponent: float = 0.0


@dataclass(frozen=True)
class Hidden:
    """An effect that can be hidden in data.

    Parameters
    ----------
    scaled : parameters that grow with the strength, with their value at strength 1; a name that the catalogue does not
        know is turned into one it does by `values_at`
    fixed : shape parameters, with the range they are drawn from (log-uniform)
    rigs : kinds of rig it makes sense for
    signed : whether the opposite sign is as plausible
    null : value of the scaled parameters at strength 0
    least, most : range of strengths that are physical
    needs : another effect that must be present, hidden as well
    """

    scaled: dict[str, float]
    fixed: dict[str, tuple[float, float]] = field(default_factory=dict)
    rigs: tuple[str, ...] = BOTH
    signed: bool = False
    null: float = 0.0
    least: float = 0.0
    most: float = 50.0
    needs: str | None = None


CATALOGUE: dict[str, Hidden] = {
    "guide.viscous_friction": Hidden({"viscous_coefficient": 3.0}),
    "guide.stribeck_friction": Hidden({"breakaway_excess": 2.0}, {"stribeck_velocity": (0.01, 0.05)}, most=6.0),
    "guide.load_dependent_friction": Hidden({"load_coefficient": 0.05}, most=8.0),
    "guide.quadratic_drag": Hidden({"drag_coefficient": 10.0}),
    "guide.asymmetric_friction": Hidden({"asymmetry": 0.2}, signed=True, most=4.5),
    "guide.asymmetric_viscous_friction": Hidden(
        {"viscous_asymmetry": 0.2}, signed=True, most=4.5, needs="guide.viscous_friction"
    ),
    "guide.presliding": Hidden({"bristle_compliance": 1e-5}, {"bristle_damping": (20.0, 100.0)}, most=20.0),
    "fibre.hardening": Hidden({"hardening": 40.0}, signed=True, most=10.0),
    "fibre.toe_region": Hidden({"toe_depth": 0.3}, {"toe_length": (2e-4, 1e-3)}, most=3.1),
    "fibre.maxwell_branch": Hidden({"branch_share": 0.1}, {"relaxation_time": (4e-3, 4e-2)}, most=10.0),
    "fibre.rate_dependent_damping": Hidden({"damping_rate_factor": 0.5}),
    "fibre.rate_dependent_stiffness": Hidden({"stiffness_rate_factor": 0.02}, most=20.0),
    "fibre.hysteresis": Hidden({"hysteretic_share": 0.1}, {"beta": (300.0, 900.0), "gamma": (100.0, 300.0)}, most=10.0),
    "fibre.mass": Hidden({"fibre_mass": 5e-3}, least=0.02, most=40.0),
    # Over a pulley it cannot be seen at all: the position is zeroed with the fibre under load.
    "fibre.free_length_offset": Hidden({"length_offset": 2e-4}, rigs=(DROP,), signed=True, most=10.0),
    "pulley.inertia": Hidden({"rim_mass": 0.05}, rigs=(DRIVE,), most=20.0),
    # It comes with a rim of 50 g, whose own gap no weak friction can undercut.
    "pulley.bearing_friction": Hidden({"bearing_friction": 0.5}, rigs=(DRIVE,), least=0.4, most=20.0),
    "pulley.capstan_friction": Hidden({"capstan_coefficient": 0.02}, rigs=(DRIVE,), most=15.0),
    "pulley.eccentricity": Hidden({"eccentricity": 2e-4}, rigs=(DRIVE,), signed=True, most=20.0),
    "drive.compliance": Hidden({"mount_compliance": 5e-6}, rigs=(DRIVE,), most=20.0),
    "sensor.force_gain": Hidden({"gain": 0.02}, signed=True, null=1.0, most=10.0),
    "sensor.force_offset": Hidden({"offset": 0.5}, signed=True, most=20.0),
    "sensor.force_drift": Hidden({"drift": 0.5}, signed=True, most=20.0),
    "sensor.force_delay": Hidden({"delay": 5e-4}, most=20.0),
    "sensor.force_lag": Hidden({"time_constant": 5e-4}, most=20.0),
    "sensor.gauge_resonance": Hidden({"period": 5e-3}, {"damping_ratio": (0.03, 0.3)}, most=6.0),
    "sensor.position_gain": Hidden({"gain": 0.005}, signed=True, null=1.0, most=20.0),
    "sensor.dial_gauge_force": Hidden({"gauge_force": 0.8}, {"gauge_travel": (0.02, 0.08)}, most=10.0),
    "study.inclination": Hidden({"error": 0.005}, signed=True, most=10.0),
}

KNOWN_AS = {
    "open.warm_up_friction": "guide.friction_drift",
    "open.heating_guide": "guide.friction_drift",
    "open.fading_stiffness": "fibre.stiffness_drift",
    "open.curved_gauge": "sensor.gauge_nonlinearity",
    "open.slipping_knot": "fibre.knot_slip@1-5",
}
"""Causes that were outside the catalogue when they were chosen, and the effect whose law is theirs by now."""

ACTS_BY = {
    "open.position_dependent_friction": ("guide", ("position",)),
    "open.end_stop": ("guide", ("position",)),
    "open.detent": ("guide", ("position",)),
    "open.kinked_stiffness": ("fibre", ("stretch", "tension")),
    "open.load_dependent_damping": ("fibre", ("stretch", "tension")),
    "open.wearing_friction": ("guide", ("path",)),
    "open.eddy_drag": ("guide", ("speed",)),
    "open.drive_speed_stiffness": ("fibre", ("drive speed",)),
}
"""Port of the law of each cause that is still outside, and the variables it may be told as a function of."""

OUTSIDE: dict[str, Hidden] = {
    "open.position_dependent_friction": Hidden({"roughness": 0.3}, {"roughness_length": (3e-3, 12e-3)}, most=3.0),
    "open.end_stop": Hidden({"stop_stiffness": 100.0}, {"stop_position": (0.052, 0.07)}, rigs=(DRIVE,), most=100.0),
    "open.slipping_knot": Hidden({"slip_length": 1e-4}, most=20.0),
    "open.detent": Hidden({"detent_force": 1.0}, {"detent_pitch": (3e-3, 12e-3)}, most=10.0),
    "open.kinked_stiffness": Hidden({"kink_share": 0.2}, {"kink_load": (0.5, 1.5)}, signed=True, most=5.0),
    "open.warm_up_friction": Hidden({"warm_up": 0.5}, {"warm_up_time": (0.3, 1.0)}, most=10.0),
    "open.fading_stiffness": Hidden({"fade": 0.01}, {"fade_time": (0.3, 2.0)}, signed=True, most=20.0),
    "open.load_dependent_damping": Hidden({"load_damping": 0.2}, most=50.0),
    "open.wearing_friction": Hidden({"wear": 0.5}, {"wear_path": (0.05, 0.3)}, most=10.0),
    "open.heating_guide": Hidden({"heating": 0.05}, signed=True, most=5.0),
    "open.eddy_drag": Hidden({"eddy_coefficient": 2.0}, {"eddy_velocity": (0.05, 0.3)}, most=20.0),
    "open.curved_gauge": Hidden({"curvature": 1e-4}, signed=True, most=10.0),
    "open.drive_speed_stiffness": Hidden({"drive_speed_factor": 0.02}, rigs=(DRIVE,), most=20.0),
}

OF_SPEED: dict[str, Hidden] = {
    "fibre.stiffness_speed_exponent": Hidden({"stiffness_exponent": 0.02}, signed=True, most=5.0),
    "fibre.damping_speed_exponent": Hidden({"damping_exponent": 0.3}, signed=True, most=3.0),
    "guide.friction_speed_exponent": Hidden({"friction_exponent": 0.2}, signed=True, most=2.0),
}
"""Laws of speed that only a series is asked about."""

EFFECTS = CATALOGUE | OUTSIDE | OF_SPEED

CHAIN = "fibre.mass"
"""The one effect that needs a kernel of its own."""


def applicable(rig: str, *, outside: bool = False) -> tuple[str, ...]:
    """Names of the effects that make sense for a rig, those outside the catalogue where asked for."""
    return tuple(name for name, hidden in (OUTSIDE if outside else CATALOGUE).items() if rig in hidden.rigs)


def values_at(name: str, strength: float, shape: Mapping[str, float], stiffness: float) -> dict[str, float]:
    """Parameters of an effect, by the names of the catalogue.

    Parameters
    ----------
    name : of the effect
    strength : 0 for none at all; negative only where the effect is `signed`
    shape : its shape parameters
    stiffness : of the fibre, N/m: some strengths are shares of it
    """
    hidden = EFFECTS[name]
    values = {key: hidden.null + strength * unit for key, unit in hidden.scaled.items()} | dict(shape)
    for relative, absolute in (
        ("branch_share", "branch_stiffness"),
        ("hysteretic_share", "hysteretic_stiffness"),
        ("kink_share", "kink"),
    ):
        if relative in values:
            values[absolute] = values.pop(relative) * stiffness
    for inverse, direct in (
        ("bristle_compliance", "bristle_stiffness"),
        ("mount_compliance", "mount_stiffness"),
        ("period", "natural_frequency"),
    ):
        if inverse in values:
            values[direct] = 1.0 / values.pop(inverse)
    if "gauge_travel" in values:
        values["gauge_spring"] = values["gauge_force"] / values.pop("gauge_travel")
    if "kink_load" in values:
        values["kink_stretch"] = values.pop("kink_load") * NOMINAL_WEIGHT / stiffness
    return values
