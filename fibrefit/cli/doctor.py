"""``fibrefit doctor``: whether this installation can do its work."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from fibrefit.cli.options import plain_command
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal

Check = Callable[[], tuple[bool, str]]
CHECKS: dict[str, Check] = {}
"""By name: each tells whether something is as it should be, and what was found."""


@plain_command("doctor")
def doctor_command(terminal: Terminal) -> int:
    """Look at versions, precision, compile cache, devices and write rights."""
    from fibrefit.core.environment import configure_jax, versions

    configure_jax()
    found = versions()
    lines, checks = [], []
    for name, check in CHECKS.items():
        try:
            passed, says = check()
        except Exception as error:  # whatever it raises is a finding too
            passed, says = False, f"{type(error).__name__}: {error}"
        lines.append(f"{'ok' if passed else 'BAD':<4} {name:<14} {says}")
        checks.append({"name": name, "passed": passed, "says": says})
    lines += ["", *(f"     {name:<14} {version}" for name, version in found.items())]
    well = all(check["passed"] for check in checks)
    terminal.answer("\n".join(lines), {"passed": well, "checks": checks, "versions": found})
    return 0 if well else NOT_TRUSTED


def _check(name: str) -> Callable[[Check], Check]:
    """Put a function among the checks."""
    return lambda check: CHECKS.setdefault(name, check)


@_check("python")
def _python() -> tuple[bool, str]:
    return sys.version_info >= (3, 11), f"{sys.version.split()[0]} at {sys.executable}"


@_check("packages")
def _packages() -> tuple[bool, str]:
    from fibrefit.core.environment import versions

    absent = [name for name, version in versions().items() if version == "not installed"]
    return not absent, f"not installed: {', '.join(absent)}" if absent else "all are installed"


@_check("precision")
def _precision() -> tuple[bool, str]:
    import jax
    import jax.numpy as jnp

    one = jax.jit(lambda x: x + 1e-15)(jnp.ones(()))
    return bool(one > 1.0), f"JAX computes in {one.dtype}"


@_check("devices")
def _devices() -> tuple[bool, str]:
    import jax

    return True, f"{', '.join(str(device) for device in jax.devices())}; {os.cpu_count()} processor cores"


@_check("compile cache")
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


@_check("write rights")
def _write_rights() -> tuple[bool, str]:
    here = Path.cwd()
    try:
        with tempfile.TemporaryFile(dir=here):
            return True, f"results can be written in {here}"
    except OSError as error:
        return False, f"{here}: {error.strerror}. Change to another folder, or use --out."
