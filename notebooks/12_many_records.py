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
# # Many records, each by itself
#
# A week of drops lies in one folder, with a table that says what was done each time. Every record is identified by itself, and all
# stand in one table: which of them can be used, what they say together, and which one to look at.

# %% [markdown]
# ## The equation
#
# Every record $r$ has values of its own, found from it alone. What they have in common is a population: a value is one of
#
# $$p_r \sim N(\bar p,\ \tau^2), \qquad \hat p_r \sim N(p_r,\ s_r^2),$$
#
# with the standard error $s_r$ of its record, and the standard deviation $\tau$ between records.
#
# ## The study file
#
# In place of a list of records it names a table, with one row a record and the units in its header. The last row is of a record that
# nobody has copied yet, and of the last but one somebody wrote 2 mm for 20.

# %%
import shutil
from pathlib import Path

import fibrefit

drops = Path("../configs/drop_series")
folder = Path("results/week")
folder.mkdir(parents=True, exist_ok=True)
for file in drops.glob("drop_*.csv"):
    shutil.copy(file, folder)
head = (drops / "study.toml").read_text().partition("[[records]]")[0]
(folder / "study.toml").write_text(head.replace("[rig]", 'records = "series.csv"\n\n[rig]', 1))
(folder / "series.csv").write_text(
    """file,lift [mm],inclination [deg]
drop_5mm_90deg.csv,5,90
drop_10mm_90deg.csv,10,90
drop_10mm_45deg.csv,10,45
drop_20mm_45deg.csv,20,45
drop_20mm_90deg.csv,2,90
drop_30mm_90deg.csv,30,90
"""
)
print((folder / "study.toml").read_text())

# %% [markdown]
# ## The batch
#
# What cannot be identified is listed with its reason and stops nothing else. At a prompt the same is `fibrefit batch results/week`, on all cores;
# `--resume` goes on after an interruption, and does again what was put right.

# %%
found = fibrefit.batch(folder, "results/week_batch", starts=8, processes=1, force=True)
print(found.report())

# %% [markdown]
# ## As a table
#
# `results.csv` opens in any spreadsheet, and here as a data frame; numbers are in SI units.

# %%
table = fibrefit.read_batch(found.folder)
table[["status", "gap", "stiffness [N/m]", "stiffness std_error [N/m]", "damping [N s/m]", "friction [N]"]].round(4)

# %%
usable = table[table["status"] == "ok"]
print(usable[["stiffness [N/m]", "damping [N s/m]", "friction [N]"]].describe().loc[["count", "mean", "std"]].round(3))

# %% [markdown]
# ## As pictures

# %%
found.plot().only("parameters")

# %% [markdown]
# Each item is a result of its own in `results/week_batch/items`: `fibrefit show` prints it, `fibrefit report results/week_batch` makes one page
# of all. What the records say *together*, with one fit of all of them, is another question: `fibrefit fit` and `fibrefit series`.
