"""Products of matrices take one thread: work is shared out by records, starts and candidates."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """A function during which NumPy's and SciPy's linear algebra keeps to the thread that asks for it.

    Threads of BLAS beside those of the work wait for each other: where other work keeps the cores busy, eigenvalues of
    a matrix of 600 rows take 5 s of processor time in place of 0.04 s. And sums that are split by the number of cores
    differ from machine to machine in their last digits.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return alone


@cache
def _libraries() -> Any:
    """What is loaded; to look for it takes as long as reading a small record."""
    import scipy.linalg  # noqa: F401  its library is limited only once it is loaded
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
