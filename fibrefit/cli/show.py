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
    from fibrefit.report.any import report_of
    from fibrefit.store.summary import read_summary

    summary = read_summary(result)
    terminal.answer(report_of(summary), summary.model_dump(mode="json", by_alias=True))
