"""Public records of other laboratories: where each file stands, the study it is read with, what was published of it.

No file is part of this project. A case whose files are not there is skipped, and told.
"""

from __future__ import annotations

from dataclasses import dataclass, field

CARTS = "Control-Linear-Vibrations/src/Tests/Identification/0405_identification_cartDetached"
PENDULA = "masterThesisMatlab/parameterEstimation/data"
EMPS = "sysid-neural-continuous/examples/EMPS/data"
CARRIAGE = "friction-identification/input"


@dataclass(frozen=True)
class Case:
    """One study of public records.

    Parameters
    ----------
    name : str
    source : str
        Repository, and what it says of a licence.
    files : tuple of str
        Below the folder that is named; ``{folder}`` in the study stands for it.
    study : str
        TOML without its first two lines.
    published : dict of parameter to (value, standard deviation or None), in SI units
    predicts : str
        TOML of the records that the values are then put to; empty where there are none.
    """

    name: str
    source: str
    files: tuple[str, ...]
    study: str
    published: dict[str, tuple[float, float | None]] = field(default_factory=dict)
    predicts: str = ""


def _emps(record: str) -> str:
    return f"""[rig]
kind = "guided_mass"
[channels]
time = {{ column = "t", unit = "s" }}
position = {{ column = "qm", unit = "m" }}
force = {{ column = "vir", unit = "V", scale = "35.150652 N/V" }}
[model]
effects = ["guide.viscous_friction"]
[[records]]
file = "{{folder}}/{EMPS}/{record}"
"""


def _folders(spring: str) -> tuple[str, str]:
    """Of a cart alone, and with two masses on it."""
    return f"{spring}_{'Hand' if spring == 'Klow' else 'hand'}_Nomass2", f"{spring}_hand_2mass2"


def _cart(spring: str) -> str:
    text = """[rig]
kind = "guided_mass"
driven_by = "nothing"
[channels]
position = { column = "column 1", unit = "cm" }
[model]
effects = ["guide.spring", "guide.viscous_friction"]
"""
    for folder, added in zip(_folders(spring), ("0 kg", "0.986 kg"), strict=True):
        text += f'[[records]]\nfile = "{{folder}}/{CARTS}/{folder}/data0000.txt"\nname = "{folder}"\n'
        text += f'sampling_rate = "200 Hz"\nadded_mass = "{added}"\n'
    return text


def _pendulum(file: str) -> str:
    return f"""[rig]
kind = "pendulum"
{{known}}
[channels]
time = {{ column = "column 1", unit = "s" }}
angle = {{ column = "column 2", unit = "rad" }}
[[records]]
file = "{{folder}}/{PENDULA}/{file}"
"""


STATED = "no licence stated: try it, do not pass it on"
CASES: tuple[Case, ...] = (
    Case(
        "EMPS, and with pulses",
        "forgi86/sysid-neural-continuous (Apache 2.0); data of Janot, Gautier and Brunot (2019)",
        (f"{EMPS}/DATA_EMPS.mat", f"{EMPS}/DATA_EMPS_PULSES.mat"),
        _emps("DATA_EMPS.mat"),
        {
            "mass": (95.1089, None),
            "friction": (20.3935, None),
            "force_offset": (-3.1648, None),
            "guide.viscous_friction.viscous_coefficient": (203.5034, None),
        },
        predicts=_emps("DATA_EMPS_PULSES.mat"),
    ),
    *(
        Case(
            f"cart on a spring, {words}",
            f"rssalessio/Control-Linear-Vibrations ({STATED})",
            tuple(f"{CARTS}/{folder}/data0000.txt" for folder in _folders(spring)),
            _cart(spring),
            {"mass": (0.5685, 0.0141), "guide.spring.spring_stiffness": (stiffness, None)},
        )
        for spring, words, stiffness in (("Khigh", "hard", 712.6), ("Kmed", "medium", 315.5), ("Klow", "soft", 175.3))
    ),
    Case(
        "pendulum 1",
        f"nielsSkov/masterThesisMatlab ({STATED})",
        (f"{PENDULA}/pend1test/test1pend1.csv",),
        _pendulum("pend1test/test1pend1.csv").replace("{known}", 'mass = "0.2235 kg"\ncentre_distance = "0.31692 m"'),
        {"length": (0.31692, None), "damping": (0.5e-3, None), "friction": (4.1e-3, None)},
    ),
    Case(
        "pendulum 2",
        f"nielsSkov/masterThesisMatlab ({STATED})",
        (f"{PENDULA}/pend2test/test1pend2.csv",),
        _pendulum("pend2test/test1pend2.csv").replace("{known}", 'mass = "0.2642 kg"\ncentre_distance = "0.2 m"'),
        {"length": (0.2006, None), "damping": (0.1e-3, None), "friction": (5.7e-3, None)},
    ),
    Case(
        "cart on a belt, at 0.20 m",
        f"nielsSkov/masterThesisMatlab ({STATED})",
        (f"{PENDULA}/cartTest3/0m20.csv",),
        f"""[rig]
kind = "guided_mass"
[channels]
time = {{ column = "column 1", unit = "s" }}
force = {{ column = "column 2", unit = "A", scale = "3.3357 N/A" }}
position = {{ column = "column 3", unit = "m" }}
[model]
effects = ["guide.viscous_friction", "guide.asymmetric_friction"]
[parameters.force_offset]
fixed = "0 N"
[[records]]
file = "{{folder}}/{PENDULA}/cartTest3/0m20.csv"
""",
        {"mass": (6.28, None)},
    ),
    Case(
        "guided carriage at 2 kHz",
        f"KonradMnich/friction-identification ({STATED})",
        (f"{CARRIAGE}/a3NI.csv", f"{CARRIAGE}/a3MR.csv"),
        f"""[rig]
kind = "guided_mass"
measured = "velocity"
[channels]
force = {{ column = "Force", unit = "V", scale = "-200 N/V" }}
velocity = {{ column = "Analog 1", unit = "rpm", scale = "-0.33333333 mm/s/rpm" }}
[model]
effects = ["guide.viscous_friction"]
[parameters.force_offset]
fixed = "25.75 N"
[[records]]
file = "{{folder}}/{CARRIAGE}/a3NI.csv"
beside = {{ file = "{{folder}}/{CARRIAGE}/a3MR.csv", clock_offset = "-4 ms" }}
""",
        {
            "mass": (24.7, None),
            "friction": (10.0, None),
            "guide.viscous_friction.viscous_coefficient": (67.44, None),
        },
    ),
)
