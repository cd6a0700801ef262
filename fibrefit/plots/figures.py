"""A set of figures, by name."""

from __future__ import annotations

import base64
from html import escape

from matplotlib.figure import Figure

from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.plots.save import figure_file
from fibrefit.plots.shrink import small_png
from fibrefit.plots.style import caption_of

MOST_RECORDS = 24
"""Records, or files, that get a figure of their own; of a longer fit those that are explained worst, else the first."""


class Figures(dict[str, Figure]):
    """Figures by name; a notebook shows them all, one below the other."""

    def only(self, *names: str) -> Figures:
        """Some of the figures.

        Parameters
        ----------
        *names : str

        Returns
        -------
        Figures
            In the order of `names`.

        Raises
        ------
        UsageError
            If there is no figure of that name.

        Examples
        --------
        >>> list(result.plot().only("overview"))
        ['overview']
        """
        for name in names:
            if name not in self:
                raise UsageError(f'figure "{name}"', "not drawn", f"one of {', '.join(self)}", did_you_mean(name, self))
        return Figures({name: self[name] for name in names})

    def _repr_html_(self) -> str:
        return "\n".join(_embedded(name, figure) for name, figure in self.items())


def _embedded(name: str, figure: Figure) -> str:
    # Small: a notebook keeps every picture it shows, and is handed on with them.
    content = base64.b64encode(small_png(figure_file(figure))[0]).decode()
    said = escape(caption_of(figure) or name)
    return f'<p><img alt="{said}" style="max-width: 100%" src="data:image/png;base64,{content}"></p>'
