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
# # Plan the next experiment
#
# Five drops are measured and fitted. There is time for one more. Which one?

# %% [markdown]
# ## The equation
#
# The records at hand hold the information $H = \sum_r J_r^{\mathsf T}\,\Sigma_r^{-1} J_r$ about the parameters, $J_r$ being the derivative of
# the motion of record $r$ by them. A further record $x$ adds its own, so the errors it would leave are known before it is taken:
#
# $$\sigma_i^2(x) = \bigl[(H + J_x^{\mathsf T}\,\Sigma^{-1} J_x)^{-1}\bigr]_{ii}.$$
#
# Two explanations that explain the records alike are distinguished by the record in which they differ most.
#
# ## The study file

# %%
from pathlib import Path

import fibrefit
from fibrefit.workflow.design.plan import Aim

print(Path("../configs/drop_series/study.toml").read_text())

# %% [markdown]
# ## For smaller error bars

# %%
errors = fibrefit.plan("../configs/drop_series", Aim(purpose="errors", only=("guide.*",)))
print(errors.report())

# %%
errors.plot()

# %% [markdown]
# ## To tell two rivals apart
#
# The drops in the greased guide of the fourth notebook lack something. Is it a friction that grows with speed, or one that
# falls as sliding sets in? Which further drop would tell?

# %%
rivals = ("guide.viscous_friction", "guide.stribeck_friction")
told = fibrefit.plan("../configs/lubricated_guide", Aim(purpose="rivals", rivals=rivals, only=("guide.*",)))
print(told.report())

# %% [markdown]
# `fibrefit plan STUDY --rivals A,B` says the same on the command line, and `--cost record=2 --cost inclination=15` states in
# minutes what a record and a change of the rig cost. `fibrefit distinguish` lists which effects the records at hand could show, and from which strength.
