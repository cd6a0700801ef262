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
# # A file of one's own logger
#
# Loggers write what they like: decimal commas, volts instead of newtons, headings of their own. What can be read in one way
# only is read; the rest is refused, with what to say. Here a drop is written as such a logger would, and read back.

# %% [markdown]
# ## The equation
#
# A column $q$ becomes a channel by one factor, sign included, and the unit it carries:
#
# $$F = s\,q_F, \qquad u = q_u, \qquad s = -40\ \mathrm{N/V}.$$

# %%
from pathlib import Path

import fibrefit
from fibrefit.core.errors import FibrefitError

folder = Path("results/own_logger")
folder.mkdir(parents=True, exist_ok=True)
drop = fibrefit.read_record("../configs/drop_series/drop_10mm_90deg.csv")
lines = ["t [ms];CH1;s [mm]"]
for time, force, position in zip(drop.time, drop.channels["force"], drop.channels["position"], strict=True):
    lines.append(f"{1e3 * time:.1f};{-force / 40.0:.5f};{1e3 * position:.3f}".replace(".", ","))
_ = (folder / "run7.csv").write_text("\n".join(lines) + "\n")
print("\n".join(lines[:4]))

# %% [markdown]
# ## What is understood without help

# %%
try:
    print(fibrefit.inspect(folder / "run7.csv").report())
except FibrefitError as error:
    print(error)

# %% [markdown]
# Separator, decimal comma, times and position are found. The other column cannot be: nothing in the file says that it
# is a force, nor what one volt is worth.
#
# ## The study file
#
# `[channels]` says it, once for all records.

# %%
_ = (folder / "study.toml").write_text("""schema = "fibrefit/study/1"
name = "one drop, force in volts"

[rig]
kind = "fibre_mass"
weight_mass = "3.096 kg"
fibre_length = "599 mm"
inclination = "90 deg"

[channels]
time = "t"
force = { column = "CH1", unit = "V", scale = "-40 N/V" }
position = "s"

[[records]]
file = "run7.csv"
lift = "10 mm"
""")
print(fibrefit.inspect(folder).report())

# %% [markdown]
# ## And fitted

# %%
result = fibrefit.fit(folder, starts=8)
for name, estimate in result.parameters.items():
    print(f"{name:<10} {estimate.value:10.6g} +/- {estimate.std_error:.2g} {estimate.unit}")
print("status:", result.status)

# %%
result.plot().only("record run7.csv")
