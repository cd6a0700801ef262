"""Files: read where they are plain ones, written whole or not at all, printable names; formats of figures."""

from __future__ import annotations

import hashlib
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from fibrefit.core import limits
from fibrefit.core.errors import DataError, FibrefitError, UsageError, did_you_mean
from fibrefit.core.formatting import printable

_LONGEST = 260
LONGEST_STEM, _MOST_BYTES = 80, 200
"""Letters and bytes of a name, which leave room for a number, an ending and what it is called while it is written."""
_REFUSED = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')
"""Signs that a file system may refuse."""
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{i}" for port in ("com", "lpt") for i in range(1, 10))}
"""Names that mean a device, not a file, on some systems, whatever their ending."""
_LONGEST_END = 7
"""Letters of the end of a file's name, such as ``parquet``."""
FORMATS = ("png", "pdf", "svg")
"""Kinds of files that figures can be written as."""
NONE = "none"

FIGURES: ContextVar[tuple[str, ...] | None] = ContextVar("FIGURES", default=None)
"""Those requested; none at all is possible too. None: nothing was requested, and a result draws what shows it best."""


def shown_path(path: str | Path) -> str:
    """Path for messages: in signs that can be printed, and not without end."""
    text = printable(str(path))
    return text if len(text) <= _LONGEST else f"{text[:100]}...{text[-100:]}"


def nearest_file(path: Path, end: str = "") -> str:
    """Sentence that suggests a file of nearly the same name in the same folder; empty where there is none.

    Parameters
    ----------
    path : Path
        Of a file that is not there.
    end : str
        What the names of those that are meant end with.
    """
    try:
        names = os.listdir(path.parent)
    except (OSError, ValueError):
        return ""
    return did_you_mean(path.name, [printable(name) for name in names if name.endswith(end)])


def read_plain_file(path: Path, what: str, error: type[FibrefitError], do: str = "", most: int | None = None) -> bytes:
    """Content of a file.

    Parameters
    ----------
    path : Path
        A file; a pipe or a device, which may never end, is refused.
    what : str
        What is expected, for messages.
    error : type
        Class of the error.
    do : str
        What the message tells a person to do where there is no such file.
    most : int, optional
        Bytes it may have; `limits.LARGEST` by default.

    Raises
    ------
    FibrefitError
        Of class `error`, if it cannot be read.
    """
    where = shown_path(path)
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise error(where, "a device or a pipe", what, "Save its content to a file first.")
        size, most = path.stat().st_size, most or limits.LARGEST
        if size > most:
            raise error(where, f"{size / 1e6:,.0f} MB", f"{what} of {most / 1e6:,.0f} MB at most", "")
        with open(path, "rb", opener=_at_once) as file:
            content = file.read(most + 1)
        if content is None or len(content) > most:
            raise error(where, "a file that grows, or never ends", what, "Copy it first.")
        return content
    except FileNotFoundError:
        raise error(where, "no such file", what, do) from None
    except OSError as refused:
        raise error(where, refused.strerror or "cannot be read", what) from None
    except ValueError:
        raise error(where, "a name with a NUL, which no file has", what) from None


def _at_once(path: str, flags: int) -> int:
    """Open a file without waiting for anybody to write to it: files of the system may look like plain ones."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    found = hashlib.sha256()
    try:
        with open(path, "rb", opener=_at_once) as file:
            # Not by `hashlib.file_digest`: it asks a file that has nothing to say for ever.
            while part := file.read(1 << 20):
                found.update(part)
    except OSError as refused:
        do = "Look at its permissions, and whether its disk is there."
        raise DataError(shown_path(path), refused.strerror or "cannot be read", "a file that can be read", do) from None
    return found.hexdigest()


def path_from(folder: Path, file: Path) -> str:
    """Path of a file as it is named from a folder, with forward slashes; whole where another drive leaves no way.

    Links are taken as they stand.
    """
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return file.absolute().as_posix()


def refuse_no_text(files: Iterable[Path], folder: Path) -> None:
    """Refuse files of which a text in a folder cannot tell the names: a study written there would be none.

    Raises
    ------
    UsageError
        Naming the first.
    """
    for file in files:
        try:
            path_from(folder, file).encode("utf-8")
        except UnicodeEncodeError:
            got = "a name that is no text in UTF-8, in which a result names what it rests on"
            raise UsageError(shown_path(file), got, "names of files and folders in UTF-8", "Rename it.") from None


def name_of_several(files: Sequence[str | Path]) -> str:
    """Name of what belongs to some files: that of the first, and how many more there are; empty for none."""
    first = Path(files[0]).stem if files else ""
    return f"{first} and {len(files) - 1} more" if files[1:] else first


def without_end(name: str) -> str:
    """The name that a person would guess: ``record_drop_5mm.png``, not ``record_drop_5mm_csv.png``."""
    stem, _, end = name.rpartition(".")
    return stem if stem and end.isalnum() and len(end) <= _LONGEST_END and not end.isdigit() else name


def record_stems(names: Sequence[str]) -> list[str]:
    """Name of the file of each record, without its ending; no two alike, even where capitals do not count.

    Parameters
    ----------
    names : sequence of str
        Of the records: their files, as a study names them, or what it calls them.

    Returns
    -------
    list of str
        The last part of each name, without the ending of a file; the whole of it where another record has the same last
        part, and a number behind it where that is the same too. Signs that a file system may refuse are replaced.
    """
    ends = [without_end(Path(name).name) for name in names]
    common = Counter(end.casefold() for end in ends)
    whole = (without_end(name) if common[end.casefold()] > 1 else end for name, end in zip(names, ends, strict=True))
    return numbered_stems(safe_stem(stem.strip(".")) or "record" for stem in whole)


def safe_stem(name: str) -> str:
    """The name of a file, without its ending, that any file system takes: without some signs, not too long, no device.

    Empty where nothing is left.
    """
    short = _REFUSED.sub("_", name)[:LONGEST_STEM].encode(errors="ignore")[:_MOST_BYTES]
    stem = short.decode(errors="ignore")
    first, dot, rest = stem.partition(".")
    return f"{first}_{dot}{rest}" if first.rstrip().casefold() in _DEVICES else stem


def numbered_stems(stems: Iterable[str]) -> list[str]:
    """Names with a number behind those that an earlier one is like, where case does not count."""
    taken: set[str] = set()
    found = []
    for first in stems:
        stem, number = first, 2
        while stem.casefold() in taken:
            stem, number = f"{first}_{number}", number + 1
        taken.add(stem.casefold())
        found.append(stem)
    return found


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Temporary name beside `path` that takes its place when the block ends well.

    Parameters
    ----------
    path : pathlib.Path
        File to write; an old one stays as it is until the new one is complete on disk.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        synchronise(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes) -> None:
    """Write `content` to `path`; text as UTF-8, what that lacks as escapes.

    Parameters
    ----------
    path : pathlib.Path
        File to write or replace.
    content : str or bytes
        All of it.
    """
    with whole(path) as temporary:
        temporary.write_bytes(content.encode(errors="backslashreplace") if isinstance(content, str) else content)


def synchronise(path: Path) -> None:
    """Wait until a file, or the names in a folder, have reached the disk."""
    if path.is_dir() and os.name == "nt":
        return  # Windows opens no folders
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def requested_formats() -> tuple[str, ...]:
    """Formats to write figures as: PNG unless others, or none, were requested."""
    requested = FIGURES.get()
    return ("png",) if requested is None else requested


def figure_formats(text: str) -> tuple[str, ...]:
    """Formats from a list with commas, such as ``pdf,svg``; ``none`` for no figures.

    Raises
    ------
    UsageError
        If one is not known.
    """
    requested: Sequence[str] = [word.strip().lower() for word in text.split(",") if word.strip()]
    if list(requested) == [NONE]:
        return ()
    for word in requested or [text]:
        if word not in FORMATS:
            expected = f"{', '.join(FORMATS)}, separated by commas, or {NONE}"
            raise UsageError("--figures", word or "nothing", expected, did_you_mean(word, FORMATS))
    return tuple(dict.fromkeys(requested))
