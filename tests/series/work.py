"""Pieces of work for the engines."""

from __future__ import annotations

import gc
import os
import signal
import time
from pathlib import Path


def doubled(number: int) -> int:
    """Twice the number; three cannot be done."""
    if number == 3:
        raise ValueError("three cannot be done")
    return 2 * number


def fatal(number: int) -> int:
    """Ends its process where the number is negative."""
    if number < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def fatal_once(argument: tuple[int, str]) -> int:
    """Ends its process the first time."""
    number, marker = argument
    if number == 1 and not Path(marker).exists():
        Path(marker).write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def slow(seconds: float) -> int:
    """Takes its time; tells who does it."""
    time.sleep(seconds)
    return os.getpid()


def frozen(number: int) -> int:
    """Objects that are not searched for garbage."""
    return gc.get_freeze_count()


def threads_of_programs(number: int) -> int:
    """Threads among which JAX shares out programs in this process."""
    import jax.numpy as jnp

    jnp.ones(number).sum().block_until_ready()
    names = [(task / "comm").read_text().strip() for task in Path("/proc/self/task").iterdir()]
    return names.count("tf_XLAEigen")
