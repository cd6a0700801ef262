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
# # An effect of one's own, in one file
#
# The catalogue does not hold every law. One that it lacks is a small class in a file beside the study; nothing else is
# touched, and fit, posterior and search take it like any other.

# %% [markdown]
# ## The equation
#
# In a lubricated guide the friction may level off at high speed, as the oil shears thin:
#
# $$F = F_f + c\,v_0\,\tanh(v / v_0).$$
#
# At small speeds that is a viscous friction $c\,v$; beyond $v_0$ it grows no further.

# %% [markdown]
# ## The file

# %%
import shutil
from pathlib import Path

import fibrefit

folder = Path("results/own_effect")
folder.mkdir(parents=True, exist_ok=True)
_ = (folder / "levelling.py").write_text('''"""A law of our guide."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import GuideLaw, quantity


class Levelling(GuideLaw):
    """Viscous friction that levels off at high speed.

    Law
    ---
    Force ``c v_0 tanh(v / v_0)`` against the motion, with v_0 = 1 m/s.

    Parameters
    ----------
    coefficient : () in N s/m
        c.

    Valid range
    -----------
    Up to a few m/s.

    Source
    ------
    Made up for this notebook.
    """

    name: ClassVar[str] = "guide.levelling"
    coefficient: jax.Array = quantity("N s/m", "friction over speed, at small speed", 5.0, lower=0.0)

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """Force on the weight against the + direction, in N."""
        return self.coefficient * jnp.tanh(velocity)
''')

# %% [markdown]
# ## Is it a law?
#
# `effects --check` tries it: parameters and their units, whether it vanishes where its strength is zero, derivatives, the
# sections of its docstring. From the command line this would be `fibrefit effects --check levelling.py:Levelling`.

# %%
from fibrefit.cli.main import run

run(["effects", "--check", f"{folder}/levelling.py:Levelling"])
_ = run(["effects", f"{folder}/levelling.py:Levelling"])

# %% [markdown]
# ## The study file
#
# The path is relative to the folder of the study. A study that names a file with code is run by a command only with
# `--trust`.

# %%
text = Path("../configs/lubricated_guide/study.toml").read_text()
text = text.replace("[channels]", '[model]\neffects = ["levelling.py:Levelling"]\n\n[channels]', 1)
_ = (folder / "study.toml").write_text(text)
for record in Path("../configs/lubricated_guide").glob("*.csv"):
    shutil.copy(record, folder)
print(text)

# %%
fits = {
    "without": fibrefit.fit("../configs/lubricated_guide", starts=8),
    "levelling": fibrefit.fit(folder, starts=8),
}
for name, fit in fits.items():
    gaps = {channel: round(gap.ratio, 2) for channel, gap in fit.identification.gap.items()}
    values = [f"{key.rpartition('.')[2]} {value.value:.4g} {value.unit}" for key, value in fit.parameters.items()]
    print(f"{name:<10} {fit.status:<8} gap {gaps}", *values, sep=", ")

# %%
fits["levelling"].plot().only("record drop_20mm_90deg.csv")

# %% [markdown]
# Whether it is this law or the plain viscous friction of the catalogue, these records decide only if the weight is fast
# enough: `fibrefit distinguish` says from which strength on they could.
