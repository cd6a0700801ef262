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
# $$J\,\ddot\varphi = \tfrac12\,m g l \sin\varphi + h\,\bigl(T_2\cos\beta_2 - T_1\cos\beta_1\bigr), \qquad
# T_i = \max(0,\; k e_i + b\,\dot e_i),$$
#
# where $e_i$ are the stretches of the two fibres, which follow from the geometry and the drive, and $\beta_i$ the angles
# between the fibres and the way of their attachment. Fibres go slack, so the response is not linear.
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
# below, much when it comes from above. Floquet multipliers say which of the motions is stable.
#
# A plain pendulum, let go once, of which the angle alone is measured, is the rig `pendulum`; its study needs its mass and the
# distance of its centre.
