"""A description of fixed values that is the same in every process: what a kept program is found by."""

from __future__ import annotations

import dataclasses
import enum
import functools
import hashlib
import importlib
from collections.abc import Callable, Mapping
from pathlib import Path, PurePath
from types import BuiltinFunctionType, FunctionType, MethodType
from typing import Any

import numpy as np

PACKAGE = Path(__file__).resolve().parents[1]

COMPILED = ("core", "laws", "rigs", "simulation", "problem", "fitting", "sampling", "discovery", "series")
"""Packages whose code goes into programs."""

FAMILIAR = ("fibrefit", "builtins", "functools", "operator", "math", "numpy", "jax", "equinox", "optimistix", "lineax")
"""Where classes and functions may come from: their code is in the key, as source or as a version."""

DEEPEST = 60


class NotDescribedError(Exception):
    """A value has no description that means the same in another process."""


def source_digest() -> str:
    """SHA-256 of all code of this package that goes into programs."""
    digest = hashlib.sha256()
    for file in sorted(file for folder in COMPILED for file in (PACKAGE / folder).rglob("*.py")):
        digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def fingerprint(value: Any, depth: int = 0) -> str:
    """Text that two values share only if a program made for one does for the other.

    Parameters
    ----------
    value : object
        Numbers, text, arrays of NumPy, containers, data classes, classes and functions of known packages.
    depth : int
        In how many others it lies.

    Raises
    ------
    NotDescribedError
        If it holds anything else.
    """
    if depth > DEEPEST:
        raise NotDescribedError("nested too deeply")
    if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, type):
        # A class made by a function is what it is made of.
        made = value.__dict__.get("_made_of")
        return _named(value) if made is None else f"class {value.__qualname__}({fingerprint(made, depth + 1)})"
    if isinstance(value, FunctionType):
        # A function is its place in the source and all that it closes over.
        module, code = value.__module__ or "", value.__code__
        where = f"{module}:{value.__qualname__}"
        if module.partition(".")[0] not in FAMILIAR:
            raise NotDescribedError(where)
        where += f":{code.co_firstlineno}:{hashlib.sha256(code.co_code).hexdigest()[:16]}"
        try:
            closed = [cell.cell_contents for cell in value.__closure__ or ()]
        except ValueError:
            raise NotDescribedError(where) from None
        return f"{where}({_describe_all([closed, value.__defaults__, value.__kwdefaults__], depth + 1)})"
    for kinds, say in _KINDS:
        if isinstance(value, kinds):
            return say(value, depth + 1)
    if dataclasses.is_dataclass(value):
        # What takes no part in a comparison takes none in a program.
        fields = [(field.name, getattr(value, field.name)) for field in dataclasses.fields(value) if field.compare]
        return f"{_named(type(value))}({_describe_all(fields, depth + 1)})"
    raise NotDescribedError(f"{type(value).__module__}.{type(value).__qualname__}")


def _describe_all(values: Any, depth: int) -> str:
    return ", ".join(fingerprint(value, depth) for value in values)


def _name(thing: Any) -> str:
    """Module and name of a class or function that is found there again."""
    module, path = thing.__module__ or "", thing.__qualname__
    if module.partition(".")[0] not in FAMILIAR or _at(module, path) is not thing:
        raise NotDescribedError(f"{module}:{path}")
    return f"{module}:{path}"


_named: Callable[[Any], str] = functools.cache(_name)


def _at(module: str, path: str) -> Any:
    try:
        found: Any = importlib.import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError):
        raise NotDescribedError(f"{module}:{path}") from None
    return found


def _array(value: np.ndarray, depth: int) -> str:
    if value.dtype.hasobject:
        return f"objects {value.shape} ({_describe_all(value.ravel().tolist(), depth)})"
    return f"{value.dtype} {value.shape} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"


_KINDS: tuple[tuple[Any, Any], ...] = (
    (tuple, lambda value, depth: f"{_named(type(value))}({_describe_all(value, depth)})"),
    (list, lambda value, depth: f"[{_describe_all(value, depth)}]"),
    (Mapping, lambda value, depth: f"{{{_describe_all(value.items(), depth)}}}"),
    ((set, frozenset), lambda value, depth: f"set({sorted(fingerprint(part, depth) for part in value)})"),
    (enum.Enum, lambda value, depth: f"{_named(type(value))}.{value.name}"),
    (np.ndarray, _array),
    (np.dtype, lambda value, depth: f"dtype {value}"),
    (PurePath, lambda value, depth: f"path {value}"),
    ((slice, range), lambda value, depth: repr(value)),
    (functools.partial, lambda v, depth: f"partial({_describe_all((v.func, v.args, v.keywords), depth)})"),
    (MethodType, lambda v, depth: f"method({_describe_all((v.__func__, v.__self__), depth)})"),
    (BuiltinFunctionType, lambda value, depth: _named(value)),
)
