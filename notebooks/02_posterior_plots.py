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
# # Posterior plots
#
# A fit ends with a value and an error bar for each parameter. The posterior says more: how the parameters hang
# together, what they say of quantities nobody measured, and how well the model predicts a measurement. It takes
# the noise spectrum into account, and it says when it should not be believed.

# %% [markdown]
# ## The equation
#
# With the model of the first notebook, parameters $\theta$ and noise whose covariance $\Sigma$ follows from its spectrum, up to a level $\sigma$ of each channel,
#
# $$p(\theta, \sigma \mid y) \;\propto\; p(\theta)\,p(\sigma)\,|\Sigma_\sigma|^{-1/2}\,\exp\!\Bigl(-\tfrac12\,(y - s(\theta))^{\mathsf T}\,\Sigma_\sigma^{-1}\,(y - s(\theta))\Bigr).$$
#
# $y$ are all measured samples, $s(\theta)$ the simulated ones, $p(\theta)$ and $p(\sigma)$ what is known beforehand. Differences between records are
# integrated out.
#
# ## The study file

# %%
from pathlib import Path

print(Path("../configs/drop_series/study.toml").read_text())

# %%
import numpy as np

import fibrefit

study = fibrefit.load_study("../configs/drop_series")
fit = fibrefit.fit(study)
posterior = fibrefit.sample(study, start=fit)
print(posterior.report())

# %% [markdown]
# Four independent ensembles of walkers ran until they converged. The report ends with the checks; as a word:

# %%
print("status:", posterior.status)

# %% [markdown]
# ## How the parameters hang together
#
# Each panel shows two of them. The cross is the fit. Damping and friction both take energy away: where one is
# larger, the other must be smaller.

# %%
posterior.plot_corner("stiffness", "damping", "friction")

# %%
damping, friction = posterior.draws["damping"], posterior.draws["friction"]
print(f"correlation of damping and friction: {np.corrcoef(damping, friction)[0, 1]:.2f}")

# %% [markdown]
# ## Have the chains arrived?
#
# On the left the trace of each ensemble, on the right how often its draws have each rank among all draws: uniform,
# if the ensembles agree.

# %%
posterior.plot_traces()

# %% [markdown]
# ## Prior and posterior
#
# The prior, in orange, is so much wider that it looks flat.

# %%
posterior.plot_prior()

# %% [markdown]
# ## Posterior predictive check
#
# Nine tenths of the samples should lie in the band of new measurements, whatever the phase of the motion.

# %%
posterior.plot_bands("drop_20mm_90deg.csv")

# %%
for channel, band in posterior.bands.items():
    print(f"{channel}: {100 * band.covered:.1f} % of all samples inside the 90 % band")

# %% [markdown]
# ## A quantity nobody measured
#
# Any function of the parameters has a posterior too: apply it to the draws. Here the natural frequency of the
# weight on the taut fibre and its share of critical damping.

# %%
mass = study.records[0].weight_mass
stiffness = posterior.draws["stiffness"]
derived = {
    "natural frequency / Hz": np.sqrt(stiffness / mass) / (2.0 * np.pi),
    "share of critical damping / %": 100.0 * damping / (2.0 * np.sqrt(stiffness * mass)),
}
for name, values in derived.items():
    low, middle, high = np.quantile(values, [0.025, 0.5, 0.975])
    print(f"{name}: {middle:.5g}, 95 %: {low:.5g} to {high:.5g}")

# %% [markdown]
# ## Beside the fit
#
# Where the noise is autocorrelated, ordinary least squares (OLS) wastes much of what the records hold: it gives every
# sample the same weight. The fit therefore ends with a step of generalised least squares (GLS), and its error bars
# should be those of the posterior.

# %%
for name, estimate in fit.parameters.items():
    found = posterior.parameters[name]
    print(
        f"{name:<10} fit {estimate.value:10.6g} +/- {estimate.std_error:<8.2g} "
        f"posterior {found.mean:10.6g} +/- {found.sd:<8.2g} {found.unit} (plain +/- {estimate.plain_error:.2g})"
    )

# %% [markdown]
# ## For other programs
#
# The result is a folder like any other. `result.h5` has the groups that ArviZ knows, and opens in xarray.

# %%
folder = posterior.save("results/posterior", force=True)
try:
    import xarray
except ImportError:
    print("pip install xarray h5netcdf")
else:
    with xarray.open_datatree(folder / "result.h5", engine="h5netcdf") as tree:
        print(tree["posterior"]["stiffness"].quantile([0.05, 0.5, 0.95], dim=("chain", "draw")).values)
