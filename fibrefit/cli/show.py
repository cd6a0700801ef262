"""``fibrefit show``: the text of a result again."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import click

from fibrefit.cli.terminal import Terminal, first_missing, with_terminal


@click.command("show")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--figures", metavar="FORMATS", help="Draw its figures again, as png, pdf, svg, several with commas: into --out."
)
@click.option(
    "--out",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Folder of the figures [figures-RESULT, by the name of its folder, where you are].",
)
@click.option("--force", is_flag=True, help="Replace figures that are there already.")
@with_terminal
def command(terminal: Terminal, result: Path, figures: str | None, out: Path | None, force: bool) -> None:
    """Print the report of RESULT, a folder with the summary.json of a run; or draw its figures again.

    A simulation has no report: with --figures its figures are drawn. Of an inspection there is neither.
    """
    if figures is not None:
        _draw(terminal, result, figures, out or _own_folder(result), force)
        return
    if out is not None or force:
        from fibrefit.core.errors import UsageError

        where = "--force" if out is None else f"--out {out}"
        raise UsageError(where, "no figures to put there", "--figures, such as --figures png")
    from fibrefit.report.any import report_of
    from fibrefit.store.summary import read_summary

    summary = read_summary(result)
    terminal.answer(report_of(summary), summary.model_dump(mode="json", by_alias=True))


def _own_folder(result: Path) -> Path:
    """Folder for the figures of a result where none was named: those of another one do not come into it."""
    folder = result if result.is_dir() else result.parent
    return Path(f"figures-{folder.resolve().name}")


def _draw(terminal: Terminal, result: Path, formats: str, out: Path, force: bool) -> None:
    """Draw a saved result again, into a folder of the figures' own."""
    from fibrefit.core.errors import UsageError
    from fibrefit.core.paths import figure_formats
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
