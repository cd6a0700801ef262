"""The study of each kind of rig: written out, or derived from what the rig declares."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from fibrefit.core.declarations import declared_in
from fibrefit.study.rigs.derived import derived_study
from fibrefit.study.rigs.fibre_mass import FibreMassStudy
from fibrefit.study.rigs.guided_mass import GuidedMassStudy
from fibrefit.study.rigs.inverted_pendulum import InvertedPendulumStudy
from fibrefit.study.rigs.pendulum import PendulumStudy
from fibrefit.study.rigs.pulley_drive import PulleyDriveStudy
from fibrefit.study.study import Study

WRITTEN_OUT: dict[str, type[Study]] = {
    "fibre_mass": FibreMassStudy,
    "pulley_drive": PulleyDriveStudy,
    "inverted_pendulum": InvertedPendulumStudy,
    "guided_mass": GuidedMassStudy,
    "pendulum": PendulumStudy,
}
"""Those that say more than their rig declares, such as what was not measured, or that must be read without JAX."""


@cache
def study_type(kind: str) -> type[Study]:
    """What a study of a kind of rig may say.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    """
    if kind in WRITTEN_OUT:
        return WRITTEN_OUT[kind]
    # Found by its name, as a plug-in is: the equations beside the declaration stand floors above.
    module, name = declared_in(kind)
    return derived_study(getattr(import_module(module), name))
