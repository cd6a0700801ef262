"""Compiled programs: kept as long as they are few, so that the memory of a process that works for days stays flat."""

from __future__ import annotations

import ctypes
import gc
import sys
from contextlib import suppress

MOST_PROGRAMS = 100
"""Programs kept: several studies' worth of fits, or one search's. Each takes some 10 MB; one that is wanted again comes
from the disk cache."""


def bound_programs() -> bool:
    """Forget all compiled programs if there are more than `MOST_PROGRAMS`; to be called between two pieces of work.

    JAX keeps every program for every shape it has met until the process ends.

    Returns
    -------
    bool
        Whether they were forgotten.
    """
    if "jax" not in sys.modules:
        return False
    import jax
    from jax.extend.backend import get_backend

    if len(get_backend().live_executables()) <= MOST_PROGRAMS:
        return False
    jax.clear_caches()
    if kept := sys.modules.get("fibrefit.core.programs.kept"):
        kept.forget_programs()
    gc.collect()
    _give_back()
    return True


def _give_back() -> None:
    """Return what is free to the system: the allocator of the GNU library would keep nearly all of it."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)
