"""``fibrefit init``: a study that runs, to be changed into one's own."""

from __future__ import annotations

from pathlib import Path

import click

from fibrefit.cli.terminal import Terminal, with_terminal

FILES = ("study.toml", "drop_10mm_90deg.csv")


@click.command("init")
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@with_terminal
def command(terminal: Terminal, directory: Path) -> None:
    """Write a study and a demonstration record into DIR, which is made if it does not exist."""
    from importlib import resources

    from fibrefit.core.errors import UsageError
    from fibrefit.store.files import write_whole

    for name in FILES:
        if (directory / name).exists():
            raise UsageError(str(directory / name), "exists already", "a folder without it", "Name another folder.")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            write_whole(directory / name, resources.files("fibrefit.cli").joinpath("demo", name).read_bytes())
    except OSError as error:
        raise UsageError(str(directory), error.strerror or "cannot be written", "a folder to write to") from None
    study = directory / FILES[0]
    text = (
        f"Wrote {study} and {FILES[1]}, one drop of a weight on a fibre.\n\n"
        f"  fibrefit inspect {directory}    says what is understood of them\n"
        f"  fibrefit fit {study}    identifies the fibre\n\n"
        "Put your own records in their place and say in the study what was measured."
    )
    terminal.answer(text, {"study": str(study), "files": [str(directory / name) for name in FILES]})
