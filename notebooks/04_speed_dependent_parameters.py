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
# # Parameters that depend on speed
#
# The same rig, but its guide has been greased. Something in it now depends on how fast the weight moves: the friction
# of the guide may grow with speed, or fall as sliding sets in, or it may be the fibre whose damping depends on the
# elongation rate. Which of them is it, and how sure can we be?

# %% [markdown]
# ## The equation
#
# To the friction $F_f$ of the base model, or to the damping $b$ of the fibre, comes something that depends on a speed:
#
# $$F = F_f + c\,v, \qquad F = F_f + F_x\,\mathrm e^{-(v/v_s)^2}, \qquad b(\dot e) = b\,(1 + f(|\dot e|)),$$
#
# a viscous guide, a Stribeck guide, and a fibre whose damping depends on the rate of stretch. `fibrefit effects NAME` prints
# each law with its parameters.
#
# ## The study file

# %%
from pathlib import Path

print(Path("../configs/lubricated_guide/study.toml").read_text())

# %%
import numpy as np

import fibrefit

STUDY = "../configs/lubricated_guide"
laws = {
    "base model": (),
    "viscous guide": ("guide.viscous_friction",),
    "Stribeck guide": ("guide.stribeck_friction",),
    "rate-dependent fibre": ("fibre.rate_dependent_damping",),
}
studies = {name: fibrefit.load_study(STUDY, [f"model.effects={list(effects)}"]) for name, effects in laws.items()}
fits = {name: fibrefit.fit(study, starts=8) for name, study in studies.items()}
for name, fit in fits.items():
    gaps = {channel: round(gap.ratio, 2) for channel, gap in fit.identification.gap.items()}
    print(f"{name:<22} {fit.status:<8} gap {gaps}")

# %% [markdown]
# One of the four leaves nothing but noise. The Stribeck law finds nothing to explain: its excess is zero, so that nothing
# tells its velocity, and its fit says `failed`. The base model hides what it lacks in its three numbers, as well as it
# can:

# %%
for name, fit in fits.items():
    values = [f"{key.rpartition('.')[2]} {value.value:.5g} {value.unit}" for key, value in fit.parameters.items()]
    print(f"{name:<22} {', '.join(values)}")

# %%
fits["base model"].plot().only("record drop_20mm_90deg.csv")

# %%
fits["viscous guide"].plot().only("record drop_20mm_90deg.csv")

# %% [markdown]
# ## Is there more to it?
#
# Two effects explain the records at least as well as one of them. Whether the second is worth having, the posterior
# says: how well does each model predict stretches of the records that were left out (cross-validation), and how likely
# does it make what was measured?

# %%
viscous = fibrefit.sample(studies["viscous guide"], start=fits["viscous guide"])
viscous.save("results/viscous", force=True)
both_study = fibrefit.load_study(STUDY, ['model.effects=["guide.viscous_friction", "fibre.rate_dependent_damping"]'])
both = fibrefit.sample(both_study, compare=["results/viscous"])
for name, sampled in (("one effect", viscous), ("two effects", both)):
    r_hat = max(found.r_hat for found in sampled.parameters.values())
    ess = min(found.ess_bulk for found in sampled.parameters.values())
    print(f"{name:<12} {sampled.status}: R-hat up to {r_hat:.3f}, effective sample size {ess:.0f} or more")
(against,) = both.compared
print(f"delta elpd_loo of two effects: {against.elpd.value:+.1f} +/- {against.elpd.error:.1f}")
if against.log_evidence is not None:
    print(f"log Bayes factor of two effects: {against.log_evidence.value:+.1f}")

# %% [markdown]
# Prediction does not tell the two models apart: their difference is about as large as its error. The Bayes factor, under the default prior of
# the factor, speaks against the second effect. That factor, if there were one, would be:

# %%
factor = both.parameters["fibre.rate_dependent_damping.damping_rate_factor"]
print(f"damping_rate_factor {factor.mean:.2g}, 95 %: {factor.interval[0]:.2g} to {factor.interval[1]:.2g}")

# %% [markdown]
# ## Friction against speed
#
# Every draw of the posterior is a friction law. Together they make a band, widest where these records say least. It ends at
# 0.6 m/s, which the drops from 20 mm reach: beyond that no record says anything.

# %%
speeds = np.linspace(0.0, 0.6, 7)
level = viscous.draws["friction"]
slope = viscous.draws["guide.viscous_friction.viscous_coefficient"]
print("speed / (m/s)   friction / N: 5 %, 50 %, 95 %")
for speed in speeds:
    low, middle, high = np.quantile(level + slope * speed, [0.05, 0.5, 0.95])
    print(f"{speed:13.1f}   {low:.3f}  {middle:.3f}  {high:.3f}")

# %%
viscous.plot_corner("damping", "friction", "guide.viscous_friction.viscous_coefficient")

# %% [markdown]
# Damping of the fibre and viscous friction of the guide both take energy in proportion to a speed. That the drops
# under 45 degrees and from another height distinguish them can be checked before anything is
# measured: `fibrefit distinguish`.
