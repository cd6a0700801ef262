"""Where the program runs: versions, cache directories and the settings JAX reads once, when it is imported."""

from __future__ import annotations

import functools
import os
import platform
import re
import stat
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

#: Packages whose version can change a result; recorded with every one.
PACKAGES = (
    "fibrefit", "numpy", "scipy", "pandas", "jax", "jaxlib", "optimistix", "equinox", "emcee", "h5py", "pydantic",
    "pint", "arviz-stats", "statsmodels",
)  # fmt: skip

COMPILER_FLAGS = (
    # Options that a compiler leaves alone if it does not know them.
    "--xla_backend_extra_options="
    # The CPU compiler turns a loop into one native function only while its body touches fewer bytes than this; its own
    # limit of 1 kB leaves a time step of a rig just outside, where each operation is a call and a run takes 15 times
    # longer.
    "xla_cpu_small_while_loop_byte_threshold=100000,"
    # The older way to make code of fused operations: a third less time to compile, the same bits, and runs as fast,
    # since native loops are made that way in any case.
    "xla_cpu_disable_new_fusion_emitters=true",
    # Later instruction sets fuse a product and a sum into one rounding, here and not there: the same formula then gives
    # other last bits in another program, and an effect that is zero would not be absent. The loops run faster without.
    "--xla_cpu_max_isa=AVX",
    # No library that shares sums out among threads: their last digits would hang on the number of threads. Products
    # of matrices are made of blocks for the same reason, see core/programs.py.
    "--xla_cpu_experimental_ynn_fusion_type=",
)


@functools.cache
def versions() -> dict[str, str]:
    """Versions of Python, the platform and every package a result depends on, as they were when it was first read.

    Returns
    -------
    dict of str to str
        Package name to version; ``"not installed"`` where there is none.
    """
    from importlib import metadata  # a tenth of the start-up time of the command line

    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in PACKAGES:
        try:
            # The description behind the head of the metadata takes a while to parse.
            head = (metadata.distribution(package).read_text("METADATA") or "").partition("\n\n")[0]
            version = re.search(r"^Version: *(.+?) *$", head, re.MULTILINE)
            found[package] = version.group(1) if version else metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def cache_directory() -> Path:
    """Directory for files that can be made again, such as compiled programs and error logs.

    ``FIBREFIT_CACHE`` names it; otherwise it is where the platform keeps such files.
    The directory need not exist.
    """
    if chosen := os.environ.get("FIBREFIT_CACHE"):
        with suppress(RuntimeError):  # of a user without a home
            return Path(chosen).expanduser()
    try:
        home = Path.home()
    except RuntimeError:  # a job may have none
        home = None
    if sys.platform == "win32" and (base := os.environ.get("LOCALAPPDATA") or (home and home / "AppData" / "Local")):
        return Path(base) / "fibrefit" / "cache"
    if base := os.environ.get("XDG_CACHE_HOME"):
        return Path(base) / "fibrefit"
    if home is None:
        import tempfile

        return Path(tempfile.gettempdir()) / f"fibrefit-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    return home / ("Library/Caches" if sys.platform == "darwin" else ".cache") / "fibrefit"


def own_folder(name: str) -> Path | None:
    """Folder for compiled programs in the cache; None where none can be written, or where others may write to it.

    Programs are code that is run: what stands among temporary files, or where a job script says, can have been put
    there by anybody.

    Parameters
    ----------
    name : str
        ``"jax"`` or ``"programs"``.
    """
    cache = cache_directory()
    folder = cache / name
    try:
        cache.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        ours = _is_own(cache, stat.S_ISVTX) and _is_own(folder)
    except OSError:
        return None
    return folder if ours and os.access(folder, os.W_OK) else None


def _is_own(folder: Path, unless: int = 0) -> bool:
    """Whether nobody else can write to a folder, or may, as its mode says, but not remove what is ours."""
    if not hasattr(os, "getuid"):
        return True
    there = folder.stat()
    return there.st_uid in (os.getuid(), 0) and (not there.st_mode & stat.S_IWOTH or bool(there.st_mode & unless))


def merge_xla_flags(wanted: Iterable[str], present: str) -> str:
    """Value of ``XLA_FLAGS`` with `wanted` added where the user has not already decided.

    Parameters
    ----------
    wanted : iterable of str
        Flags such as ``"--xla_cpu_multi_thread_eigen=false"``.
    present : str
        The value found in the environment.

    Returns
    -------
    str
        Flags separated by spaces; those in `present` come first and win.
    """
    flags = present.split()
    decided = {flag.partition("=")[0] for flag in flags}
    return " ".join(flags + [flag for flag in wanted if flag.partition("=")[0] not in decided])


def configure_jax() -> None:
    """Set double precision, the device and the compile cache; to be called before JAX is imported.

    Variables the user has set are left alone, except that precision is always double: the results depend on it.
    The settings stand in the environment, so that worker processes inherit them.
    """
    os.environ["JAX_ENABLE_X64"] = "1"
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    if flags := merge_xla_flags(COMPILER_FLAGS, os.environ.get("XLA_FLAGS", "")):
        os.environ["XLA_FLAGS"] = flags
    if directory := own_folder("jax"):
        os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(directory))
        # Everything is worth keeping: a fit is many small programs, each below JAX's own thresholds.
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
    if "jax" in sys.modules:
        # Somebody imported it first: it gets the same settings; its device is chosen by then.
        import jax

        jax.config.update("jax_enable_x64", True)
        for name, kind in (
            ("jax_compilation_cache_dir", str),
            ("jax_persistent_cache_min_compile_time_secs", float),
            ("jax_persistent_cache_min_entry_size_bytes", int),
        ):
            if value := os.environ.get(name.upper()):
                jax.config.update(name, kind(value))
