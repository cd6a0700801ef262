"""The page of a sweep, and of any result that has no page of its own yet."""

from __future__ import annotations

from fibrefit.report.any import report_of
from fibrefit.report.page.blocks import Result, Telling
from fibrefit.report.page.common import telling


def told_plainly(result: Result) -> Telling:
    """A result by its pictures and the report of the terminal."""
    first = report_of(result.summary).partition("=\n")[2].strip().partition("\n\n")[0]
    return telling(result, (), " ".join(first.split()))
