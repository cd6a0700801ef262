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
# # Thirty lines from Python
#
# From files to a prediction of a record that nobody fitted, with nothing but what the page "Python interface" documents.

# %% [markdown]
# ## The equation
#
# The falling weight of the first notebook: $m\,\ddot u = m g\sin\alpha - T - F_f\,\mathrm{sgn}\,\dot u$ with the stretch $e = u$ of the fibre; its tension $T$ is
# $\max(0,\; k e + b\,\dot e)$ where $e > 0$, and zero where it is slack.
#
# ## The study file
#
# That of the example; `fibrefit.example` says where it lies.

# %%
import fibrefit

folder = fibrefit.example("drop_series")
study = fibrefit.load_study(folder)
print(study.name, [record.file for record in study.records])

# %%
seen = fibrefit.inspect(folder)
seen.to_dataframe()[["file", "header", "si"]]

# %%
result = fibrefit.fit(study)
result

# %%
print(result.status)
result.to_dataframe()

# %%
correlation = result.correlation
shared = list(result.parameters)
correlation.loc[shared, shared].round(2)

# %%
residuals = result.residuals
residuals.groupby(["channel", "phase"])["residual"].std().unstack().round(2)

# %%
worst = residuals.loc[residuals["residual"].abs().idxmax()]
print(worst["record"], worst["time"], worst["phase"])

# %%
result.plot().only("overview")

# %%
saved = result.save("results/thirty_lines", force=True)
again = fibrefit.load_result(saved)
assert again.to_dataframe().equals(result.to_dataframe())
again

# %%
prediction = fibrefit.predict(saved, folder / "holdout")
print(prediction.verdict)
prediction.plot()

# %%
tree = result.to_datatree()
tree
