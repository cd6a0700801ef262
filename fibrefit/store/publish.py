"""A finished folder takes the place of another in one step, and what is not ours is carried over."""

from __future__ import annotations

import ctypes
import errno
import os
import sys
from contextlib import suppress
from itertools import count
from pathlib import Path

from fibrefit.store.manifest import MARKER, files_of, foreign, is_of_result, read_manifest

NO_REPLACE, EXCHANGE = 1, 2
PARTIAL, REPLACED = WORKING = (".partial", ".replaced")
"""What is added to the name of a result for the folder it is made in, and for the one it takes the place of."""
_CANNOT = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP)


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
    there = read_manifest(out)
    same = known is not None and out.is_dir() and (there.identity if there else "") == known
    if same:
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
    partial, replaced = partial_of(out), _replaced(out)
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
    for name in foreign_but_marker(old):
        _carry(old / name, home / name)
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


def foreign_but_marker(old: Path) -> list[str]:
    """What is left in a folder whose own files are gone, the outermost first."""
    left = foreign(old)
    return [name for name in left if not any(name.startswith(f"{other}/") for other in left)]


def _replace(partial: Path, out: Path) -> None:
    if _rename(partial, out, EXCHANGE):
        tidy_away(partial, out)
        return
    replaced = _replaced(out)
    os.rename(out, replaced)
    os.rename(partial, out)
    tidy_away(replaced, out)


def _replaced(out: Path) -> Path:
    return out.with_name(f"{out.name}{REPLACED}")


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


def _carry(path: Path, target: Path) -> None:
    with suppress(OSError):
        target.parent.mkdir(parents=True, exist_ok=True)
        _move(path, target)


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
