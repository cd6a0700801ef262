"""``fibrefit doctor``: whether this installation can do its work."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import click

from fibrefit.cli.terminal import Terminal, with_terminal

#: Exit code of a run that ended but did not pass its own checks.
NOT_PASSED = 5


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One thing that was looked at.

    Parameters
    ----------
    name : str
        What was looked at.
    passed : bool
        Whether it is as it should be.
    says : str
        What was found, and what to do where it is not.
    """

    name: str
    passed: bool
    says: str


@click.command("doctor")
@with_terminal
def command(terminal: Terminal) -> int:
    """Look at versions, precision, compile cache, devices and write rights."""
    from fibrefit.core.environment import configure_jax, versions

    configure_jax()
    found = versions()
    diagnoses = [_checked(name, check) for name, check in CHECKS.items()]
    lines = [f"{'ok' if each.passed else 'BAD':<4} {each.name:<14} {each.says}" for each in diagnoses]
    lines += ["", *(f"     {name:<14} {version}" for name, version in found.items())]
    passed = all(each.passed for each in diagnoses)
    document = {"passed": passed, "checks": [asdict(each) for each in diagnoses], "versions": found}
    terminal.answer("\n".join(lines), document)
    return 0 if passed else NOT_PASSED


def _checked(name: str, check: Callable[[], tuple[bool, str]]) -> Diagnosis:
    """Outcome of a check; whatever it raises is a finding too."""
    try:
        return Diagnosis(name, *check())
    except Exception as error:
        return Diagnosis(name, False, f"{type(error).__name__}: {error}")


def _python() -> tuple[bool, str]:
    return sys.version_info >= (3, 11), f"{sys.version.split()[0]} at {sys.executable}"


def _packages() -> tuple[bool, str]:
    from fibrefit.core.environment import versions

    absent = [name for name, version in versions().items() if version == "not installed"]
    return not absent, f"not installed: {', '.join(absent)}" if absent else "all are installed"


def _precision() -> tuple[bool, str]:
    import jax
    import jax.numpy as jnp

    one = jax.jit(lambda x: x + 1e-15)(jnp.ones(()))
    return bool(one > 1.0), f"JAX computes in {one.dtype}"


def _devices() -> tuple[bool, str]:
    import jax

    return True, f"{', '.join(str(device) for device in jax.devices())}; {os.cpu_count()} processor cores"


def _compile_cache() -> tuple[bool, str]:
    import jax

    folder = jax.config.values["jax_compilation_cache_dir"]
    if folder is None:
        return False, "none: every run compiles anew. Name a writable folder in FIBREFIT_CACHE."
    files = [path for path in Path(folder).glob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    if not os.access(folder, os.W_OK):
        return False, f"{folder} cannot be written. Name another folder in FIBREFIT_CACHE."
    return True, f"{len(files)} programs, {size:.1f} MB in {folder}"


def _write_rights() -> tuple[bool, str]:
    here = Path.cwd()
    try:
        with tempfile.TemporaryFile(dir=here):
            return True, f"results can be written in {here}"
    except OSError as error:
        return False, f"{here}: {error.strerror}. Change to another folder, or use --out."


CHECKS: dict[str, Callable[[], tuple[bool, str]]] = {
    "python": _python,
    "packages": _packages,
    "precision": _precision,
    "devices": _devices,
    "compile cache": _compile_cache,
    "write rights": _write_rights,
}
