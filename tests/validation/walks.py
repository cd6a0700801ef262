"""How far a reader walks through the files of the package to follow a command: ``python -m tests.validation.walks``.

The demonstration is fitted, nothing compiled before, and each function of the package is read where it is first called.
A stay begins where the reader enters another file, by a call or on the way back to the caller; returns are the stays
in a file that was read before. Ways: the whole command ``fit``, and from a task to its identification.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Step:
    """A function that is read: its file, its name, and what it calls for the first time."""

    file: str
    name: str
    calls: list[Step] = field(default_factory=list)


class Length(NamedTuple):
    """Of a walk: functions read, files entered, stays in files, and those of them in a file read before."""

    functions: int
    files: int
    stays: int
    returns: int


def length(start: Step) -> Length:
    """How far it is from a function through all that it calls, and back."""
    stays: list[str] = []
    read = 0

    def enter(step: Step) -> None:
        nonlocal read
        read += 1
        for call in [None, *step.calls]:
            if call is not None:
                enter(call)
            if not stays or stays[-1] != step.file:
                stays.append(step.file)

    enter(start)
    files = len(set(stays))
    return Length(read, files, len(stays), len(stays) - files)


def traced(package: Path, run: Any) -> Step:
    """The steps of a call, each function of the package once; those of other threads are read where they begin."""
    top = Step("", "")
    seen: set[Any] = set()
    own = threading.local()

    def profile(frame: FrameType, event: str, _: Any) -> None:
        if event not in ("call", "return") or not frame.f_code.co_filename.startswith(str(package)):
            return
        stack = own.__dict__.setdefault("stack", [])
        if event == "return":
            if stack and stack[-1][0] is frame:
                stack.pop()
            return
        code, caller = frame.f_code, stack[-1][1] if stack else top
        # A comprehension or a lambda is read with the function that it stands in.
        if code in seen or code.co_name.startswith("<"):
            return
        seen.add(code)
        step = Step(code.co_filename, code.co_name)
        caller.calls.append(step)
        stack.append((frame, step))

    threading.setprofile(profile)
    sys.setprofile(profile)
    try:
        run()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return top


def found(start: Step, name: str) -> Step:
    """The first step of that name.

    Raises
    ------
    LookupError
        If no function of that name was read.
    """
    for call in start.calls:
        if call.name == name:
            return call
        try:
            return found(call, name)
        except LookupError:
            continue
    raise LookupError(name)


def main() -> None:
    """Print the length of both ways; ``--tree`` walks through another checkout."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tree", type=Path, default=ROOT)
    tree = parser.parse_args().tree.resolve()
    sys.path.insert(0, str(tree))
    with tempfile.TemporaryDirectory() as folder:
        os.environ["FIBREFIT_CACHE"] = folder
        from fibrefit.cli.main import main as command

        study = tree / "configs/drop_series/study.toml"
        sys.argv = ["fibrefit", "fit", str(study), "--figures", "none", "-q", "--out", f"{folder}/out"]

        def run() -> None:
            with suppress(SystemExit):
                command()

        top = traced(tree / "fibrefit", run)
    for words, start in (("the command fit", found(top, "main")), ("task to identification", found(top, "identify"))):
        print(f"{words}: " + ", ".join(f"{value} {what}" for what, value in length(start)._asdict().items()))


if __name__ == "__main__":
    main()
