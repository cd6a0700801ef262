"""Linear algebra keeps to one thread while a piece of work goes on, and gets its own back after it."""

from __future__ import annotations

import pytest
import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_info, threadpool_limits

from fibrefit.core.threads import one_blas_thread


def threads() -> set[int]:
    """Threads of each library of linear algebra that is loaded."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_work_is_done_by_one_thread_and_the_others_come_back() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        assert one_blas_thread(threads)() == {1}
        assert threads() == before


def test_an_error_gives_them_back_too() -> None:
    @one_blas_thread
    def broken() -> None:
        raise ValueError("broken")

    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with pytest.raises(ValueError, match="broken"):
            broken()
        assert threads() == before


def test_it_is_told_like_the_function_itself() -> None:
    def known(number: int) -> int:
        """What is known."""
        return number

    assert one_blas_thread(known)(3) == 3
    assert (one_blas_thread(known).__name__, one_blas_thread(known).__doc__) == ("known", "What is known.")
