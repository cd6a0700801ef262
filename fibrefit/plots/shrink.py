"""Pictures small enough to be carried in a page."""

from __future__ import annotations

import io

from PIL import Image

WIDEST = 1150
"""Dots across: those of a page on a screen."""
COLOURS = 64
"""Colours, chosen so that each that occurs has one near it: chosen by how often they occur, the single red point of an
outlier became grey, in a larger file."""


def small_png(png: bytes) -> tuple[bytes, str]:
    """A PNG with fewer dots and colours, and the caption it holds.

    Returns
    -------
    png : bytes
    caption : str
        Empty where it holds none.

    Raises
    ------
    OSError
        If it is no picture.
    """
    with Image.open(io.BytesIO(png)) as picture:
        caption = str(picture.info.get("Description", ""))
        drawn = picture.convert("RGB")
    if drawn.width > WIDEST:
        drawn = drawn.resize((WIDEST, round(drawn.height * WIDEST / drawn.width)), Image.Resampling.LANCZOS)
    small = io.BytesIO()
    drawn.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(small, "PNG", optimize=True)
    return small.getvalue(), caption
