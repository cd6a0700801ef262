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
# # A real record
#
# A linear axis with a motor, moved to and fro for 24.8 s and logged at 1 kHz: the record of Janot, Gautier and Brunot (EMPS,
# 2019), which others have identified and published. It is not part of this project; `FIBREFIT_EMPS` names the file
# `DATA_EMPS.mat`, as the repository forgi86/sysid-neural-continuous holds it. The pulses beside it are kept for the end.

# %% [markdown]
# ## The equation
#
# A mass $m$ in a guide, pushed by the force of the motor, with viscous friction $c$, Coulomb friction $F_f$ and a constant
# force $F_0$ against the direction in which $u$ grows:
#
# $$m\,\ddot u = s\,U - F_0 - c\,\dot u - F_f\,\operatorname{sgn}\dot u, \qquad s = 35.15\ \mathrm{N/V}.$$
#
# ## The study file
#
# It states how the columns are called, what one volt is worth, and that friction has a viscous part. No starting value, no filter.

# %%
import os
import shutil
from pathlib import Path

import fibrefit

data = Path(os.environ.get("FIBREFIT_EMPS", "DATA_EMPS.mat"))
STUDY = """schema = "fibrefit/study/1"
name = "{name}"

[rig]
kind = "guided_mass"

[channels]
time = {{ column = "t", unit = "s" }}
position = {{ column = "qm", unit = "m" }}
force = {{ column = "vir", unit = "V", scale = "35.150652 N/V" }}

[model]
effects = ["guide.viscous_friction"]

[[records]]
file = "{file}"
"""


def written(name: str, file: Path) -> Path:
    """The folder of a study of that file."""
    folder = Path("results") / name
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(file, folder)
    (folder / "study.toml").write_text(STUDY.format(name=name, file=file.name))
    return folder


print(STUDY.format(name="EMPS", file=data.name))

# %%
result = fibrefit.fit(written("EMPS", data), starts=4)
print(result.report())

# %% [markdown]
# ## Beside what was published

# %%
published = {
    "mass": 95.1089,
    "friction": 20.3935,
    "force_offset": -3.1648,
    "guide.viscous_friction.viscous_coefficient": 203.5034,
}
for name, value in published.items():
    found = result.parameters[name]
    low, high = found.interval_95
    print(f"{name.rpartition('.')[2]:<20} published {value:8.4g}   found {found.value:8.4g}, {low:.4g} to {high:.4g}")

# %%
result.plot().only("record DATA_EMPS.mat")

# %% [markdown]
# ## A record the fit has not seen
#
# The same axis, with pulses of force added:

# %%
unseen = result.predict(fibrefit.load_study(written("EMPS_pulses", data.with_name("DATA_EMPS_PULSES.mat"))))
print(unseen.report())

# %% [markdown]
# ## What it comes to
#
# The first line says that the numbers can be used, and the gap of 302 that the model is not complete: both are so. A position that is
# read to a hundredth of a micrometre, without any rest that would tell its noise, shows what the model of a whole axis leaves, 7 um rms. The
# error bars allow for that (38 times those of white noise), and all four published values lie inside them. 92 % of the samples of the
# other record lie in a band of 95 %: about as many as it says, and a few less. What the axis has besides, `fibrefit discover` looks for.
