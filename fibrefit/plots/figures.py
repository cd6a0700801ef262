"""A set of figures, by name."""

from __future__ import annotations

import base64
import io
from html import escape

from matplotlib.figure import Figure


class Figures(dict[str, Figure]):
    """Figures by name; a notebook shows them all, one below the other."""

    def _repr_html_(self) -> str:
        return "\n".join(_embedded(name, figure) for name, figure in self.items())


def _embedded(name: str, figure: Figure) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    content = base64.b64encode(buffer.getvalue()).decode()
    return f'<p><img alt="{escape(name)}" style="max-width: 100%" src="data:image/png;base64,{content}"></p>'
