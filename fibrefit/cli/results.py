"""Commands on results: ``fibrefit report``, one page, and ``fibrefit show``, the text of one again or its figures."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import click

from fibrefit.cli.options import PATH, option, plain_command
from fibrefit.cli.terminal import Terminal, first_missing
from fibrefit.core.errors import UsageError
from fibrefit.core.paths import figure_formats


@plain_command(
    "report",
    click.Argument(["results"], metavar="RESULT...", nargs=-1, required=True, type=PATH),
    option("--out=FILE", "The page; in a folder it is called report.html.", PATH, Path("report.html")),
    option("--force", "Replace an earlier page."),
)
def report_command(terminal: Terminal, results: tuple[Path, ...], out: Path, force: bool) -> None:
    """Put RESULT..., folders with the summary.json of a run, on one HTML page that needs no other file.

    Simulations and inspections have none.
    """
    from fibrefit.workflow.pages.report import report_results

    missing = first_missing(out.parent if out.suffix else out)
    file = report_results(results, out, force=force)
    document = {"schema": "fibrefit/page/1", "file": str(file), "results": [str(result) for result in results]}
    terminal.made(missing)
    terminal.answer(str(file), document)


@plain_command(
    "show",
    click.Argument(["result"], type=PATH),
    option("--figures=FORMATS", "Draw its figures again, as png, pdf, svg, several with commas: into --out.", str),
    option("--out=DIR", "Folder of the figures [figures-RESULT, by the name of its folder, where you are].", PATH),
    option("--force", "Replace figures that are there already."),
)
def show_command(terminal: Terminal, result: Path, figures: str | None, out: Path | None, force: bool) -> None:
    """Print the report of RESULT, a folder with the summary.json of a run; or draw its figures again.

    A simulation has no report: with --figures its figures are drawn. Of an inspection there is neither.
    """
    if figures is not None:
        # Where no folder is named, figures of another result do not come into that of these.
        named = (result if result.is_dir() else result.parent).resolve().name
        _draw_again(terminal, result, figures, out or Path(f"figures-{named}"), force)
        return
    if out is not None or force:
        where = "--force" if out is None else f"--out {out}"
        raise UsageError(where, "no figures to put there", "--figures, such as --figures png")
    from fibrefit.report.any import report_of
    from fibrefit.store.summary import read_summary

    summary = read_summary(result)
    terminal.answer(report_of(summary), summary.model_dump(mode="json", by_alias=True))


def _draw_again(terminal: Terminal, result: Path, formats: str, out: Path, force: bool) -> None:
    """Draw a saved result again, into a folder of the figures' own."""
    from fibrefit.plots.save import figure_paths, save_figures
    from fibrefit.workflow.outcome.draw import draw_result

    kinds = figure_formats(formats)
    figures, missing = draw_result(result), first_missing(out)
    there = [path for paths in figure_paths(list(figures), out, kinds) for path in paths if os.path.lexists(path)]
    if there and not force:
        do = "Add --force to replace it, or name another --out."
        raise UsageError(str(there[0]), "exists already", "a folder without figures of these names", do)
    try:
        out.mkdir(parents=True, exist_ok=True)
        if not os.access(out, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        do = "Name another with --out."
        raise UsageError(str(out), error.strerror or "no folder", "a folder that can be written", do) from None
    paths = [str(path) for path in save_figures(figures, out, formats=kinds)]
    document = {"schema": "fibrefit/figures/1", "result": str(result), "files": paths}
    terminal.made(missing)
    terminal.answer("\n".join(paths), document)
