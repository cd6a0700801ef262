"""The page of a sweep, and of any result that has no page of its own yet."""

from __future__ import annotations

from fibrefit.report.any import report_of
from fibrefit.report.page.blocks import Block, Pictures, Result, Telling
from fibrefit.report.page.common import failed_checks, in_full


def told_plainly(result: Result) -> Telling:
    """A result by its pictures and the report of the terminal."""
    summary = result.summary
    checks = getattr(summary, "checks", ())
    failed = failed_checks(checks)
    first = report_of(summary).partition("=\n")[2].strip().partition("\n\n")[0]
    blocks: list[Block] = [Pictures("Pictures", result.pictures)] if result.pictures else []
    kind = str(getattr(summary, "schema_name", "fibrefit/result")).split("/")[1]
    return Telling(
        kind=kind.capitalize(),
        status=str(getattr(summary, "status", "suspect" if failed else "ok")),
        verdict=" ".join(first.split()),
        failed=failed,
        passed=sum(check.passed for check in checks),
        blocks=[*blocks, *in_full(summary)],
    )
