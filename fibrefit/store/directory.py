"""The folder of a result: it appears whole, replaces only what is ours, and can be resumed."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import socket
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from fibrefit.core.errors import UsageError
from fibrefit.store.files import synchronise

#: File that tells a folder of ours from any other, and lists what we wrote into it.
MARKER = ".fibrefit"


def default_directory(study_name: str, *content: str, parent: Path = Path("results")) -> Path:
    """Folder of a result when none was named: ``results/<study>-<hash>``.

    Parameters
    ----------
    study_name : str
        Name of the study.
    content : str
        All that identifies the run: the resolved study, the digests of its inputs, settings.
    parent : pathlib.Path
        Folder of all results.

    Returns
    -------
    pathlib.Path
        The same for the same run.
    """
    slug = re.sub(r"[^\w]+", "_", study_name.lower()).strip("_")[:60] or "study"
    digest = hashlib.sha256("\0".join(content).encode()).hexdigest()
    return parent / f"{slug}-{digest[:8]}"


class ResultDirectory:
    """Context in which a result is written to a folder beside OUT that takes OUT's place at the end.

    When the block ends well, OUT holds all of it. When it is interrupted, what was written stays in ``OUT.partial``.
    When it fails, nothing stays, unless `keep` asks for it.

    Parameters
    ----------
    out : pathlib.Path
        Folder of the result.
    force : bool
        Replace an earlier result.
    resume : bool
        Go on from an interrupted or finished run.
    keep : bool
        Keep what was written when the run fails, so that it can be resumed.

    Attributes
    ----------
    path : pathlib.Path
        Folder to write to, inside the block.
    previous : pathlib.Path or None
        Folder with the files of the run that is resumed.

    Raises
    ------
    UsageError
        On entering, if OUT exists and may not be replaced, or another process is writing it.
    """

    def __init__(self, out: Path, *, force: bool = False, resume: bool = False, keep: bool = False) -> None:
        self.out = Path(os.path.abspath(out))
        self.path = self.out.with_name(f"{self.out.name}.partial")
        self.previous: Path | None = None
        self._shown, self._force, self._resume, self._keep = out, force, resume, keep

    def __enter__(self) -> Self:
        """Make the folder to write to, unless something forbids it."""
        self.check()
        if self._resume:
            self.previous = next((folder for folder in (self.path, self.out) if folder.is_dir()), None)
        elif self.path.exists():
            shutil.rmtree(self.path)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            _write_marker(self.path, {"pid": os.getpid(), "host": socket.gethostname()})
        except OSError as error:
            raise UsageError(str(self._shown), error.strerror or "cannot be written", "a folder to write to") from None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the folder in place, or keep or remove it."""
        if kind is None:
            self._publish()
        elif not self._is_kept(kind):
            shutil.rmtree(self.path, ignore_errors=True)
        elif error is not None:
            error.add_note(f"What was done is kept in {self._shown}.partial; --resume goes on from there.")

    def check(self) -> None:
        """Refuse now what would be refused on entering: before long work, that is.

        Raises
        ------
        UsageError
            If OUT exists and may not be replaced, or another process is writing it.
        """
        self._check_out()
        self._check_partial()

    @property
    def kept(self) -> Path | None:
        """Folder with what an interrupted run left; None if it left nothing."""
        return self.path if self.path.is_dir() else None

    def _is_kept(self, kind: type[BaseException]) -> bool:
        interrupted = issubclass(kind, KeyboardInterrupt)
        return bool(_files(self.path)) and (interrupted or self._keep or self._resume)

    def _check_out(self) -> None:
        if not self.out.exists():
            return
        if not (self._force or self._resume):
            raise UsageError(
                str(self._shown), "exists already", "a new folder", "Add --force to replace it, or name another --out."
            )
        if not self.out.is_dir():
            raise UsageError(str(self._shown), "is a file", "a folder", "Name another --out.")
        foreign = _foreign(self.out)
        if foreign:
            raise UsageError(
                str(self._shown),
                f'holds "{foreign[0]}", which is not part of a result',
                "a folder that holds a result only",
                "Nothing was removed. Move it, or name another --out.",
            )

    def _check_partial(self) -> None:
        if not self.path.exists():
            return
        marker = _read_marker(self.path)
        if marker is None:
            raise UsageError(str(self.path), "is in the way", "nothing of that name", "Move it, or name another --out.")
        pid = marker.get("pid")
        if pid != os.getpid() and marker.get("host") == socket.gethostname() and _runs(pid):
            raise UsageError(str(self._shown), f"is being written by process {pid}", "", "Wait for it, or end it.")

    def _publish(self) -> None:
        """Swap folders: each name is at any moment either the old whole or the new whole."""
        for file in _files(self.path):
            synchronise(self.path / file)
        _write_marker(self.path, {"files": _files(self.path)})
        synchronise(self.path / MARKER)
        replaced = self.out.with_name(f"{self.out.name}.replaced-{os.getpid()}")
        if self.out.exists():
            os.replace(self.out, replaced)
        os.replace(self.path, self.out)
        synchronise(self.out.parent)
        shutil.rmtree(replaced, ignore_errors=True)


def _files(folder: Path) -> list[str]:
    """Every file below `folder` but the marker, relative to it."""
    paths = (path for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())
    return sorted(path.relative_to(folder).as_posix() for path in paths if path != folder / MARKER)


def _foreign(folder: Path) -> list[str]:
    """Files in `folder` that we did not write; all of them if it is not marked as ours."""
    marker = _read_marker(folder) or {}
    return sorted(set(_files(folder)) - set(marker.get("files", [])))


def _write_marker(folder: Path, marker: dict[str, Any]) -> None:
    (folder / MARKER).write_text(json.dumps(marker, indent=1) + "\n", encoding="utf-8")


def _read_marker(folder: Path) -> dict[str, Any] | None:
    try:
        marker = json.loads((folder / MARKER).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return marker if isinstance(marker, dict) else None


def _runs(pid: Any) -> bool:
    """Whether a process runs; never so on Windows, where asking would end it."""
    if os.name == "nt" or not isinstance(pid, int):
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
