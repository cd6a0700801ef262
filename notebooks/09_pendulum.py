# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # The pendulum
#
# An inverted pendulum is held upright by two fibres whose far ends are moved to and fro together. Its response depends on
# where it comes from: from rest, from a lower or from a higher frequency. A sweep finds all three.

# %% [markdown]
# ## The equation
#
# With the moment of inertia $J$ about the pivot, mass $m$, rod length $l$ and attachment height $h$,
#
# $$J\,\ddot\varphi = \tfrac12\,m g l \sin\varphi + h\,\bigl(T_1\cos\beta_1 - T_2\cos\beta_2\bigr), \qquad
# T_i = \max(0,\; k e_i + b\,\dot e_i),$$
#
# where $\varphi$ is counted towards the first fibre, $e_i$ are the stretches of the two fibres, which follow from the
# geometry and the drive, and $\beta_i$ the angles between the fibres and the way of their attachment. Fibres go slack, so
# the response is not linear.
#
# ## The study file

# %%
from pathlib import Path

import fibrefit

print(Path("../configs/pendulum/study.toml").read_text())

# %% [markdown]
# A coarse grid is enough to see the jumps:

# %%
study = fibrefit.load_study("../configs/pendulum", ["sweep.lowest=2 Hz", "sweep.highest=8 Hz", "sweep.step=0.1 Hz"])
swept = fibrefit.sweep(study)
print(swept.report())

# %%
swept.plot()

# %% [markdown]
# Where the branches differ, what the pendulum does depends on its history: it swings little when the frequency comes from
# below, much when it comes from above. Floquet multipliers say which of the motions are stable: here all that were found.

# %% [markdown]
# ## A plain pendulum, let go once
#
# The rig `pendulum` needs no drive and no force: its angle alone is measured. With the equivalent length $L$, and damping $c$ and
# friction $F$ per unit of inertia,
#
# $$\ddot\varphi = -\frac{g}{L}\sin\varphi - c\,\dot\varphi - F\,\mathrm{sign}\,\dot\varphi .$$
#
# The period tells $L$; how the swing dies out tells friction, which takes the same from every swing, from damping, which takes a
# share of it. One swing tells them apart badly (the report has their correlation): their intervals are as wide as that asks. No
# moment of inertia is stated, so that it is taken for 1 kg m²: the damping is printed in N m s for 1/s, the friction in N m for 1/s².
# Here a record is made by another integrator, with noise of 1 mrad, so that the answer is known.

# %%
import numpy as np
from scipy.integrate import solve_ivp

LENGTH, DAMPING, FRICTION = 0.42, 0.05, 0.03


def swing(time, state):
    angle, rate = state
    return rate, -9.81 / LENGTH * np.sin(angle) - DAMPING * rate - FRICTION * np.sign(rate)


times = np.arange(0.0, 15.0, 0.01)
angle = solve_ivp(swing, (0.0, 15.0), [0.5, 0.0], t_eval=times, max_step=1e-3, rtol=1e-8).y[0]
angle += np.random.default_rng(1).normal(scale=1e-3, size=angle.size)

folder = Path("results/swing")
folder.mkdir(parents=True, exist_ok=True)
np.savetxt(
    folder / "swing.csv", np.column_stack([times, angle]), "%.6f", ",", header="time [s],angle [rad]", comments=""
)
(folder / "study.toml").write_text(
    """schema = "fibrefit/study/1"
name = "a swing"

[rig]
kind = "pendulum"

[[records]]
file = "swing.csv"
"""
)
result = fibrefit.fit(folder)
print(result.report())

# %%
for name, true in (("length", LENGTH), ("damping", DAMPING), ("friction", FRICTION)):
    found = result.parameters[name]
    print(
        f"{name:<9} true {true:<6} found {found.value:.5f}, 95 %: {found.interval_95[0]:.5f} to {found.interval_95[1]:.5f}"
    )

# %%
result.plot().only("overview")
