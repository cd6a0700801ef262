"""Formulas as MathML, which browsers draw by themselves: a page of the site fetches nothing to show them."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator


def mathml(tex: str, display: str) -> str:
    """A formula of LaTeX as MathML, with its source for those who copy it.

    Raises
    ------
    ValueError
        If a command is not understood: it would stand in the formula as text.
    """
    drawn = convert(tex.strip(), display=display)
    if "\\" in drawn.replace("&#x0005C;", "\\"):
        raise ValueError(f"a formula has a command that has no MathML: {tex.strip()}")
    return drawn


def _inline(translator: HTML5Translator, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def _block(translator: HTML5Translator, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math">{mathml(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
