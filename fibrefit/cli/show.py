"""``fibrefit show``: the text of a result again."""

from __future__ import annotations

from pathlib import Path

import click

from fibrefit.cli.terminal import Terminal, with_terminal


@click.command("show")
@click.argument("result", type=click.Path(path_type=Path))
@with_terminal
def command(terminal: Terminal, result: Path) -> None:
    """Print the report of RESULT, a folder that a run has written."""
    from fibrefit.core.errors import UsageError
    from fibrefit.report.discovery import discovery_report
    from fibrefit.report.text import fit_report
    from fibrefit.store.summary import read_summary
    from fibrefit.study.summaries import DiscoverySummary, FitResultSummary

    summary = read_summary(result)
    if isinstance(summary, DiscoverySummary):
        terminal.answer(discovery_report(summary), summary.model_dump(mode="json", by_alias=True))
        return
    if not isinstance(summary, FitResultSummary):
        raise UsageError(str(result), "not the result of a fit", "a result that has a report", "Use --json.")
    terminal.answer(fit_report(summary), summary.model_dump(mode="json", by_alias=True))
