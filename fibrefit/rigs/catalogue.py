"""All kinds of rig, by the name a study calls them."""

from __future__ import annotations

from fibrefit.rigs.fibre_mass import FIBRE_MASS
from fibrefit.rigs.guided_mass import GUIDED_MASS
from fibrefit.rigs.inverted_pendulum import INVERTED_PENDULUM
from fibrefit.rigs.pulley_drive import PULLEY_DRIVE
from fibrefit.rigs.rig import Rig

RIGS: dict[str, Rig] = {rig.kind: rig for rig in (FIBRE_MASS, PULLEY_DRIVE, INVERTED_PENDULUM, GUIDED_MASS)}
