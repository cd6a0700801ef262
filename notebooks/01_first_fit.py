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
# # First fit
#
# A weight hangs on a fibre, is lifted by some millimetres and let go. It falls, the fibre goes taut and throws it
# back, and after a few bounces it rests. The force at the upper end of the fibre and the position of the weight
# were recorded 2000 times a second, five times over.
#
# From these records we want the stiffness and the damping of the fibre, the friction of the guide, and a plain
# answer to the question whether a model with these three numbers is good enough.

# %% [markdown]
# ## The equation
#
# The weight of mass $m$ slides in a guide inclined by $\alpha$; $u$ is its position along the guide, $e = u$ the stretch of the
# fibre. With stiffness $k$, damping $b$ and friction $F_f$,
#
# $$m\,\ddot u = m g \sin\alpha - T - F_f\,\operatorname{sgn}\dot u, \qquad
# T = \begin{cases}\max(0,\; k e + b\,\dot e) & e > 0 \\ 0 & e \le 0.\end{cases}$$
#
# A fibre pulls and never pushes: where it is slack, $T = 0$ and the weight falls freely.
#
# ## The study file

# %%
from pathlib import Path

print(Path("../configs/drop_series/study.toml").read_text())

# %%
import fibrefit

study = fibrefit.load_study("../configs/drop_series")
print(study.name)
for record in study.records:
    measured = fibrefit.read_record(study.path_of(record.file))
    print(f"  {record.label}: lifted by {1e3 * record.lift:.0f} mm, {len(measured.time)} samples")

# %% [markdown]
# The study says what was measured and on which rig. It says nothing of starting values: they come from the
# records, as do the zero of the position, the moment of release and the noise of each channel.

# %%
result = fibrefit.fit(study)
print(result.report())

# %% [markdown]
# The report ends with the checks behind its verdict. As numbers, in SI units:

# %%
for name, estimate in result.parameters.items():
    low, high = estimate.interval_95
    print(f"{name:<10} {estimate.value:10.6g} {estimate.unit:<6} 95 %: {low:.6g} to {high:.6g}")
print("status:", result.status)

# %% [markdown]
# What was measured against what the model says, with the residual under it, and the first contact under a
# magnifier:

# %%
figures = result.plot()
figures.only("record drop_20mm_90deg.csv", "snaps")

# %% [markdown]
# Nearly all starts end in one minimum: the search did not depend on where it began. The ways of estimating an error do not
# agree: taken for white, the noise makes error bars three times too small, as it is autocorrelated. Those that are reported
# allow for that.

# %%
figures.only("starts", "errors")

# %% [markdown]
# ## A record the fit has not seen
#
# One more drop was kept aside. It is predicted with the values that were found; only what belongs to that record
# alone, its zero and its moment of release, is left to find.

# %%
unseen = result.predict(fibrefit.load_study("../configs/drop_series/holdout"))
print(unseen.report())

# %%
unseen.plot().only("record drop_14mm_60deg.csv")

# %% [markdown]
# To keep a result: `result.save("results/drop_series")` writes the numbers for programs, everything else as HDF5,
# the study and the overview; `fibrefit show results/drop_series --figures png` draws the other figures.
