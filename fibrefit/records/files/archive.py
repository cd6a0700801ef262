"""Compressed files and archives: the one measurement file inside."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import IO, Any, NamedTuple

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.files.decode import decode
from fibrefit.records.files.extras import damage_of
from fibrefit.records.grammar.dialect import vote
from fibrefit.records.thresholds import FEWEST_ROWS

_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
_EMPTY_ZIP = b"PK\x05\x06"
#: How compressed files begin, what opens them, and how their names end.
_COMPRESSED: tuple[tuple[bytes, Callable[[IO[bytes]], Any], str], ...] = (
    (_GZIP, lambda file: gzip.GzipFile(fileobj=file), ".gz"),
    (b"BZh", bz2.BZ2File, ".bz2"),
    (b"\xfd7zXZ\x00", lzma.LZMAFile, ".xz"),
)
#: Where a tar archive says that it is one.
_TAR, _TAR_PLACE = b"ustar", 257

#: Bytes unpacked at a time where they are only counted.
_PART = 1 << 20

#: How measurements begin that are no text; a spreadsheet is an archive.
_BINARY = (b"TDSm", b"PAR1", b"MDF", b"UnFinM", b"MATLAB", b"\x89HDF", b"\x93NUMPY", _GZIP, _ZIP)
#: What archives are that are documents of an office program, by one of their members.
_DOCUMENTS = {
    "content.xml": ("an OpenDocument file", "Save the sheet as .xlsx or as CSV."),
    "xl/workbook.bin": ("a binary workbook (.xlsb)", "Save it as .xlsx, or the sheet as CSV."),
    "word/document.xml": ("a text document", "Copy its table into a sheet, and save that as CSV."),
}

#: What the libraries raise of archives that are damaged.
_DAMAGE = (
    OSError,
    EOFError,
    zlib.error,
    lzma.LZMAError,
    tarfile.TarError,
    zipfile.BadZipFile,
    RuntimeError,
    NotImplementedError,
    ValueError,
)


class _Member(NamedTuple):
    """A file of an archive: its name, its size, and what reads it."""

    name: str
    size: int
    read: Callable[[], bytes]


def unpacked(data: bytes, name: str, where: str) -> tuple[bytes, str]:
    """Content and name of what a packed file holds; the file itself where it is not packed.

    Parameters
    ----------
    data : bytes
        The whole file.
    name : str
        Its name.
    where : str
        File to name in messages.

    Returns
    -------
    tuple of bytes and str
        Content, and a name whose ending tells the format.

    Raises
    ------
    DataError
        If it is damaged, holds nothing, several files, or more than a record can be; nothing is kept of that.
    """
    try:
        for start, opened, ending in _COMPRESSED:
            if data.startswith(start):
                with opened(io.BytesIO(data)) as file:
                    _count(file, Allowance(where, DataError))
                    file.seek(0)
                    data, name = file.read(), name.removesuffix(ending)
                return _from_tar(data, where) if _is_tar(data) else _once(data, name, where)
        if _is_tar(data):
            return _from_tar(data, where)
        if data.startswith((_ZIP, _EMPTY_ZIP)):
            return _from_zip(data, name, where)
    except _DAMAGE as error:
        damage = damage_of(error)
        raise DataError(where, f"the archive is damaged ({damage})", "a complete file", "Copy it again.") from None
    return data, name


def _count(file: IO[bytes], allowed: Allowance) -> None:
    """Go through a file without keeping it: what is compressed does not say beforehand what it holds."""
    while part := file.read(_PART):
        allowed.take(len(part))


def _is_tar(data: bytes) -> bool:
    return data[_TAR_PLACE : _TAR_PLACE + len(_TAR)] == _TAR


def _from_tar(data: bytes, where: str) -> tuple[bytes, str]:
    with tarfile.open(fileobj=io.BytesIO(data), mode="r:") as archive:
        return _measured(
            [
                _Member(entry.name, entry.size, partial(_content, archive, entry))
                for entry in _entries(archive)
                if entry.isfile()
            ],
            where,
        )


def _entries(archive: tarfile.TarFile) -> Iterator[tarfile.TarInfo]:
    """Members of an archive; one of less than nothing would be read again and again."""
    for entry in archive:
        if entry.size < 0:
            raise tarfile.ReadError("a member of a negative size")
        yield entry


def _content(archive: tarfile.TarFile, entry: tarfile.TarInfo) -> bytes:
    file = archive.extractfile(entry)
    return b"" if file is None else file.read()


def _from_zip(data: bytes, name: str, where: str) -> tuple[bytes, str]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        names = {entry.filename for entry in entries}
        for member, (what, do) in _DOCUMENTS.items():
            if member in names and names & {"mimetype", "[Content_Types].xml"}:
                raise DataError(where, what, "a table of measured values", do)
        if "[Content_Types].xml" in names or (names and all(one.endswith(".npy") for one in names)):
            ending = ".xlsx" if "[Content_Types].xml" in names else ".npz"
            Allowance(where, DataError).take(sum(entry.file_size for entry in entries))
            return data, name if name.casefold().endswith(ending) else f"{name}{ending}"
        return _measured(
            [_Member(entry.filename, entry.file_size, partial(archive.read, entry)) for entry in entries], where
        )


def _measured(members: Iterable[_Member], where: str) -> tuple[bytes, str]:
    """The one of the files of an archive that holds measured values."""
    files = [one for one in members if not one.name.startswith("__MACOSX/")]
    if len(files) > 1:
        Allowance(where, DataError).take(sum(one.size for one in files))
    measured = [one for one in files if len(files) == 1 or _may_be_measured(one.read())]
    if len(measured) != 1:
        names = ", ".join(one.name[:60] for one in (measured or files)[:5]) or "nothing"
        do = "Unpack it, and name the file that is meant."
        got = f"an archive that holds {len(measured)} measurement files ({names})"
        raise DataError(where, got, "one measurement file", do)
    Allowance(where, DataError).take(measured[0].size)
    return _once(measured[0].read(), measured[0].name, where)


def _may_be_measured(content: bytes) -> bool:
    """Whether a file begins as a measurement, or has enough lines of numbers: pictures, logs and notes have none."""
    if content.startswith(_BINARY):
        return True
    try:
        lines = [line for line in decode(content, "").lines if line.strip()]
    except DataError:
        return False
    return len(lines) > FEWEST_ROWS and vote(lines) is not None


def _once(content: bytes, name: str, where: str) -> tuple[bytes, str]:
    """Refuse what is packed again, and would be taken for a text; a spreadsheet is a packed file by itself."""
    packed = content.startswith((_ZIP, _EMPTY_ZIP, *(start for start, *_ in _COMPRESSED))) or _is_tar(content)
    if packed and not name.casefold().endswith((".xlsx", ".xlsm")):
        got = f"an archive in an archive ({name[:60]})"
        raise DataError(where, got, "one measurement file in it", "Unpack it, and name the file that is meant.")
    return content, name
