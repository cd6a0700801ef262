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
# # Discover what is missing
#
# The same rig, another fibre. The model that served so well for the first one, a stiffness, a damping and a
# friction, does not explain these records. What does it lack?

# %% [markdown]
# ## The equation
#
# The first model is that of the first notebook, $T = \max(0, k e + b\,\dot e)$ in a taut fibre. What is added to it is a law
# with a strength $A$ that is zero where the effect is absent. An effect is weighed by the Bayes factor
#
# $$\ln B = \ln \frac{\int p(y \mid \theta, A)\,p(\theta)\,p(A)\,\mathrm d\theta\,\mathrm dA}{\int p(y \mid \theta, A = 0)\,p(\theta)\,\mathrm d\theta}.$$
#
# ## The study file

# %%
from pathlib import Path

print(Path("../configs/second_fibre/study.toml").read_text())

# %%
import fibrefit

study = fibrefit.load_study("../configs/second_fibre")
first = fibrefit.fit(study)
for channel, gap in first.identification.gap.items():
    print(f"{channel}: {gap.ratio:.2f} times the noise")
print("status:", first.status)

# %% [markdown]
# The values alone would not have shown it: they look plausible, and their error bars are small. The residuals do:
# they are no noise.

# %%
first.plot().only("record drop_20mm_90deg.csv")

# %% [markdown]
# ## The search
#
# Of every effect that is looked for on this rig the gain is predicted; those that promise enough are added, and everything
# is fitted again. An effect is named only if the logarithm of its Bayes factor exceeds 5, where records may differ a little in their base
# parameters; how probable as much is by chance for the best of so many stands beside it. It takes two minutes; `seconds` leaves it as long as it
# needs on a machine that is busy.

# %%
found = fibrefit.discover(study, seconds=1800.0)
print(found.report())

# %% [markdown]
# ## Where the first model went wrong, and what is left

# %%
figures = found.plot()
figures.only("gap", "places", "candidates")

# %%
figures.only("record drop_20mm_90deg.csv", "states", "map", "spectrum")

# %% [markdown]
# ## What it does to the parameters
#
# Parameters of a model that lacks something carry what it lacks, as well as they can.

# %%
for name, after in found.parameters.items():
    before = first.parameters.get(name)
    said = f"{before.value:10.6g} -> " if before else " " * 14
    print(f"{name:<40} {said}{after.value:10.6g} +/- {after.std_error:.2g} {after.unit}")

# %% [markdown]
# ## A record that was not fitted
#
# Predicted with what the search found. The first fit has failed: its values carry what its model lacks, and `predict`
# refuses them.

# %%
aside = fibrefit.load_study("../configs/second_fibre/holdout")
after = found.predict(aside).summary()
print(after.says)
for channel, told in after.channels.items():
    print(f"{channel}: {told.rms:.3g} {told.unit} rms")

# %% [markdown]
# ## Going on from here
#
# The result holds a study of the final model, with the values found as its start. It is a study like any other.

# %%
folder = found.save("results/second_fibre", force=True)
again = fibrefit.fit(fibrefit.load_study(folder), starts=4)
print(again.status, {name: round(value.value, 4) for name, value in again.parameters.items()})
