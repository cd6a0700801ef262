"""The page: results as one HTML document that needs no other file."""

from __future__ import annotations

from fibrefit.report.page.blocks import Illustration, Result
from fibrefit.report.page.page import page

__all__ = ["Illustration", "Result", "page"]
