"""How the site is built: ``make docs``."""

from __future__ import annotations

import sys
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

project = "fibrefit"
author = "the authors of fibrefit"
try:
    release = metadata.version("fibrefit")
except metadata.PackageNotFoundError:
    release = ""

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "formulas",
    "pages",
]
exclude_patterns = ["_build", "_ext", "generated/notebooks/results"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
# Notebooks are shown as they were run last: `make notebooks` runs them.
nb_execution_mode = "off"
nb_merge_streams = True

napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_member_order = "bysource"
# `save` writes a result; these are its parts, for the folder that it makes.
autodoc_default_options = {"exclude-members": "write, write_data, first_figures"}
autodoc_typehints = "none"
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

# Browsers draw MathML themselves: pages fetch nothing, and formulas are there without the net.
html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"fibrefit {release}".strip()
html_static_path: list[str] = []
