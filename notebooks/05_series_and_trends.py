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
# # A series and its trends
#
# A weight fell into its fibre from 5, 10 and 20 mm, straight down and along a guide at 45 degrees. Does one set of
# parameters serve all records, do parameters follow a law of speed, or does each record have values of its own?

# %% [markdown]
# ## The equation
#
# Three models are put to the same records. For a parameter $p$ of record $r$, at the speed $v$ of the moment,
#
# $$p_r = \bar p, \qquad p(v) = \bar p\,(v/v_\mathrm{ref})^n, \qquad p_r = \bar p\,\mathrm e^{\delta_r}.$$
#
# They are compared by their marginal likelihoods and by how well they predict a record that was left out.
#
# ## The study file

# %%
from pathlib import Path

import fibrefit

print(Path("../configs/drop_series/study.toml").read_text())

# %%
series = fibrefit.series_of("../configs/drop_series")
print("answer:", series.answer)
print(series.sentence)

# %%
print(series.report())

# %% [markdown]
# ## Record by record
#
# The values that each record asks for by itself, with their errors:

# %%
series.to_dataframe()

# %% [markdown]
# ## Trends
#
# A trend is how a parameter goes with a condition from record to record. With five records much looks like a trend; the
# report says how probable as strong a one is by chance.

# %%
import pandas as pd

trends = pd.DataFrame(series.trends).set_index(["parameter", "condition"])
trends[["slope", "slope_error", "unit", "condition_unit", "chance", "chance_corrected"]].head(8)

# %% [markdown]
# `chance` is that of as strong a trend where there is none, `chance_corrected` the same for all looks together.

# %%
series.plot()

# %% [markdown]
# The same on the command line: `fibrefit series configs/drop_series`, and for a rig with a drive such as that of
# `configs/drive_series`, which takes some minutes. Hundreds of records, each by itself, go through `fibrefit batch`.
