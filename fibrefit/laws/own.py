"""Effects of a user's own, in a file beside the study: found, loaded, and refused where no model could hold them."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import TypeGuard

from fibrefit.core.errors import StudyError, did_you_mean
from fibrefit.core.paths import is_plain_file, read_plain_file
from fibrefit.laws.contract import unusable
from fibrefit.laws.declared import KINDS, refusals
from fibrefit.laws.law import Effect


def from_file(name: str, directory: Path) -> object:
    """What a user's file holds by the name after the colon.

    Parameters
    ----------
    name : str
        ``"my_effects.py:MyEffect"``.
    directory : pathlib.Path
        Where its path begins.

    Raises
    ------
    StudyError
        If there is no such file, it fails, or it holds nothing of that name.
    """
    file, _, wanted = name.rpartition(":")
    path = (directory / file).resolve()
    if not is_plain_file(path):
        raise StudyError(f'effect "{name}"', f"no file {path}", "a Python file beside the study", "Check the path.")
    module = _load(path, name)
    found = getattr(module, wanted, None)
    if found is None:
        classes = [n for n, v in vars(module).items() if inspect.isclass(v) and v.__module__ == module.__name__]
        hint = did_you_mean(wanted, classes) or "Check the name after the colon."
        raise StudyError(f'effect "{name}"', f"no {wanted} in {path.name}", ", ".join(classes) or "a class", hint)
    return found


def from_package(point: EntryPoint) -> object:
    """What an installed package offers as an effect.

    Raises
    ------
    StudyError
        If it cannot be imported.
    """
    try:
        return point.load()
    except (Exception, SystemExit) as error:
        got = f"{point.value}, which an installed package offers, fails with {type(error).__name__}: {error}"
        raise StudyError(f'effect "{point.name}"', got, do="Mend that package, or remove it.") from error


def _load(path: Path, name: str) -> ModuleType:
    source = read_plain_file(path, "a Python file", StudyError)
    digest = hashlib.sha256(str(path).encode("utf-8", "surrogateescape") + source).hexdigest()
    title = f"fibrefit_user_{path.stem}_{digest[:12]}"
    if title in sys.modules:
        # A second class of the same file must be of the same module: JAX tells pytrees apart by their class.
        return sys.modules[title]
    spec = importlib.util.spec_from_file_location(title, path)
    if spec is None or spec.loader is None:
        raise StudyError(f'effect "{name}"', f"{path.name} is not a Python file", "a file ending in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[title] = module
    try:
        # The very bytes of the digest: byte code that Python keeps beside a file is as old as its clock tells seconds.
        exec(compile(source, str(path), "exec", dont_inherit=True), vars(module))
    except (Exception, SystemExit) as error:
        del sys.modules[title]
        raise StudyError(
            f'effect "{name}"', f"{path.name} fails with {type(error).__name__}: {error}", do="Run the file by itself."
        ) from error
    return module


def is_effect(found: object) -> TypeGuard[type[Effect]]:
    """Whether something is a class of effects."""
    return inspect.isclass(found) and issubclass(found, Effect)


def checked(found: object, name: str) -> type[Effect]:
    """`found` if it is an effect that a model can hold.

    Raises
    ------
    StudyError
        If it is no effect, breaks the contract of one, or cannot be compiled: with the first thing that is wrong.
    """
    where = f'effect "{name}"'
    if not is_effect(found):
        raise StudyError(where, f"{found!r} is no effect", KINDS)
    for refusal in refusals(found, where):
        raise refusal
    for refusal in unusable(found, where):
        raise refusal
    return found
