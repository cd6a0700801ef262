"""The folder of a result: one run at a time, it appears whole, replaces only what is ours, and can be resumed."""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import re
import stat
import threading
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from filelock import FileLock, Timeout

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import path_from, sha256_of, synchronise
from fibrefit.store import manifest
from fibrefit.store.manifest import MARKER, WORKING, Manifest, files_of, identity_of, read_manifest
from fibrefit.study import Study

COMMAND, STUDY, SETTINGS = "command", "study", "settings"
HOLDER = "process "
"""How the line begins that tells who holds a lock."""
HOLDER_SECONDS = 0.5
"""Seconds in which the holder of a lock has written who it is; a message to people waits for it no longer."""


@dataclass(frozen=True)
class Run:
    """What a run rests on.

    Parameters
    ----------
    inputs : tuple of pathlib.Path
        Every file it reads: none may lie in the folder of the result.
    parts : mapping of str to str
        The digest of everything that must be the same when the run goes on, by the name a message calls it.
    """

    inputs: tuple[Path, ...] = ()
    parts: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, command: str, study: Study, settings: str = "", files: Sequence[Path] = ()) -> Run:
        """Run of a command on a study.

        Parameters
        ----------
        command : str
            Its name.
        study : Study
            The study's own file may change in ways that mean nothing, such as a comment; what it says, its records and
            its laws may not.
        settings : str
            All else the run depends on.
        files : sequence of pathlib.Path
            Read beside those of the study, which may not change either.
        """
        texts = {STUDY: study.resolved_toml(), SETTINGS: settings}
        parts = {COMMAND: command} | {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
        read = (*study.data_files(), *files)
        # Named from the study, wherever the command was called.
        named = {path_from(study.source.parent, file): file for file in read if os.path.isfile(file)}
        digests = {f'data "{name}"': sha256_of(file) for name, file in named.items()}
        return cls((*study.input_files(), *files), parts | digests)

    def check(self, kept: Manifest | None, shown: str) -> None:
        """Refuse to go on from what another run has kept.

        Parameters
        ----------
        kept : Manifest or None
            Marker of the folder it would go on from.
        shown : str
            How messages call the folder.

        Raises
        ------
        UsageError
            Naming the first thing that is not the same.
        """
        if kept is None:
            return
        do = "Start anew, with --force in place of --resume, or go back to what the run was started with."
        if kept.run is None:
            raise UsageError(shown, "was begun by another version of the program", "a layout that is known", do)
        for name in dict.fromkeys([*self.parts, *kept.run]):
            then, now = kept.run.get(name), self.parts.get(name)
            if then != now:
                if name == COMMAND:
                    got = f"holds a run of {then}, not of {now}"
                elif then is None or now is None:
                    got = f"holds a run {'with' if now is None else 'without'} the {name}"
                elif name == SETTINGS:
                    got = f"holds a run with other {name}"
                else:
                    got = f"holds a run with another {name}: it has changed"
                raise UsageError(shown, got, "the same study, data and settings", do)


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
    with suppress(OSError):
        # What is locked is removed at the end: it has to be what a run has left.
        of_a_run = stat.S_ISREG(path.lstat().st_mode)
        if of_a_run:
            with path.open("rb") as file:
                of_a_run = HOLDER.encode().startswith(file.read(len(HOLDER)))
        if not of_a_run:
            expected = "nothing of that name, or the lock of a run"
            raise UsageError(str(path), "is in the way", expected, "Move it, or name another --out.")
    lock = FileLock(path, timeout=0, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout:
        if not path.exists():  # some file systems say "no such file" where they mean that none can be made
            raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(path)) from None
        # For an instant after the lock was taken the file does not say yet who holds it.
        holder, ends = "", time.monotonic() + HOLDER_SECONDS
        with suppress(OSError):
            while not (holder := path.read_text(encoding="utf-8", errors="replace")) and time.monotonic() <= ends:
                time.sleep(0.01)
        got = f"is being written by another run{f' ({holder[:200]})' if holder else ''}"
        do = "Wait for it, or name another --out."
        raise UsageError(shown, got, "a folder of its own for each run", do) from None
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
    digest = hashlib.sha256("\0".join(content).encode(errors="backslashreplace")).hexdigest()
    return parent / f"{slug}-{digest[:8]}"


_RESERVED: dict[tuple[Path, int], str | None] = {}
"""Identity of what stood in a folder when a thread of this process locked it: "" for an empty one, None for nothing.

What a thread has reserved, it may enter again, such as a command that saves what it has computed."""


class ResultDirectory:
    """Context in which a result is written to a folder beside OUT that takes OUT's place at the end.

    The folder is locked from entering to leaving. When the block ends well, OUT holds all of it; what others have put
    there in the meantime stays. When it is interrupted, what was written stays in ``OUT.partial``. When it fails,
    nothing stays, unless `keep` asks for it.

    Parameters
    ----------
    out : pathlib.Path
        Folder of the result; a link is followed, and stays.
    force : bool
        Replace an earlier result.
    resume : bool
        Go on from an interrupted or finished run.
    keep : bool
        Keep what was written when the run fails or is killed, so that it can be resumed.
    run : Run, optional
        What the result rests on: none of its files may lie in OUT, and it goes on only from the same.

    Attributes
    ----------
    out : pathlib.Path
        Where the result stands at the end.
    path : pathlib.Path
        Folder to write to, inside the block.
    previous : pathlib.Path or None
        Folder with the files of the run that is resumed.

    Raises
    ------
    UsageError
        On entering, if OUT cannot be written or may not be replaced, another run is writing it, or what is to be
        resumed was another run. On leaving, if the disk is full, or something else has come to stand at OUT: the
        result then stands beside it.
    """

    def __init__(
        self, out: Path, *, force: bool = False, resume: bool = False, keep: bool = False, run: Run | None = None
    ) -> None:
        self._shown, self._run = out, run or Run()
        self.out = _place(out, self._run.inputs)
        self.path = manifest.partial_of(self.out)
        self.previous: Path | None = None
        self._force, self._resume, self._keep = force, resume, keep
        self._stack = ExitStack()
        self._known: str | None = None

    def __enter__(self) -> Self:
        """Make the folder to write to, unless something forbids it."""
        with ExitStack() as stack:
            self._known = stack.enter_context(self._reserved())
            self._begin()
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the folder in place, or keep or remove it."""
        with self._stack:
            try:
                if error is None:
                    self._publish()
                    return
            except OSError as failed:
                error = failed
            goes_on = self._keep or self._resume
            if (goes_on or isinstance(error, KeyboardInterrupt)) and files_of(self.path):
                partial = f"{self.out if self._shown.is_symlink() else self._shown}.partial"
                then = "; --resume goes on from there" if goes_on else ", until the same is asked for again"
                error.add_note(f"What was done is kept in {partial}{then}.")
            elif self.path.is_dir():
                manifest.clear(self.path)
            if isinstance(error, OSError) and error.errno in _DISK:
                # One of the result could not be written, unless it is one that was read and lies elsewhere.
                place = None if error.filename is None else Path(os.path.abspath(os.fsdecode(error.filename)))
                if place is None or {self.out, self.path} & {place, *place.parents}:
                    raise self._refused(error) from error
            if kind is None:
                raise error

    def check(self) -> None:
        """Refuse now what would be refused on entering: before long work, that is.

        Raises
        ------
        UsageError
            As on entering.
        """
        with self._reserved():
            pass

    @contextmanager
    def reserved(self) -> Iterator[Path]:
        """Block in which nobody else writes to OUT: for long work whose result is saved within it.

        Yields
        ------
        pathlib.Path
            OUT, as it was named.

        Raises
        ------
        UsageError
            As on entering.
        """
        with self._reserved():
            # It cannot be written where this fails; better now than after the work.
            self._begin()
            try:
                yield self._shown
            finally:
                if self.path.is_dir() and not files_of(self.path):
                    manifest.clear(self.path)

    @property
    def kept(self) -> Path | None:
        """Folder with what an interrupted run left; None if it left nothing."""
        return self.path if self.path.is_dir() else None

    @contextmanager
    def _reserved(self) -> Iterator[str | None]:
        """The lock, and what stands at OUT while it is held."""
        place = self.out, threading.get_ident()
        if place in _RESERVED:
            yield _RESERVED[place]
            return
        with ExitStack() as stack:
            try:
                self.out.parent.mkdir(parents=True, exist_ok=True)
                stack.enter_context(locked(self.out, str(self._shown)))
                manifest.recover(self.out)
            except OSError as error:
                raise self._refused(error) from None
            self._check_out()
            self._check_partial()
            _RESERVED[place] = identity_of(self.out)
            stack.callback(_RESERVED.pop, place)
            yield _RESERVED[place]

    def _begin(self) -> None:
        """An empty folder to write to, or the one that is gone on with."""
        try:
            if self._resume:
                self.previous = next((folder for folder in (self.path, self.out) if folder.is_dir()), None)
            elif self.path.exists() and (others := manifest.clear(self.path)):
                what = f'holds "{others[0]}", which is not part of a result'
                raise UsageError(str(self.path), what, "a folder of the program's own", "Nothing of it was removed.")
            self.path.mkdir(exist_ok=True)
            manifest.write_manifest(self.path, {"run": dict(self._run.parts), "keep": self._keep})
        except OSError as error:
            raise self._refused(error) from None

    def _publish(self) -> None:
        """Put the folder in place: at any moment OUT is either the old whole or the new whole."""
        content = {"identity": uuid.uuid4().hex, "replaces": self._known, "run": dict(self._run.parts)}
        for file in files_of(self.path):
            synchronise(self.path / file)
        manifest.write_manifest(self.path, content | manifest.listing(self.path))
        stands = manifest.put_in_place(self.path, self.out, self._known)
        synchronise(self.out.parent)
        if stands != self.out:
            shown, self.out = self._shown, stands
            got = "was made by somebody else during the run, and was left alone"
            raise UsageError(str(shown), got, do=f"The result is complete in {stands}.")

    def _check_out(self) -> None:
        if not os.path.lexists(self.out):
            return
        if not self.out.is_dir():
            raise UsageError(str(self._shown), "is a file", "a folder", "Name another --out.")
        if others := manifest.foreign(self.out):
            got = f'holds "{others[0]}", which is not part of a result'
            do = "Nothing was removed. Move it, or name another --out."
            raise UsageError(str(self._shown), got, "a folder that holds a result only", do)
        if not (self._force or self._resume):
            there = read_manifest(self.out)
            same = self._keep and there is not None and there.run == self._run.parts
            do = "Add --resume to go on with it, --force to replace it," if same else "Add --force to replace it,"
            raise UsageError(str(self._shown), "exists already", "a new folder", f"{do} or name another --out.")

    def _check_partial(self) -> None:
        left = read_manifest(self.path)
        if left is None and os.path.lexists(self.path):
            # A run that was killed at its very beginning leaves at most a half-written marker.
            begun = self.path.is_dir() and all(path.match(f".{MARKER}.*.tmp") for path in self.path.iterdir())
            if not begun:
                do = "Move it, or name another --out."
                raise UsageError(str(self.path), "is in the way", "nothing of that name", do)
        if self._resume:
            if self._run.parts:
                self._run.check(left or read_manifest(self.out), str(self._shown))
            return
        if left and left.kept and not self._force and files_of(self.path):
            got, do = "holds a run that was cut short", "Add --resume to go on, or --force to begin anew."
            raise UsageError(str(self._shown), got, "a new folder, or to go on with it", do)

    def _refused(self, error: OSError) -> UsageError:
        why = error.strerror or "cannot be written"
        if error.errno in _FULL:
            do = "Make room and start again." + (" The earlier result is untouched." if self._known else "")
            refused = UsageError(str(self._shown), f"cannot be written: {why}", "room for the result", do)
        else:
            refused = UsageError(str(self._shown), f"cannot be written: {why}", "a folder to write to")
        for note in getattr(error, "__notes__", ()):
            refused.do = f"{refused.do} {note}".strip()
        return refused


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_DISK = (*_FULL, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO, errno.ENAMETOOLONG)


def _place(out: Path, inputs: tuple[Path, ...]) -> Path:
    """Absolute place of a result, links followed.

    Raises
    ------
    UsageError
        If no result can stand there.
    """
    real, own = Path(os.path.realpath(out)), "a folder of its own for the result"
    if os.path.islink(out) and not os.path.lexists(real):
        raise UsageError(str(out), f"is a link to {real}, which does not exist", "a folder", "Name another --out.")
    if real.name and not real.name.strip():
        # A variable with nothing but blanks in it leaves such a word on a command line.
        raise UsageError(repr(str(out)), "is nothing but blanks", "the name of a folder", "Name another --out.")
    if real.suffix in WORKING:
        what = f"ends in {real.suffix}, as working folders do, which a run moves and removes"
        raise UsageError(str(out), what, own, "Name another --out.")
    here = Path(os.path.realpath(os.curdir))
    if real == here or real in here.parents:
        what = "is the working folder" if real == here else "holds the working folder"
        raise UsageError(str(out), what, own, "Name another --out.")
    if os.path.ismount(real):
        raise UsageError(str(out), "is the root of a file system", "a folder", "Name a folder in it.")
    for file in inputs:
        if real in Path(os.path.realpath(file)).parents:
            raise UsageError(str(out), f"holds {file}, which is read", own, "Name another --out.")
    return real
