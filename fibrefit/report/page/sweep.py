"""The page of a sweep, and of any result that has no page of its own yet."""

from __future__ import annotations

from fibrefit.report.any import report_of
from fibrefit.report.page.blocks import PageContent, Result
from fibrefit.report.page.common import page_content


def plain_page(result: Result) -> PageContent:
    """A result by its pictures and the report of the terminal."""
    first = report_of(result.summary).partition("=\n")[2].strip().partition("\n\n")[0]
    return page_content(result, (), " ".join(first.split()))
