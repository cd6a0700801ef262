"""What a search has found so far, kept on disk: one that is cut short goes on from there.

A search is a sequence of jobs, each a pure function of the records, the hypothesis it starts from and the noise. The
journal keeps the result of each under a digest of what it depends on. A search that is made again asks the journal
first, takes the same decisions and so asks for the same jobs, until it comes to the one at which it was cut short.
"""

from __future__ import annotations

import hashlib
import io
import os
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.laws.law import Effect

ALLOWED = ("fibrefit.discovery.engine.", "fibrefit.problem.estimate.", "fibrefit.problem.linear_model.")
"""Where the classes of results come from. A file that names anything else is not one of ours."""


def digest(*parts: Any) -> str:
    """Hexadecimal digest of names, numbers, arrays, and sequences of them."""
    found = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            found.update(f"{part.dtype}{part.shape}".encode())
            found.update(np.ascontiguousarray(part).tobytes())
        elif isinstance(part, tuple | list):
            found.update(f"({digest(*part)})".encode())
        else:
            found.update(repr(part).encode())
        found.update(b"\0")
    return found.hexdigest()


def signature_of(parent: LaplaceFit | Hypothesis, noise: Sequence[str]) -> str:
    """Digest of a hypothesis, and of the noise, as words, and errors of inputs it is seen with."""
    seen = signature_of_inputs(parent.supermodel)
    if isinstance(parent, Hypothesis):
        return digest(parent.names, parent.fit.local, parent.fit.cost, seen)
    found = parent.evidence.mode
    return digest(parent.names, parent.local, found.place.eta, found.sigma, parent.log, list(noise), seen)


def signature_of_inputs(supermodel: Supermodel) -> str:
    """Digest of the errors of inputs a supermodel is seen with, and of where its readings were linearised in them."""
    if (known := supermodel.sensitivities) is None:
        return ""
    # About the same errors readings react otherwise at other values: by the power of each direction.
    powers = [np.diag(record.inverse) for record in known.records]
    return digest(*map(np.asarray, known.coefficients.values()), np.asarray(known.downweight), *powers)


def name_of(thing: Any) -> str | None:
    """Name under which a model or an effect is found again."""
    if isinstance(thing, Supermodel):
        return "supermodel:" + ",".join(effect.name for effect in thing.effects)
    if isinstance(thing, type) and issubclass(thing, Effect):
        return f"effect:{thing.name}"
    return None


def known_by_name(
    effects: Sequence[type[Effect]],
    supermodel_with: Callable[[Sequence[type[Effect]]], Supermodel],
    own: Supermodel | None,
) -> Callable[[str], Any]:
    """Finds what `name_of` named.

    Parameters
    ----------
    effects : sequence of Effect class
        Of a search.
    supermodel_with : callable
        The supermodel of some of them.
    own : Supermodel or None
        One with other effects too.
    """
    by_name = {effect.name: effect for effect in (*effects, *(own.effects if own else ()))}

    def found(name: str) -> Any:
        if own is not None and name == name_of(own):
            return own
        kind, _, names = name.partition(":")
        some = tuple(by_name[one] for one in names.split(",") if one)
        return some[0] if kind == "effect" else supermodel_with(some)

    return found


@dataclass(frozen=True)
class Journal:
    """Results of jobs in a folder.

    Parameters
    ----------
    folder : pathlib.Path or None
        None keeps nothing.
    named : callable
        Name of an object that is not kept but found again, such as a class or a compiled model; None for others.
    found : callable
        The object of a name.
    """

    folder: Path | None = None
    named: Callable[[Any], str | None] = lambda thing: None
    found: Callable[[str], Any] = lambda name: None

    def recall(self, key: str, job: Callable[[], Any]) -> Any:
        """Result of a job: that of an earlier run, or a new one that is kept.

        Parameters
        ----------
        key : str
            Digest of all the result depends on.
        job : callable
        """
        if self.folder is None:
            return job()
        file = self.folder / f"{key}.job"
        try:
            return _Reader(io.BytesIO(file.read_bytes()), self.found).load()
        except (
            OSError,
            pickle.UnpicklingError,
            EOFError,
            AttributeError,
            ImportError,
            IndexError,
            KeyError,
            TypeError,
            ValueError,
        ):
            pass
        result = job()
        self._keep(file, result)
        return result

    def _keep(self, file: Path, result: Any) -> None:
        content = io.BytesIO()
        _Writer(content, self.named).dump(result)
        half = file.with_name(f".{file.name}.tmp")
        try:
            half.write_bytes(content.getvalue())
            os.replace(half, file)
        except OSError:
            half.unlink(missing_ok=True)  # a full disk costs the journal, not the search


class _Writer(pickle.Pickler):
    def __init__(self, file: io.BytesIO, named: Callable[[Any], str | None]) -> None:
        super().__init__(file, protocol=5)
        self._named = named

    def persistent_id(self, obj: Any) -> str | None:
        """Name of what is not kept but found again."""
        return self._named(obj)


class _Reader(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, found: Callable[[str], Any]) -> None:
        super().__init__(file)
        self._found = found

    def persistent_load(self, pid: str) -> Any:
        """The object of a name."""
        return self._found(pid)

    def find_class(self, module: str, name: str) -> Any:
        """A class of results, or what NumPy needs for arrays; nothing else is ever called.

        A name with dots leads from a class to its methods and to all they know, and a module knows more classes than
        its own, such as `Path`, whose methods write and remove files.
        """
        if (module, name) in _NUMPY:
            return super().find_class(module, name)
        found = super().find_class(module, name) if module.startswith(ALLOWED) and "." not in name else None
        if not isinstance(found, type) or found.__module__ != module:
            raise pickle.UnpicklingError(f"{module}.{name} is no part of a result")
        return found


_NUMPY: Mapping[tuple[str, str], None] = dict.fromkeys(
    [
        (module, name)
        for module in (
            "numpy._core.multiarray",
            "numpy.core.multiarray",
            "numpy._core.numeric",
            "numpy.core.numeric",
            "numpy",
        )
        for name in ("_reconstruct", "scalar", "_frombuffer", "ndarray", "dtype")
    ]
)
