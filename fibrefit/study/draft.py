"""Draft of a study, from what was understood of bare files: channels, units, how to read them, what is to be stated."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, get_args

from fibrefit.core.declarations import KINDS
from fibrefit.core.errors import UsageError, refuse_unknown
from fibrefit.core.paths import name_of_several, path_from
from fibrefit.study.overrides import apply_overrides, parse
from fibrefit.study.quantity import field_unit
from fibrefit.study.rigs import RIG_KEYS, study_type
from fibrefit.study.study import SCHEMA, to_toml

#: Keys of a study that tell how files are read; the others are what a person states of the rig and the records.
READING = ("channels", "units", "files")


@dataclass(frozen=True, slots=True)
class FileReading:
    """What a study has to say of one file.

    Parameters
    ----------
    path : Path
        The file.
    channels : mapping of str to (str or mapping)
        Column by role, with unit and scale where they were declared.
    units : mapping of str to str
        Unit by role.
    declared : collection of str
        Roles whose unit the file does not say.
    """

    path: Path
    channels: Mapping[str, Any] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    declared: Collection[str] = ()


class StudyText(NamedTuple):
    """A study that was written from files.

    Parameters
    ----------
    text : str
        TOML.
    unstated : tuple of str
        Constants of the rig that are to be stated in it.
    """

    text: str
    unstated: tuple[str, ...]


def split_overrides(overrides: Sequence[str]) -> tuple[list[str], list[str]]:
    """Overrides that tell how files are read, and all others."""
    reading = [override for override in overrides if override.split("=")[0].strip().split(".")[0] in READING]
    return reading, [override for override in overrides if override not in reading]


def study_text(files: Sequence[FileReading], kind: str | None, overrides: Sequence[str], folder: Path) -> StudyText:
    """Study file of bare records.

    Parameters
    ----------
    files : sequence of FileReading
        At least one.
    kind : str or None
        Kind of the rig; None takes the one whose channels are there.
    overrides : sequence of str
        As on the command line; they go into the study.
    folder : Path
        Where the study will stand; its files are named from there.

    Returns
    -------
    StudyText
        With a remark under ``[rig]`` for every constant that has to be stated yet.

    Raises
    ------
    UsageError
        If the kind of rig is not known, or an override puts something else in place of the rig or the records.
    """
    where = "--rig"
    for override in overrides:
        keys, value = parse(override)
        if keys == ["rig"] and isinstance(value, Mapping):
            keys, value = ["rig", "kind"], value.get("kind")
        if keys == ["rig", "kind"] and value is not None:
            where, kind = f"--set {override}", str(value)
    # The rig that explains most of the channels which the files hold and lacks the fewest; a drop where they hold none.
    if not kind:
        roles = {role for one in files for role in one.channels} - {"time"}
        known = {kind: set(keys.noise) for kind, keys in RIG_KEYS.items()}
        kind = max(known, key=lambda kind: (len(roles & known[kind]), -len(known[kind] - roles)))
        kind = kind if roles else "fibre_mass"
    refuse_unknown(where, kind, KINDS)
    files = [_with_channels_of(kind, one) for one in files]
    usual = replace(files[0], units={role: files[0].units[role] for role in files[0].declared})
    records: Any = []
    for one in files:
        record: dict[str, Any] = {"file": path_from(folder.resolve(), one.path.resolve())}
        own = {role: said for role, said in one.channels.items() if usual.channels.get(role) != said}
        # What is said of all files does not hold for one whose numbers have another unit.
        for role, unit in one.units.items():
            said = usual.units.get(role, None if role in one.declared else unit)
            if unit != said and isinstance(one.channels.get(role), str):
                own[role] = {"column": one.channels[role], "unit": unit}
        records.append(record | ({"channels": own} if own else {}))
    raw: dict[str, Any] = {
        "schema": SCHEMA,
        "name": name_of_several([one.path for one in files]),
        "rig": {"kind": kind, **_measured(kind, files)},
        "channels": dict(usual.channels),
        "units": dict(usual.units),
    }
    stated: dict[str, Any] = {}
    apply_overrides(stated, [override for override in overrides if override.startswith("files.")])
    if isinstance(of_files := stated.get("files"), dict) and isinstance(header := of_files.get("header"), str):
        of_files["header"] = path_from(folder.resolve(), Path(header).resolve())  # said from where the command was
    raw = {key: value for key, value in (raw | stated | {"records": records}).items() if value not in ({}, [])}
    apply_overrides(raw, [o for o in overrides if not o.startswith(("files.", "channels.", "units."))])
    records = raw["records"]
    are_tables = isinstance(records, list) and bool(records) and all(isinstance(one, Mapping) for one in records)
    if not (isinstance(raw["rig"], Mapping) and are_tables):
        do = "Set their keys, such as rig.kind or records[0].lift."
        raise UsageError("--set", "something else in place of rig or records", "tables there", do)
    return _with_remarks(raw, kind)


def _with_channels_of(kind: str, one: FileReading) -> FileReading:
    """A file with the channels that a rig has; those that other rigs have besides are left out.

    Raises
    ------
    UsageError
        If two forces were found where the rig has one: which one it is, a person alone knows.
    """
    own = study_type(kind).model_fields["channels"].default.known_keys()
    others = [role for role in one.channels if role not in own]
    numbered = [role for role in others if role.split("_")[0] in own and role.split("_")[0] not in one.channels]
    if numbered:
        role = numbered[0].split("_")[0]
        columns = [said["column"] if isinstance(said := one.channels[each], Mapping) else said for each in numbered]
        shown = " and ".join(f'"{column}"' for column in columns)
        do = f"Name the one that is meant: --set 'channels.{role}=\"{columns[0]}\"'."
        got = f"{one.path.name} has {len(columns)} columns of the {role}, {shown}"
        raise UsageError("--write", got, f"one, as a rig of the kind {kind} has", do)
    kept = {role: said for role, said in one.channels.items() if role not in others}
    units = {role: unit for role, unit in one.units.items() if role not in others}
    return replace(one, channels=kept, units=units, declared=[role for role in one.declared if role not in others])


def _measured(kind: str, files: Sequence[FileReading]) -> dict[str, str]:
    """What was measured, where a rig's study has to say so: all files lack a channel of the usual records."""
    field = study_type(kind).model_fields["rig"].annotation.model_fields.get("measured")  # type: ignore[union-attr]
    if field is None:
        return {}
    roles = set.intersection(*(set(one.channels) for one in files))
    choices = [str(choice) for choice in get_args(field.annotation)]
    fitting = [choice for choice in choices if set(choice.split(" and ")) <= roles]
    return {} if not fitting or field.default in fitting else {"measured": fitting[0]}


def _with_remarks(raw: Mapping[str, Any], kind: str) -> StudyText:
    """A study with remarks under ``[rig]``, on constants that have to be stated yet and would hold for all records."""
    record = study_type(kind).model_fields["records"].annotation.__args__[0]  # type: ignore[union-attr]
    stated = set(raw["rig"]) | set.intersection(*(set(record) for record in raw["records"]))
    remarks = {}
    for name in record.needed():
        if name not in stated:
            unit, what = field_unit(record.model_fields[name]), record.model_fields[name].description
            remarks[name] = f'# {name} = "{unit.example if unit else ""}"  # {what}'
    lines = to_toml(raw).split("\n")
    if remarks:
        head = lines.index("[rig]") + 1
        own = itertools.takewhile(lambda line: line and not line.startswith("["), lines[head:])
        place = head + next((i for i, line in enumerate(own, 1) if line.startswith("kind = ")), 0)
        lines[place:place] = ["# still to be stated; in a record where it differs:", *remarks.values()]
    return StudyText("\n".join(lines), tuple(remarks))
