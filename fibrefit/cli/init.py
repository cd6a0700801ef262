"""``fibrefit init``: a study that runs, to be changed into one's own."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import click

from fibrefit.cli.options import PATH, option, plain_command
from fibrefit.cli.terminal import Terminal, as_typed
from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.core.paths import write_whole

FILES = ("study.toml", "drop_10mm_90deg.csv")


@plain_command(
    "init",
    click.Argument(["place"], metavar="[DIR | FILE.py]", required=False, type=PATH),
    option("--effect=PORT.NAME", "Write the file of an effect of your own, to be changed.", str),
    option(
        "--port",
        "Where the effect acts, if NAME does not say: guide, fibre, pulley, drive, sensor, push, pivot, rig or study.",
        str,
    ),
)
def init_command(terminal: Terminal, place: Path | None, effect: str | None, port: str | None) -> None:
    """Write a study and a demonstration record into DIR, which is made if it does not exist.

    With --effect guide.my_drag, write FILE.py (my_drag.py when absent) with a law that can be used as it is, and every
    hook of its port explained. Nothing is overwritten.
    """
    if port is not None and (effect is None or "." in effect):
        beside = f"--effect {effect}" if effect else "no --effect"
        raise UsageError(f"--port {port}", f"{beside}, which it adds nothing to", "--effect NAME", "Leave --port out.")
    if effect is not None:
        _write_effect(terminal, effect if port is None else f"{port}.{effect}", place)
    elif place is None:
        raise UsageError("init", "no folder", "DIR, or --effect PORT.NAME", "Name the folder to write to.")
    else:
        _write_study(terminal, place)


def _write_effect(terminal: Terminal, name: str, file: Path | None) -> None:
    from fibrefit.laws.catalogue import CATALOGUE
    from fibrefit.laws.ports import PORTS
    from fibrefit.laws.template import class_name, template

    port, _, short = name.partition(".")
    where = f"--effect {name}"
    if port not in PORTS:
        near = did_you_mean(port, PORTS) or "The name begins with the port the law acts on, or --port names it."
        raise UsageError(where, f'no port "{port}"', f"PORT.NAME with a port of {', '.join(PORTS)}", near)
    if not short.isidentifier() or not short.islower():
        raise UsageError(where, f'"{short}"', "small letters, digits and underscores after the port", "Rename it.")
    if name in CATALOGUE:
        raise UsageError(where, "is in the catalogue already", "a name of its own", "Rename it.")
    file = file or Path(f"{short}.py")
    if file.suffix != ".py":
        raise UsageError(str(file), "is no Python file", "a file ending in .py", "Rename it.")
    if os.path.exists(file):
        raise UsageError(str(file), "exists already", "a file that does not", "Name another one.")
    try:
        write_whole(file, template(name).encode())
    except OSError as error:
        raise UsageError(str(file), error.strerror or "cannot be written", "a folder to write to") from None
    wanted = f"{file.as_posix()}:{class_name(short)}"
    text = (
        f"Wrote {file}, a law that can be used as it is.\n\n"
        f"  {as_typed('fibrefit', 'effects', '--check', wanted)}    says what is wrong with it\n"
        f"  {as_typed('fibrefit', 'effects', wanted)}    shows its page\n\n"
        f'In a study beside it: effects = ["{file.name}:{class_name(short)}"] under [model], and --trust to run it.'
    )
    terminal.answer(text, {"effect": name, "file": str(file), "name": wanted})


def _write_study(terminal: Terminal, directory: Path) -> None:
    from importlib import resources

    for name in FILES:
        if os.path.exists(directory / name):
            raise UsageError(str(directory / name), "exists already", "a folder without it", "Name another folder.")
    new = not os.path.exists(directory)
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            write_whole(directory / name, resources.files("fibrefit.cli").joinpath("demo", name).read_bytes())
    except OSError as error:
        # Where a file stands in the way of the folder, there is nothing to be taken away.
        with suppress(OSError):
            for name in FILES:
                (directory / name).unlink(missing_ok=True)
            if new:
                directory.rmdir()
        raise UsageError(str(directory), error.strerror or "cannot be written", "a folder to write to") from None
    study = directory / FILES[0]
    text = (
        f"Wrote {study} and {FILES[1]}, one drop of a weight on a fibre.\n\n"
        f"  {as_typed('fibrefit', 'inspect', str(directory))}    says what is understood of them\n"
        f"  {as_typed('fibrefit', 'fit', str(study))}    identifies the fibre\n\n"
        "Put your own records in their place and say in the study what was measured."
    )
    terminal.answer(text, {"study": str(study), "files": [str(directory / name) for name in FILES]})
