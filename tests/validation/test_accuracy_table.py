"""The figures of accuracy of the drop rig, as a table: against converged trajectories, and against differences."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from tests.simulation.drops import VALUES, deviation, drop, jacobian, respond
from tests.validation.reference import DERIVATIVE, effect_values, index, names, table

#: Asked of the base model at default settings: root mean square over the range.
FORCE, POSITION = 2e-4, 2e-5
#: Asked of derivatives against central differences of the same program.
DIFFERENCES = 1e-3
STEP = 1e-6
SYMBOLS = {"stiffness": "k", "damping": "b", "friction": "Fc"}


@pytest.mark.slow
def test_deviations_from_the_reference() -> None:
    rows = []
    for name in (name for name in names("fibre_mass__") if "point_masses" not in name):
        effect = index()[name]["effect"]
        effects = () if effect == "base" else (CATALOGUE[effect],)
        true, found = table(name), respond(drop(), effects, **effect_values(name))
        rows.append((effect, *(deviation(found[role][1:], true[role]) for role in ("force", "position"))))
    print("\nrms deviation from converged trajectories, over the range of the channel")
    print(f"{'':34}{'force':>10}{'position':>10}")
    for effect, force, position in rows:
        print(f"{effect:34}{force:10.1e}{position:10.1e}")
    base = next(row for row in rows if row[0] == "base")
    assert base[1] <= FORCE
    assert base[2] <= POSITION


@pytest.mark.slow
def test_derivatives_against_reference_and_differences() -> None:
    true, found = table("fibre_mass__base"), jacobian(drop())
    print("\nrelative rms error of the derivatives of the base model")
    print(f"{'':22}{'reference':>12}{'differences':>12}")
    for parameter, symbol in SYMBOLS.items():
        size = STEP * VALUES[parameter]
        up, down = (respond(drop(), **{parameter: VALUES[parameter] + s}) for s in (size, -size))
        for role in ("force", "position"):
            exact = found[role][parameter]
            column = true[f"d {role} / d {symbol}"]
            against = np.sqrt(np.mean((exact[1:] - column) ** 2) / np.mean(column**2))
            # Where a snap passes a sample between the two runs a difference holds the jump itself.
            error = np.abs((up[role] - down[role]) / (2.0 * size) - exact)
            own = np.sqrt(np.mean(np.sort(error)[: -len(error) // 100] ** 2) / np.mean(exact**2))
            print(f"d {role} / d {parameter:10}{against:12.1e}{own:12.1e}")
            assert against <= DERIVATIVE
            assert own <= DIFFERENCES
