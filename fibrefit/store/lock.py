"""One run at a time in a folder: a lock of the operating system, which ends with the process that holds it."""

from __future__ import annotations

import errno
import os
import platform
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from filelock import FileLock, Timeout

from fibrefit.core.errors import UsageError

HOLDER_SECONDS = 0.5
"""Seconds in which the holder of a lock has written who it is; a message to people waits for it no longer."""


HOLDER = "process "
"""How the line begins that tells who holds a lock."""


def lock_file(folder: Path) -> Path:
    """The file that is locked while a run writes to `folder`: beside it, since the folder itself is exchanged."""
    return folder.with_name(f".{folder.name}.lock")


@contextmanager
def locked(folder: Path, shown: str) -> Iterator[None]:
    """Block in which nobody else writes to a folder.

    On a file system shared by several machines the lock is advisory: it holds as far as that file system carries
    locks from one machine to another. What the file says of its holder is for people; nothing is concluded from it.

    Parameters
    ----------
    folder : pathlib.Path
        Absolute, without links; its parent exists.
    shown : str
        How messages call it.

    Raises
    ------
    UsageError
        At once, if another run holds the lock, or something else in the place of the file.
    OSError
        If the file of the lock cannot be made.
    """
    path = lock_file(folder)
    if _is_foreign(path):
        raise UsageError(
            str(path), "is in the way", "nothing of that name, or the lock of a run", "Move it, or name another --out."
        )
    lock = FileLock(path, timeout=0, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout:
        if not path.exists():  # some file systems say "no such file" where they mean that none can be made
            raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(path)) from None
        raise UsageError(
            shown, f"is being written by another run{_holder(path)}", "a folder of its own for each run",
            "Wait for it, or name another --out.",
        ) from None  # fmt: skip
    try:
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        # Windows lets nobody write to what is locked, the holder by a second handle neither.
        with suppress(OSError):
            path.write_text(f"{HOLDER}{os.getpid()} on {platform.node()} since {now}", encoding="utf-8")
        yield
    finally:
        # Removed while it is held: whoever waits for this very file finds out that its name is gone, and begins anew.
        with suppress(OSError):
            path.unlink()
        lock.release()


def _is_foreign(path: Path) -> bool:
    """Whether there is something that no run has left: what is locked is emptied first, and removed at the end."""
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return True
        with path.open("rb") as file:
            said = file.read(len(HOLDER))
    except OSError:
        return False
    return not HOLDER.encode().startswith(said)


def _holder(path: Path) -> str:
    """What the file says of who holds it: for an instant after the lock was taken it says nothing yet."""
    ends = time.monotonic() + HOLDER_SECONDS
    while True:
        try:
            said = path.read_text(encoding="utf-8", errors="replace")[:200]
        except OSError:
            return ""
        if said or time.monotonic() > ends:
            return f" ({said})" if said else ""
        time.sleep(0.01)
