"""``fibrefit report``: results as one page."""

from __future__ import annotations

from pathlib import Path

import click

from fibrefit.cli.terminal import Terminal, first_missing, with_terminal


@click.command("report")
@click.argument("results", metavar="RESULT...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--out",
    metavar="FILE",
    type=click.Path(path_type=Path),
    default=Path("report.html"),
    show_default=True,
    help="The page; in a folder it is called report.html.",
)
@click.option("--force", is_flag=True, help="Replace an earlier page.")
@with_terminal
def command(terminal: Terminal, results: tuple[Path, ...], out: Path, force: bool) -> None:
    """Put RESULT..., folders with the summary.json of a run, on one HTML page that needs no other file.

    Simulations and inspections have none.
    """
    from fibrefit.workflow.pages.report import report_results

    missing = first_missing(out.parent if out.suffix else out)
    file = report_results(results, out, force=force)
    document = {"schema": "fibrefit/page/1", "file": str(file), "results": [str(result) for result in results]}
    terminal.made(missing)
    terminal.answer(str(file), document)
