"""Programs that are kept: found again, never taken for another; the same bits for any number of threads."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier, Event, Semaphore
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core import programs, threads
from fibrefit.core.declarations import Parameter
from fibrefit.core.programs import KeptProgram, NotDescribedError, column_products, fingerprint
from fibrefit.core.threads import thread_pool


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(programs, "programs_folder", lambda: tmp_path)
    return tmp_path


def fresh(traced: list[int]) -> KeptProgram[Any]:
    """As another process would have it: nothing in memory; `traced` grows with every trace."""

    def function(times: Any, power: int) -> dict[str, Any]:
        traced.append(power)
        return {"of": (times**power, None), "root": jnp.linalg.cholesky(jnp.eye(2) * 4.0)}

    return KeptProgram(function)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A function of a test has no stable name: its arguments are told alone."""
    monkeypatch.setattr(
        programs, "fingerprint", lambda value, depth=0: fingerprint(value if depth else value[1:], depth)
    )


@pytest.mark.usefixtures("told", "folder")
def test_it_is_made_without_being_carried_out() -> None:
    traced: list[int] = []
    program = fresh(traced)
    program.make(jnp.zeros(3), 2)
    assert traced == [2]
    assert len(program._programs) == 1
    np.testing.assert_array_equal(program(jnp.arange(3.0), 2)["of"][0], [0.0, 1.0, 4.0])
    assert traced == [2]


@pytest.mark.usefixtures("told")
def test_it_is_found_again_without_tracing(folder: Path) -> None:
    traced: list[int] = []
    with programs._without_cache():
        first = fresh(traced)(np.arange(3.0), 2)
    again = fresh(traced)(np.arange(3.0) + 1.0, 2)
    assert traced == [2]
    assert len(list(folder.glob("*.program"))) == 1
    np.testing.assert_array_equal(first["of"][0], [0.0, 1.0, 4.0])
    np.testing.assert_array_equal(again["of"][0], [1.0, 4.0, 9.0])
    np.testing.assert_array_equal(again["root"], 2.0 * np.eye(2))
    assert again["of"][1] is None


@pytest.mark.usefixtures("told", "folder")
def test_programs_are_made_side_by_side_and_each_of_them_once() -> None:
    traced: list[int] = []
    both = Barrier(2)

    def function(times: Any) -> Any:
        traced.append(times.size)
        both.wait(30.0)
        return 2.0 * times

    program = KeptProgram(function)
    calls = [np.arange(3.0), np.arange(4.0)] * 2
    with ThreadPoolExecutor(len(calls)) as pool:
        found = list(pool.map(program, calls))
    # Neither of the two would come past the barrier alone.
    assert sorted(traced) == [3, 4]
    for call, result in zip(calls, found, strict=True):
        np.testing.assert_array_equal(result, 2.0 * call)


@pytest.mark.usefixtures("told")
@pytest.mark.parametrize("other", [(np.arange(3.0), 3), (np.arange(4.0), 2), (np.arange(3), 2)])
def test_another_call_is_another_program(folder: Path, other: tuple[Any, int]) -> None:
    traced: list[int] = []
    with programs._without_cache():
        fresh(traced)(np.arange(3.0), 2)
        found = fresh(traced)(*other)
    assert len(traced) == 2
    np.testing.assert_array_equal(found["of"][0], other[0] ** other[1])


@pytest.mark.usefixtures("told")
def test_a_damaged_file_is_replaced(folder: Path) -> None:
    traced: list[int] = []
    with programs._without_cache():
        fresh(traced)(np.arange(3.0), 2)
        (file,) = folder.glob("*.program")
        file.write_bytes(file.read_bytes()[:200])
        found = fresh(traced)(np.arange(3.0), 2)
    assert traced == [2, 2]
    np.testing.assert_array_equal(found["of"][0], [0.0, 1.0, 4.0])


def test_the_folder_does_not_grow_without_end(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "MOST_ON_DISK", 3)
    for number in range(5):
        (folder / f"{number}.program").touch()
    programs._trim(folder)
    assert len(list(folder.glob("*.program"))) == 3


def test_what_has_no_stable_description_is_refused() -> None:
    class Own:
        """A class of a user's file."""

    for value in (Own, Own(), object(), lambda: 1):
        with pytest.raises(NotDescribedError):
            fingerprint(value)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 1.0),
        (True, 1),
        ("1", 1),
        ((1, 2), [1, 2]),
        (np.arange(2.0), np.arange(2)),
        (Parameter("a", "N", "x", 1.0), Parameter("a", "N", "x", 2.0)),
        (functools.partial(fingerprint, value=0), functools.partial(fingerprint, value=1)),
    ],
)
def test_values_that_differ_are_described_differently(one: Any, other: Any) -> None:
    said: Callable[[Any], str] = fingerprint
    assert said(one) != said(other)
    assert said(one) == said(one)


def test_the_time_of_the_largest_program_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "_LONGEST", dict.fromkeys(programs._LONGEST, 0.0))
    assert programs.longest_compilation() == 0.0
    told = [*programs._LONGEST, "/jax/another"]
    # The largest of each stage counts; one that takes less changes nothing.
    for event, seconds in [(told[0], 1.0), (told[1], 2.0), (told[2], 4.0), (told[3], 64.0), (told[2], 8.0)]:
        programs._on_duration(event, seconds, fun_name="large")
    assert programs.longest_compilation() == 11.0
    for event in told:
        programs._on_duration(event, 0.5)
    assert programs.longest_compilation() == 11.0


def test_the_time_of_all_programs_counts_no_part_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "_TOTAL", dict.fromkeys(programs._TOTAL, 0.0))
    trace, lower, compiling = programs._LONGEST
    for event, seconds in [(trace, 1.0), (lower, 2.0), (compiling, 4.0), (compiling, 8.0), ("/jax/another", 64.0)]:
        programs._on_duration(event, seconds)
    assert programs.all_compilations() == 14.0


def test_programs_that_nothing_waits_for_take_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "_TOTAL", dict.fromkeys(programs._TOTAL, 0.0))
    monkeypatch.setattr(threads, "THREADS", 2)
    compiling, done = list(programs._LONGEST)[2], Event()

    def make() -> None:
        programs._on_duration(compiling, 64.0)
        done.set()

    with threads.in_background([make]):
        assert done.wait(10.0)
        programs._on_duration(compiling, 8.0)
    assert programs.all_compilations() == 8.0


def test_beside_a_block_jobs_are_done_in_turn_and_fail_unheard(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 2)
    came, go_on, done = list[str](), Event(), Event()

    def fails() -> None:
        came.append("first")
        raise ValueError

    def waits() -> None:
        came.append("second")
        done.set()
        go_on.wait(10.0)

    with threads.in_background([fails, waits, lambda: came.append("third")]):
        assert done.wait(10.0)
    # The block is left: what is at hand is finished, and nothing more is begun.
    go_on.set()
    assert came == ["first", "second"]


def test_on_one_core_nothing_goes_on_beside_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 1)
    came = list[str]()
    with threads.in_background([lambda: came.append("first")]):
        pass
    assert came == []


def test_every_stage_of_making_a_program_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "_LONGEST", dict.fromkeys(programs._LONGEST, 0.0))
    with programs._without_cache():
        jax.jit(lambda x: jnp.sin(x) + 3.5)(np.arange(7.0))
    assert min(programs._LONGEST.values()) > 0.0


def test_threads_begin_nothing_more_once_they_are_interrupted() -> None:
    begun, both, release = list[int](), Semaphore(0), Event()

    def job(number: int) -> None:
        begun.append(number)
        both.release()
        release.wait(30.0)

    def interrupted() -> None:
        with thread_pool(2) as pool:
            running = [pool.submit(job, number) for number in range(20)]
            # Those that run end once the last of the others is given up.
            running[-1].add_done_callback(lambda _: release.set())
            assert all(both.acquire(timeout=30.0) for _ in range(2))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert begun == [0, 1]


def test_threads_that_are_not_end_with_all_they_were_given() -> None:
    with thread_pool(2) as pool:
        running = [pool.submit(lambda number: number**2, number) for number in range(20)]
    assert [one.result() for one in running] == [number**2 for number in range(20)]


SHAPES = (6, 8192), (33, 8192), (65, 5000), (256, 1000)
SCRIPT = """
import hashlib, sys
from fibrefit.core.environment import configure_jax
configure_jax()
import jax, jax.numpy as jnp, numpy as np
from fibrefit.core.programs import column_products
found = hashlib.sha256()
for k, n in {shapes}:
    rows = np.random.default_rng(k).normal(size=(2, k, n))
    for made in (column_products(rows.swapaxes(1, 2), rows.swapaxes(1, 2)), jnp.sum(rows)):
        found.update(np.asarray(made).tobytes())
    found.update(np.asarray(jax.jit({plain})(rows)).tobytes())
print(found.hexdigest())
"""


def digest(threads: int, plain: str) -> str:
    """Of products in blocks, of a sum, and of another product, by so many threads of the compiler."""
    script = SCRIPT.format(shapes=SHAPES, plain=plain)
    return subprocess.run(
        [sys.executable, "-c", script], env=os.environ | {"NPROC": str(threads)}, capture_output=True, text=True,
        check=True,
    ).stdout  # fmt: skip


@pytest.mark.parametrize("n", [1, 255, 256, 1000])
def test_they_are_the_products(n: int) -> None:
    one, other = (np.random.default_rng(i).normal(size=(2, k, n)) for i, k in enumerate((3, 5)))
    expected = one @ other.swapaxes(1, 2)
    columns = (jnp.asarray(array.swapaxes(1, 2)) for array in (one, other))
    np.testing.assert_allclose(column_products(*columns), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere another library multiplies")
def test_threads_change_no_bit() -> None:
    assert digest(1, "lambda rows: rows") == digest(8, "lambda rows: rows")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere another library multiplies")
def test_threads_do_change_the_bits_of_a_product_in_one_go() -> None:
    """Were it not so, the blocks would be of no use."""
    plain = "lambda rows: rows @ rows.swapaxes(1, 2)"
    assert digest(1, plain) != digest(8, plain)
