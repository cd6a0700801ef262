"""The study of each kind of rig, by the name it goes by there."""

from __future__ import annotations

from fibrefit.study.rigs.fibre_mass import FibreMassStudy
from fibrefit.study.rigs.guided_mass import GuidedMassStudy
from fibrefit.study.rigs.inverted_pendulum import InvertedPendulumStudy
from fibrefit.study.rigs.pendulum import PendulumStudy
from fibrefit.study.rigs.pulley_drive import PulleyDriveStudy
from fibrefit.study.study import Study

STUDIES: dict[str, type[Study]] = {
    "fibre_mass": FibreMassStudy,
    "pulley_drive": PulleyDriveStudy,
    "inverted_pendulum": InvertedPendulumStudy,
    "guided_mass": GuidedMassStudy,
    "pendulum": PendulumStudy,
}
