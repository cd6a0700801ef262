"""A batch in parts, for the job arrays of a cluster: which records belong to a part, and where the parts are."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from fibrefit.core.errors import UsageError

Piece = TypeVar("Piece")

DIGITS = 9
"""Of the number of parts: more than any job array has, and fewer than Python or a folder's name takes."""


def shard_of(said: str) -> tuple[int, int]:
    """Number and count of ``i/n``.

    Raises
    ------
    UsageError
        If it is not two whole numbers, the first from 1 to the second.
    """
    number, _, count = said.partition("/")
    whole = number.isdecimal() and count.isdecimal() and max(len(number), len(count)) <= DIGITS
    return _refuse_no_part(said, (int(number), int(count)) if whole else (0, 0))


def _refuse_no_part(said: str, shard: tuple[int, int]) -> tuple[int, int]:
    if not 1 <= shard[0] <= shard[1]:
        raise UsageError(
            f"--shard {said}", "not a part of a whole", "i/n with i from 1 to n", "For example --shard 3/20."
        )
    return shard


def part_of(whole: Path, jobs: Sequence[Piece], shard: tuple[int, int] | None) -> tuple[Path, list[Piece]]:
    """Folder and jobs of a part; the whole where none is requested.

    Raises
    ------
    UsageError
        If it is no part, or there are more parts than jobs, so that this one is empty.
    """
    if shard is None:
        return whole, list(jobs)
    number, count = _refuse_no_part("{}/{}".format(*shard), shard)
    mine = list(jobs[number - 1 :: count])
    if not mine:
        got = f"{len(jobs)} record{'s' * (len(jobs) != 1)}"
        raise UsageError(f"--shard {number}/{count}", got, "as many parts at the most", "")
    return whole.with_name(f"{whole.name}.shard-{number}-of-{count}"), mine


def parts_of(whole: Path) -> tuple[Path, ...]:
    """Folders of parts that are there, finished or not."""
    return tuple(sorted(path for path in whole.parent.glob(f"{glob.escape(whole.name)}.shard-*") if path.is_dir()))
