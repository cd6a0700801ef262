"""How much a file or a command may ask for, how long work may take, and how it reports its progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TypeVar

from fibrefit.core.errors import DataError, FibrefitError, UsageError

LARGEST = 1 << 30
"""Bytes of a file, of what it unpacks to, or of the arrays it declares: 134 million numbers."""
MOST_CELLS = 30_000_000
"""Cells of a table of text, of which each takes up to 0.2 kB while it is read."""
LARGEST_STUDY = 1 << 24
"""Bytes of a study or of a table of records."""
MOST_PLANNED = 10_000_000
"""Samples of all planned records of a study, of which each takes some hundred bytes: an hour at 2.8 kHz."""
MOST_SWEPT = 50_000_000
"""Steps of one period in all runs of a curve of a sweep, of which a quarter or less is simulated at once."""
SMALLEST_SIZE, LARGEST_SIZE = 1e-18, 1e15
"""Sizes in SI beyond which a number is a slip of the pen, or damage: within, squares and quotients stay finite."""
MOST_STARTS = 10_000
"""Of one search: hundreds of times what is usual, beyond which they take gigabytes and days."""
LARGEST_SEED = 2**63 - 1
"""The largest a file of a result holds."""


@dataclass
class Allowance:
    """Bytes that what one file holds may take, all of it together.

    Parameters
    ----------
    where : str
        File to name in messages.
    error : type
        Class of the error.
    left : int
        Bytes that may still be taken.
    """

    where: str
    error: type[FibrefitError]
    left: int = field(default_factory=lambda: LARGEST)

    def take(self, size: int) -> None:
        """Count some bytes that are about to be read or made room for.

        Raises
        ------
        FibrefitError
            Of the class `error`, if they are more than are left.
        """
        self.left -= int(size)
        if self.left < 0:
            limit = f"{LARGEST / (1 << 30):.3g} GiB"
            got, do = f"more than {limit} unpacked or declared", "Cut the file into parts."
            raise self.error(self.where, got, f"one experiment, {limit} at most", do)


def too_many_cells(where: str, error: type[FibrefitError]) -> FibrefitError:
    """Refusal of a table of text that would take all memory while it is read."""
    most = f"{MOST_CELLS / 1e6:g} million"
    do = "Cut it into parts, or save it as Parquet or MATLAB, which take more."
    return error(where, f"more than {most} cells", f"a table of {most} cells at most", do)


def too_long(where: str, size: int, error: type[FibrefitError]) -> FibrefitError:
    """Refusal of a planned record by its number of samples, with which those of its study are too many."""
    most = f"{MOST_PLANNED / 1e6:g} million at most, of all records together"
    do = "Give it a shorter duration, or a smaller sampling_rate."
    return error(where, f"a planned record of {size:.3g} samples", most, do)


def too_far_apart(where: str, size: int, gap: float, after: float) -> DataError:
    """Refusal of a record by the number of samples from its first to its last, and its longest gap in s."""
    got = (
        f"{size:.3g} samples from the first to the last, most of them missing: a gap of {gap:.6g} s after {after:.6g} s"
    )
    most = f"{MOST_PLANNED / 1e6:g} million at most"
    return DataError(where, got, most, "Correct the times behind the gap, or split the file there.")


def refuse_starts(starts: int) -> None:
    """Refuse a number of starts that no search can do.

    Raises
    ------
    UsageError
    """
    _refuse_outside("starts", starts, 1, MOST_STARTS)


def refuse_seed(seed: int) -> None:
    """Refuse a seed that random numbers, or the file of a result, do not take.

    Raises
    ------
    UsageError
    """
    _refuse_outside("seed", seed, 0, LARGEST_SEED)


def _refuse_outside(name: str, number: int, least: int, most: int) -> None:
    if not least <= number <= most:
        raise UsageError(name, str(number), f"{least} to {most}", "")


_until: ContextVar[float] = ContextVar("until", default=float("inf"))
_cuts: ContextVar[list[float] | None] = ContextVar("cuts", default=None)

T = TypeVar("T")


class OutOfTimeError(Exception):
    """The time given to the work in hand is over."""


@dataclass(frozen=True)
class Budget:
    """Time given to a task.

    Parameters
    ----------
    began : float
        By the monotonic clock; now, unless said.
    """

    seconds: float
    began: float = field(default_factory=time.monotonic)

    @property
    def used(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self.began

    @property
    def left(self) -> float:
        """Seconds that remain; negative once it is used up."""
        return self.seconds - self.used


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Let the work in the block take so many seconds; a limit around it holds as well.

    Parameters
    ----------
    seconds : float
        From now.

    Notes
    -----
    Nothing is cut off by force: work asks `check_time` between its steps.
    """
    token = _until.set(min(_until.get(), time.monotonic() + seconds))
    try:
        yield
    finally:
        _until.reset(token)


@contextmanager
def beyond_limits() -> Iterator[None]:
    """Let the work in the block go on whatever limits are around it: a few last steps, without which all is lost."""
    token = _until.set(float("inf"))
    try:
        yield
    finally:
        _until.reset(token)


def time_left() -> float:
    """Seconds until the nearest limit; infinite where there is none."""
    return _until.get() - time.monotonic()


def time_for(seconds: float) -> bool:
    """Whether so many seconds are left until the nearest limit; where they are not, `cuts_noted` notes a cut."""
    enough = time_left() > seconds
    if not enough:
        note_cut()
    return enough


def note_cut() -> None:
    """Note that the work in hand ends for lack of time where it would have gone on."""
    if (cuts := _cuts.get()) is not None:
        cuts.append(time_left())


@contextmanager
def cuts_noted() -> Iterator[list[float]]:
    """The time left, in s, at each end for lack of time inside the block: what comes of it may be less than it could.

    Yields
    ------
    list of float
        Empty as long as nothing was cut short.
    """
    cuts: list[float] = []
    token = _cuts.set(cuts)
    try:
        yield cuts
    finally:
        _cuts.reset(token)


def check_time() -> None:
    """Go on only if there is time left.

    Raises
    ------
    OutOfTimeError
    """
    if time_left() <= 0.0:
        raise OutOfTimeError


def in_time(job: Callable[[], T], otherwise: T, seconds: float = float("inf")) -> tuple[T, bool]:
    """Result of a job and whether it came in time; `otherwise` if it did not.

    Parameters
    ----------
    otherwise : object
    seconds : float
        That the job may take.
    """
    try:
        with time_limit(seconds):
            return job(), True
    except OutOfTimeError:
        return otherwise, False


Progress = Callable[[str, float | None], None]
"""Callback of long work: called with what is being done and the share that is finished, None where it is not known."""


def quiet(doing: str, share: float | None) -> None:
    """Progress that is reported to nobody."""
