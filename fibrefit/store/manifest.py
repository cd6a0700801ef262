"""What stands in a result's folder: the files we wrote, listed in its marker, and those of others."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fibrefit.core.errors import UsageError
from fibrefit.core.limits import LARGEST_STUDY
from fibrefit.core.paths import read_plain_file, write_whole

#: File that tells a folder of ours from any other, and lists what we wrote into it.
MARKER = ".fibrefit"

#: Version of the layout of a result's folder, and of what a run goes on from.
LAYOUT = 2

#: Endings of the files that results are made of, half-written ones last: nothing else is removed from a working folder.
KINDS = frozenset(
    [
        "",
        *[
            ".csv",
            ".h5",
            ".html",
            ".job",
            ".json",
            ".npz",
            ".parquet",
            ".pdf",
            ".png",
            ".py",
            ".svg",
            ".toml",
            ".tmp",
            ".copy",
        ],
    ]
)
INSPECTION_TEXT = "inspection.txt"


@dataclass(frozen=True)
class Manifest:
    """Content of a marker.

    Parameters
    ----------
    identity : str
        Tells this result from any other.
    content : mapping of str to object
    """

    identity: str
    content: Mapping[str, Any]

    @property
    def files(self) -> list[str]:
        """Files of the result, relative to its folder; none while it is being made."""
        return self._listed("files")

    @property
    def folders(self) -> set[str]:
        """Folders of the result, relative to its own."""
        above = {parent.as_posix() for file in self.files for parent in Path(file).parents}
        return {*self._listed("folders"), *above} - {"."}

    @property
    def complete(self) -> bool:
        """Whether all of the result is there."""
        return "files" in self.content

    @property
    def replaces(self) -> str | None:
        """Identity of the result it is to take the place of."""
        return self.content.get("replaces")

    @property
    def run(self) -> Mapping[str, str] | None:
        """What the run rests on, by name; None where it is not known."""
        run = self.content.get("run") if self.content.get("layout") == LAYOUT else None
        return run if isinstance(run, dict) else None

    @property
    def kept(self) -> bool:
        """Whether a run that is cut short is to be gone on with."""
        return bool(self.content.get("keep"))

    def _listed(self, what: str) -> list[str]:
        """Names of a list that stay below the folder: what is listed is removed, and a marker may come from anybody."""
        names = self.content.get(what)
        return [name for name in names if _stays_below(name)] if isinstance(names, list) else []


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
    return Manifest(str(content.get("identity") or hashlib.sha256(text).hexdigest()), content)


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


def _stays_below(name: object) -> bool:
    if not isinstance(name, str) or not name or "\0" in name:
        return False
    path = Path(name)
    return not path.anchor and ".." not in path.parts


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()
