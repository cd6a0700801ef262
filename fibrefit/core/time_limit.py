"""Time that work may take: a limit that holds for all that is done inside a block, in its threads too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TypeVar

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
        By the monotonic clock.
    """

    seconds: float
    began: float

    @classmethod
    def of(cls, seconds: float) -> Budget:
        """A budget that begins now."""
        return cls(seconds, time.monotonic())

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
