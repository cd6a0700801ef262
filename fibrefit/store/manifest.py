"""What stands in a result's folder: the files listed in its marker, and those of others; how it takes another's place.

A finished folder takes the place of another in one step, and what is not ours is carried over.
"""

from __future__ import annotations

import ctypes
import errno
import hashlib
import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from fibrefit.core.errors import UsageError
from fibrefit.core.limits import LARGEST_STUDY
from fibrefit.core.paths import read_plain_file, write_whole

#: File that tells a folder of ours from any other, and lists what we wrote into it.
MARKER = ".fibrefit"

#: Version of the layout of a result's folder, and of what a run goes on from.
LAYOUT = 2

KINDS = frozenset((
    "", ".csv", ".h5", ".html", ".job", ".json", ".npz", ".parquet", ".pdf", ".png", ".py", ".svg", ".toml",
    ".tmp", ".copy",
))  # fmt: skip
"""Endings of the files that results are made of, half-written ones last: nothing else is removed from a working folder.
"""
INSPECTION_TEXT = "inspection.txt"
NO_REPLACE, EXCHANGE = 1, 2
PARTIAL, REPLACED = WORKING = (".partial", ".replaced")
"""What is added to the name of a result for the folder it is made in, and for the one it takes the place of."""
_CANNOT = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP)


@dataclass(frozen=True)
class Manifest:
    """Content of a marker.

    Parameters
    ----------
    identity : str
        Tells this result from any other.
    files, folders : list and set of str
        Of the result, relative to its folder; none while it is being made.
    complete : bool
        Whether all of the result is there.
    replaces : str or None
        Identity of the result it is to take the place of.
    run : mapping of str to str, or None
        What the run rests on, by name; None where it is not known.
    kept : bool
        Whether a run that is cut short is to be gone on with.
    """

    identity: str
    files: list[str]
    folders: set[str]
    complete: bool
    replaces: str | None
    run: Mapping[str, str] | None
    kept: bool


def read_manifest(folder: Path) -> Manifest | None:
    """Marker of a folder; None where it has none of ours, and of a link, which somebody else has made."""
    if folder.is_symlink():
        return None
    try:
        text = read_plain_file(folder / MARKER, "the marker of a result", UsageError, most=LARGEST_STUDY)
        content = json.loads(text)
    except (UsageError, ValueError, RecursionError):
        return None
    if not isinstance(content, dict):
        return None

    def listed(what: str) -> list[str]:
        # What is listed is removed, and a marker may come from anybody: names have to stay below the folder.
        names = content.get(what)
        texts = [name for name in names if isinstance(name, str)] if isinstance(names, list) else []
        plain = [name for name in texts if name and "\0" not in name]
        return [name for name in plain if not Path(name).anchor and ".." not in Path(name).parts]

    files, run = listed("files"), content.get("run") if content.get("layout") == LAYOUT else None
    above = {parent.as_posix() for file in files for parent in Path(file).parents}
    return Manifest(
        str(content.get("identity") or hashlib.sha256(text).hexdigest()),
        files,
        {*listed("folders"), *above} - {"."},
        "files" in content,
        content.get("replaces"),
        run if isinstance(run, dict) else None,
        bool(content.get("keep")),
    )


def write_manifest(folder: Path, content: Mapping[str, Any]) -> None:
    """Write the marker of a folder, whole."""
    about = "Written by fibrefit, which may remove what is listed here."
    write_whole(folder / MARKER, json.dumps({"about": about, "layout": LAYOUT, **content}, indent=1) + "\n")


def listing(folder: Path) -> dict[str, list[str]]:
    """Files and folders of a result that is complete, as its marker lists them."""
    parts = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if _is_folder(path)]
    return {"files": [name for name in files_of(folder) if is_of_result(name)], "folders": sorted(parts)}


def files_of(folder: Path) -> list[str]:
    """Every file below `folder` but the marker, relative to it."""
    paths = (path for path in folder.rglob("*") if not _is_folder(path))
    return sorted(path.relative_to(folder).as_posix() for path in paths if path != folder / MARKER)


def is_of_result(name: str) -> bool:
    """Whether a file is of a kind that results are made of."""
    return Path(name).suffix.lower() in KINDS or name == INSPECTION_TEXT


def foreign(folder: Path) -> list[str]:
    """What is in a result's folder and not of the result; all of it if the folder is not marked as ours."""
    known = read_manifest(folder)
    files, folders = (known.files, known.folders) if known else ([], set())
    others = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if _is_folder(path)} - folders
    # A folder that holds files is known by them.
    empty = {name for name in others if not any((folder / name).iterdir())}
    return sorted((set(files_of(folder)) - set(files)) | empty)


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def identity_of(folder: Path) -> str | None:
    """Identity of the result in a folder; "" for one without a marker, None where there is no folder."""
    known = read_manifest(folder)
    return known.identity if known else "" if folder.is_dir() else None


def partial_of(out: Path) -> Path:
    """Folder in which the result that is to stand at `out` is made."""
    return out.with_name(f"{out.name}{PARTIAL}")


def put_in_place(partial: Path, out: Path, known: str | None) -> Path:
    """Put a complete folder where its result belongs.

    A kill at any moment leaves the earlier result or the new one there. (Where the file system cannot exchange two
    folders in one step, there is an instant without either; `recover` puts it right.) What has come into `out` in the
    meantime stays: files beside those of the earlier result are carried over, a folder of somebody else is not touched.

    Parameters
    ----------
    partial, out : pathlib.Path
        Side by side.
    known : str or None
        Identity of the result that is to be replaced, "" for an empty folder; None where there was nothing.

    Returns
    -------
    pathlib.Path
        Where it stands now: `out`, or a name beside it where something else has come to stand there.
    """
    if known is not None and identity_of(out) == known:
        _replace(partial, out)
        return out
    try:
        _move(partial, out)
    except OSError:
        if not os.path.lexists(out):
            raise
        return _set_aside(partial, out)
    return out


def recover(out: Path) -> None:
    """Finish what a run was doing when it was killed while it put its result in place."""
    partial, replaced = partial_of(out), out.with_name(f"{out.name}{REPLACED}")
    made, there = read_manifest(partial), read_manifest(out)
    if made is not None and made.complete:
        if not os.path.lexists(out):
            _move(partial, out)
        elif there is not None and there.replaces == made.identity:
            tidy_away(partial, out)
        elif there is not None and made.replaces == there.identity:
            _replace(partial, out)
        else:
            _set_aside(partial, out)
    if read_manifest(replaced) is not None:
        if os.path.lexists(out):
            tidy_away(replaced, out)
        else:
            _move(replaced, out)


def tidy_away(old: Path, home: Path) -> None:
    """Remove what the marker of `old` lists; what others put there goes to `home`, or stays where its name is taken."""
    known = read_manifest(old)
    if known is not None:
        _remove(old, known.files, known.folders)
    left = foreign(old)
    for name in left:
        # The outermost first: what is in it goes with it.
        if not any(name.startswith(f"{other}/") for other in left):
            with suppress(OSError):
                (home / name).parent.mkdir(parents=True, exist_ok=True)
                _move(old / name, home / name)
    # Folders that held nothing but what was carried over.
    _remove(old, [], {path.relative_to(old).as_posix() for path in old.rglob("*") if path.is_dir()})
    _remove_if_empty(old)
    if old.exists():
        (old / MARKER).unlink(missing_ok=True)
        _move(old, _free(home.with_name(f"{home.name}.left")))


def clear(partial: Path) -> list[str]:
    """Remove what a run has left in its folder, and the folder; what is not of a result stays, and is named."""
    names = files_of(partial)
    folders = {path.relative_to(partial).as_posix() for path in partial.rglob("*") if path.is_dir()}
    _remove(partial, [name for name in names if is_of_result(name)], folders)
    _remove_if_empty(partial)
    return [name for name in names if not is_of_result(name)]


def _replace(partial: Path, out: Path) -> None:
    if _rename(partial, out, EXCHANGE):
        tidy_away(partial, out)
        return
    replaced = out.with_name(f"{out.name}{REPLACED}")
    os.rename(out, replaced)
    os.rename(partial, out)
    tidy_away(replaced, out)


def _set_aside(partial: Path, out: Path) -> Path:
    while True:
        target = _free(out)
        with suppress(FileExistsError):
            _move(partial, target)
            return target


def _free(path: Path) -> Path:
    """The name itself, or the first numbered one, that nothing has."""
    names = (path if n == 1 else path.with_name(f"{path.name}-{n}") for n in count(1))
    return next(name for name in names if not os.path.lexists(name))


def _remove(folder: Path, files: list[str], folders: set[str]) -> None:
    """Remove files and empty folders; a folder that somebody has put a link in the place of is not gone into."""
    for name in files:
        with suppress(FileNotFoundError, NotADirectoryError, IsADirectoryError):
            if not _behind_a_link(folder, name):
                (folder / name).unlink()
    for name in sorted(folders, reverse=True):
        with suppress(OSError):
            if not _behind_a_link(folder, name):
                (folder / name).rmdir()  # refuses what is not empty


def _behind_a_link(folder: Path, name: str) -> bool:
    return any((folder / above).is_symlink() for above in Path(name).parents if above.parts)


def _remove_if_empty(folder: Path) -> None:
    if all(path.name == MARKER for path in folder.iterdir()):
        (folder / MARKER).unlink(missing_ok=True)
        with suppress(OSError):
            folder.rmdir()


def _move(source: Path, target: Path) -> None:
    """Rename, and replace nothing.

    Raises
    ------
    FileExistsError
        If the target exists.
    """
    if _rename(source, target, NO_REPLACE):
        return
    if os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
    os.rename(source, target)


def _rename(source: Path, target: Path, flag: int) -> bool:
    """Rename in the way requested; False where system or file system know no such way."""
    names = os.fsencode(source), os.fsencode(target)
    try:
        library = ctypes.CDLL(None, use_errno=True)
        if sys.platform == "darwin":
            failed = library.renamex_np(*names, ctypes.c_uint({NO_REPLACE: 4, EXCHANGE: 2}[flag]))
        else:
            here = ctypes.c_int(-100)  # AT_FDCWD
            failed = library.renameat2(here, names[0], here, names[1], ctypes.c_uint(flag))
    except (AttributeError, OSError, TypeError):
        return False
    if not failed:
        return True
    code = ctypes.get_errno()
    if code in _CANNOT:
        return False
    raise OSError(code, os.strerror(code), str(source), None, str(target))
