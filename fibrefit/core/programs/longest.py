"""How long making programs has taken in this process: nothing ends it on the way, and who has little time asks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import jax.monitoring

_STAGES = dict.fromkeys(
    (
        "/jax/core/compile/jaxpr_trace_duration",
        "/jax/core/compile/jaxpr_to_mlir_module_duration",
        "/jax/core/compile/backend_compile_duration",
    ),
    0.0,
)
"""Longest of each stage in s, under the names by which JAX tells of them."""
_ALL = dict.fromkeys(list(_STAGES)[1:], 0.0)
"""Sum over all programs in s, of the stages that tell of no part of a program twice: traces lie within others."""

_unwaited: ContextVar[bool] = ContextVar("unwaited", default=False)


def longest_compilation() -> float:
    """Time in s that the largest program so far took to make: traced, lowered, compiled. 0 where all were at hand."""
    return sum(_STAGES.values())


def all_compilations() -> float:
    """Time in s that lowering and compiling programs has taken, over all threads but those that nothing waits for."""
    return sum(_ALL.values())


@contextmanager
def unwaited() -> Iterator[None]:
    """Make programs in the block that nothing waits for: they take no time from what goes on beside them."""
    token = _unwaited.set(True)
    try:
        yield
    finally:
        _unwaited.reset(token)


def _told(event: str, duration_secs: float, **_: Any) -> None:
    if event in _ALL and not _unwaited.get():
        _ALL[event] += duration_secs
    if event in _STAGES:
        _STAGES[event] = max(_STAGES[event], duration_secs)


jax.monitoring.register_event_duration_secs_listener(_told)
