"""Chains on disk while they grow: one file, always whole, that holds all a run needs to go on bit for bit."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from fibrefit.core.errors import UsageError

FORM = 1


@dataclass
class Chain:
    """The course of one ensemble so far.

    Parameters
    ----------
    start : (n_walker, n)
        Where the walkers began.
    start_log_density : (n_walker,)
    points : (n_step, n_walker, n)
    log_density : (n_step, n_walker)
    random : tuple
        State of the random generator after the last step, as NumPy's legacy generator gives it.
    """

    start: np.ndarray
    start_log_density: np.ndarray
    points: np.ndarray
    log_density: np.ndarray
    random: tuple[Any, ...]

    @property
    def last(self) -> tuple[np.ndarray, np.ndarray]:
        """Points and log densities the next step begins with."""
        if len(self.points):
            return self.points[-1], self.log_density[-1]
        return self.start, self.start_log_density


def save(path: Path, chains: list[Chain]) -> None:
    """Write a checkpoint; an older one stays until the new one is complete on disk."""
    content: dict[str, np.ndarray] = {"form": np.array(FORM), "ensembles": np.array(len(chains))}
    for i, chain in enumerate(chains):
        name, keys, position, has_gauss, gauss = chain.random
        content |= {
            f"{i}.start": chain.start,
            f"{i}.start_log_density": chain.start_log_density,
            f"{i}.points": chain.points,
            f"{i}.log_density": chain.log_density,
            f"{i}.random_name": np.array(name),
            f"{i}.random_keys": np.asarray(keys, dtype=np.uint32),
            f"{i}.random_place": np.array([position, has_gauss], dtype=np.int64),
            f"{i}.random_gauss": np.array(gauss, dtype=float),
        }
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with temporary.open("wb") as file:
            np.savez(file, **content)  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def load(path: Path, starts: list[Chain]) -> list[Chain]:
    """Chains of a checkpoint, if it belongs to the run that begins as `starts` do.

    Raises
    ------
    UsageError
        If it cannot be read, or its walkers began elsewhere: another study, other data, settings or versions.
    """
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            if int(file["form"]) != FORM:
                raise ValueError(f"form {int(file['form'])}")
            chains = [_chain(file, i) for i in range(int(file["ensembles"]))]
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        raise UsageError(
            str(path), f"no checkpoint: {error}", "one of this program", "Start anew, with --force."
        ) from None
    same = len(chains) == len(starts) and all(
        np.array_equal(a.start, b.start) and np.array_equal(a.start_log_density, b.start_log_density)
        for a, b in zip(chains, starts, strict=True)
    )
    if not same:
        raise UsageError(
            str(path),
            "the checkpoint of another run: its walkers began elsewhere",
            "the same study, data, seed, settings and versions",
            "Start anew, with --force, or go back to what the run was started with.",
        )
    return chains


def _chain(file: Any, i: int) -> Chain:
    position, has_gauss = (int(part) for part in file[f"{i}.random_place"])
    state = (str(file[f"{i}.random_name"]), file[f"{i}.random_keys"], position, has_gauss)
    start, its_density, points, log_density = (
        file[f"{i}.{name}"] for name in ("start", "start_log_density", "points", "log_density")
    )
    return Chain(start, its_density, points, log_density, (*state, float(file[f"{i}.random_gauss"])))
