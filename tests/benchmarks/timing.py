"""Timing of contenders in turn, so that a busy moment of the machine hits all of them."""

from __future__ import annotations

import resource
import statistics
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

Clock = Callable[[], float]


def processor_time() -> float:
    """Time that processors spent on this process and on those it waited for, in s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


class Contender(NamedTuple):
    """Something to be timed.

    Parameters
    ----------
    run : does the work and waits until it is done
    repeats : how often; slow ones less
    share : divides the time, e.g. the number of runs of a batch
    """

    run: Callable[[], object]
    repeats: int = 15
    share: int = 1


class Times(NamedTuple):
    """Median and shortest time, in s."""

    median: float
    best: float


class Stopwatch:
    """Times contenders; by the clock on the wall, or by what processors spent where a machine is busy with other work.

    Parameters
    ----------
    busy : whether the machine is
    """

    def __init__(self, busy: bool = False) -> None:
        self.clock: Clock = processor_time if busy else time.perf_counter

    def once(self, run: Callable[[], object]) -> float:
        """Time of one run, in s."""
        begin = self.clock()
        run()
        return self.clock() - begin

    def interleaved(self, contenders: Mapping[str, Contender], warm: bool = True) -> dict[str, Times]:
        """Times of all contenders, round by round; each runs once before, unless not `warm`."""
        if warm:
            for contender in contenders.values():
                contender.run()
        taken: dict[str, list[float]] = {name: [] for name in contenders}
        for turn in range(max(contender.repeats for contender in contenders.values())):
            for name, contender in contenders.items():
                if turn < contender.repeats:
                    taken[name].append(self.once(contender.run) / contender.share)
        return {name: Times(statistics.median(values), min(values)) for name, values in taken.items()}


def spoken(seconds: float) -> str:
    """A time as people say it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} µs"
