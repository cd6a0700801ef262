"""Compressed files and archives: the one measurement file inside."""

from __future__ import annotations

import gzip
import io
import zipfile
import zlib

from fibrefit.core.allowance import Allowance
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import decode
from fibrefit.records.files.extras import damage_of
from fibrefit.records.grammar.dialect import vote
from fibrefit.records.thresholds import FEWEST_ROWS

_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
_EMPTY_ZIP = b"PK\x05\x06"

#: Bytes unpacked at a time where they are only counted.
_PART = 1 << 20

#: How measurements begin that are no text; a spreadsheet is an archive.
_BINARY = (b"TDSm", b"PAR1", b"MDF", b"UnFinM", b"MATLAB", b"\x89HDF", _GZIP, _ZIP)


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
        if data.startswith(_GZIP):
            with gzip.open(io.BytesIO(data)) as file:
                _count(file, Allowance(where, DataError))
                file.seek(0)
                return _once(file.read(), name.removesuffix(".gz"), where)
        if data.startswith((_ZIP, _EMPTY_ZIP)):
            return _from_zip(data, name, where)
    except (OSError, EOFError, zlib.error, zipfile.BadZipFile, RuntimeError, NotImplementedError, ValueError) as error:
        damage = damage_of(error)
        raise DataError(where, f"the archive is damaged ({damage})", "a complete file", "Copy it again.") from None
    return data, name


def _count(file: gzip.GzipFile, allowed: Allowance) -> None:
    """Go through a file without keeping it: gzip does not say beforehand what it holds."""
    while part := file.read(_PART):
        allowed.take(len(part))


def _from_zip(data: bytes, name: str, where: str) -> tuple[bytes, str]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        if any(entry.filename == "[Content_Types].xml" for entry in entries):
            Allowance(where, DataError).take(sum(entry.file_size for entry in entries))
            return data, name if name.casefold().endswith(".xlsx") else f"{name}.xlsx"
        files = [entry for entry in entries if not entry.filename.startswith("__MACOSX/")]
        if len(files) > 1:
            Allowance(where, DataError).take(sum(entry.file_size for entry in files))
        measured = [entry for entry in files if len(files) == 1 or _may_be_measured(archive.read(entry))]
        if len(measured) != 1:
            names = ", ".join(entry.filename[:60] for entry in files[:5]) or "nothing"
            do = "Unpack it, and name the file that is meant."
            got = f"an archive that holds {len(measured)} measurement files ({names})"
            raise DataError(where, got, "one measurement file", do)
        Allowance(where, DataError).take(measured[0].file_size)
        return _once(archive.read(measured[0]), measured[0].filename, where)


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
    if content.startswith((_GZIP, _ZIP, _EMPTY_ZIP)) and not name.casefold().endswith((".xlsx", ".xlsm")):
        got = f"an archive in an archive ({name[:60]})"
        raise DataError(where, got, "one measurement file in it", "Unpack it, and name the file that is meant.")
    return content, name
