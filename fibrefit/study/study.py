"""The study: what was measured, on which rig, and what is fitted."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from datetime import date, time
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field, PrivateAttr, StrictStr

from fibrefit.core.declarations import ROLES, Parameter
from fibrefit.core.errors import Mistakes, StudyError, did_you_mean
from fibrefit.core.formatting import Card, Shown
from fibrefit.core.paths import path_from, sha256_of
from fibrefit.core.units import expression, to_si
from fibrefit.study.parameters import UNIT_ROUNDING, ParameterSetting, ParameterTable, check_possible, setting_of
from fibrefit.study.quantity import AS_WRITTEN, as_stated, field_unit
from fibrefit.study.reading import SUGGESTED, ChannelTable, Files, check_channels, reading_arguments
from fibrefit.study.table import KeyLocator, Name, StudyTable

SCHEMA = "fibrefit/study/1"
_OF_RECORD = re.compile(r"@(?:1-|(?:\d{1,9}\+)*)(\d{1,9})$")
"""The last record of an effect that belongs to one or some, or that happens once in each."""
_TOGETHER = (("lateral_offset", "guide_distance"), ("mass", "centre_distance"))
"""Keys of a record that say nothing one without the other."""


class ModelTable(StudyTable):
    """``[model]``: the law of the fibre and the effects added to the base model."""

    tension_law: Literal["clamped", "heaviside"] = "clamped"
    """Law of the fibre's tension: clamped, nothing where stiffness and damping would push; heaviside, their sum
    wherever there is stretch."""
    effects: tuple[StrictStr, ...] = ()
    """Names of the catalogue, or "my_effects.py:MyEffect"."""
    laws: dict[str, StrictStr] = Field(default_factory=dict)
    """SHA-256 of files with effects, which then must not change."""


class Digests(dict[Path, str]):
    """SHA-256 of files that were read. It is no part of what a study says: two studies are not distinguished by it."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Digests)

    __hash__ = None


class Study(Shown, StudyTable):
    """A study as `load_study` returns it: complete, in SI, immutable.

    Each record carries the constants of the rig that it did not override, so nothing needs to be looked up under `rig`.

    Attributes
    ----------
    base_parameters : dict of str to str
        Parameters of the base model of the rig, with their SI units.
    """

    base_parameters: ClassVar[dict[str, str]] = {}

    schema_name: Literal["fibrefit/study/1"] = Field(alias="schema")
    name: Name
    rig: Any
    channels: Any
    units: dict[str, StrictStr] = Field(default_factory=dict)
    """Unit of a column, by role or header, where the header has none or a wrong one."""
    files: Files = Files()
    model: ModelTable = ModelTable()
    parameters: dict[str, ParameterTable] = Field(default_factory=dict)
    noise: Any
    limits: StudyTable = StudyTable()
    records: tuple[Any, ...]

    _source: Path = PrivateAttr(default=Path("study.toml"))
    _table: Path | None = PrivateAttr(default=None)
    _locate: KeyLocator = PrivateAttr(default=KeyLocator(Path("study.toml")))
    _digests: Digests = PrivateAttr(default_factory=Digests)

    @property
    def digests(self) -> Digests:
        """Of its files as they were when they were read, by path: a run may last longer than they stay as they are."""
        return self._digests

    @property
    def source(self) -> Path:
        """The study file; for a study made of bare records, where it would have stood."""
        return self._source

    @property
    def kind(self) -> str:
        """Kind of the rig, e.g. ``"fibre_mass"``."""
        return str(self.rig.kind)

    @property
    def driven_by_force(self) -> bool:
        """Whether the force that is measured is one that pushes, not one that a fibre bears."""
        return False

    @property
    def variant(self) -> str:
        """What of the rig was not measured, where that makes another rig of it; empty for the usual one."""
        return ""

    def place_of(self, key: str) -> str:
        """Where a key of it stands, for messages: in its file, its table of records, or on the command line."""
        return self._locate(key)

    def path_of(self, file: str) -> Path:
        """Path of a file the study names, which is relative to the study file."""
        return self._source.parent / file

    def input_files(self) -> list[Path]:
        """Every file the study rests on: itself, its table of records, the records, files with effects."""
        return self.stated_in() + self.data_files()

    def stated_in(self) -> list[Path]:
        """The files that state it: itself, and its table of records."""
        return [path for path in (self._source, self._table) if path is not None and os.path.isfile(path)]

    def data_files(self) -> list[Path]:
        """The input files whose content is not in the study itself: records, and files with effects."""
        named = [file for record in self.records for file in record.files]
        named += [header for header in (self.files.header, *(r.header for r in self.records)) if header]
        return list(dict.fromkeys([*map(self.path_of, named), *self.own_effects().values()]))

    def own_effects(self) -> dict[str, Path]:
        """The effects whose code is in a file, and the file: Python that runs when the model is made."""
        own = [effect for effect in self.model.effects if ".py:" in effect]
        return {effect: self.path_of(effect.rpartition(":")[0]) for effect in own}

    @property
    def found_constants(self) -> dict[str, float]:
        """Constants of the rig that are parameters of the model, and their stated values in SI."""
        fields = type(self.rig).model_fields
        return {name: getattr(self.rig, name) for name in self.parameters if name in fields}

    def reading(self, record: Any) -> dict[str, Any]:
        """Arguments for the reader of a record's file, see `reading_arguments`."""
        channels = dict(self.channels) | (record.channels or {})
        said = reading_arguments(channels, self.units, self.files, record.sampling_rate)
        header = record.header or self.files.header
        return said | {"header": self.path_of(header) if header else None}

    def refuse_without_records(self) -> None:
        """Refuse a study that lists no record, where a command asks for some.

        Raises
        ------
        StudyError
        """
        if not self.records:
            do = "Name the file of each under [[records]]; of a study without any, sweep and inspect can be run."
            raise StudyError(self._locate("records"), "none is listed", "at least one record", do)

    @property
    def possible(self) -> dict[str, tuple[float, float]]:
        """Least and most of what the rig can do, in SI units, where the study says so."""
        return {name: ends for name, ends in self.limits if ends is not None}

    def settings(self, declared: Mapping[str, Parameter]) -> dict[str, ParameterSetting]:
        """What the study says about each declared parameter, in SI.

        Parameters
        ----------
        declared : mapping of str to Parameter
            Every parameter of the model: base, and dotted names of the effects in use.

        Returns
        -------
        dict of str to ParameterSetting
            One for each declared parameter, in that order; defaults where the study is silent.

        Raises
        ------
        StudyError
            If the study names a parameter that is not declared, a quantity does not fit its unit, or no value is left.
        """
        units = {name: parameter.unit for name, parameter in declared.items()}
        settings = {}
        with Mistakes(str(self._source)) as mistakes:
            for name in [name for name in self.parameters if name not in units]:
                do = did_you_mean(name, units) or f"The model has {', '.join(units)}."
                where = self._locate(f"parameters.{name}")
                mistakes.note(StudyError(where, "unknown parameter", "one of the model", do))
            for name, unit in units.items():
                with mistakes.collect():
                    settings[name] = self._setting(name, unit)
                    check_possible(settings[name], declared[name], self._locator_of(name))
        return settings

    def check(self, mistakes: Mistakes) -> None:
        """Note all that is wrong with it and can be seen before the effects are known and any record is read."""
        # Names of parameters that are misspelt, and what they say.
        units = {name: unit.si if (unit := field_unit(f)) else "-" for name, f in type(self.rig).model_fields.items()}
        constants = {name: unit for name, unit in units.items() if isinstance(getattr(self.rig, name), float)}
        known = {**self.base_parameters, **constants}
        for name in self.parameters:
            if name in known:
                with mistakes.collect():
                    self._setting(name, known[name])
            elif "." not in name:
                base = self.base_parameters
                do = did_you_mean(name, base) or "Parameters of an effect have dotted names."
                expected = f"one of {', '.join(base)}"
                mistakes.note(StudyError(self._locate(f"parameters.{name}"), "unknown parameter", expected, do))
        self._check_units(mistakes)
        # Tests that are dated with an offset from UTC where the first one is without, or the other way round.
        local = {i: one.taken.utcoffset() is None for i, one in enumerate(self.records) if one.taken is not None}
        for i in local:
            if local[i] != local[first := min(local)]:
                got = f"a time {'without' if local[i] else 'with'} an offset from UTC"
                expected = f"one {'with' if local[i] else 'without'}, as in records[{first}]"
                mistakes.note(StudyError(self._locate(f"records[{i}].taken"), got, expected, ""))
        self._check_laws(mistakes)
        # Limits of the rig that one of its records goes beyond.
        for name, (least, most) in self.possible.items():
            for record in self.records:
                value, slack = getattr(record, name, None), UNIT_ROUNDING * abs(most)
                if value is not None and not least - slack <= value <= most + slack:
                    unit = record.conditions()[name].si
                    low, high, at = (as_stated(each, unit) for each in (least, most, value))
                    got, expected = f"{low} to {high}", f"limits that hold every record; {record.label} has {at}"
                    do = "Widen them, or correct the record."
                    mistakes.note(StudyError(self._locate(f"limits.{name}"), got, expected, do))
                    break
        # Constants that are parameters of all records, and stated otherwise in one of them.
        for name, value in self.found_constants.items():
            for i, record in enumerate(self.records):
                if getattr(record, name, value) != value:
                    got = "another value than under [rig], where it is a parameter"
                    do = f"Leave it out here, or state {name} without an uncertainty."
                    where = self._locate(f"records[{i}].{name}")
                    mistakes.note(StudyError(where, got, "one value for all records", do))
        self._check_records(mistakes)

    def _check_records(self, mistakes: Mistakes) -> None:
        """Note records of one name, or with half of what belongs together, and effects of records it does not have."""
        seen: dict[str, Any] = {}
        for i, record in enumerate(self.records):
            where = self._locate(f"records[{i}]")
            if record.label in seen:
                other = seen[record.label]
                copy = record.file is not None and (record.files, record.channels) == (other.files, other.channels)
                do = "Take one of the two off the list: a copy is no further evidence." if copy else "Give one a name."
                expected = "each record once" if copy else "a name for each record"
                mistakes.note(StudyError(where, f'"{record.label}" a second time', expected, do))
            seen[record.label] = record
            for name in record.uncertainties or {}:
                if getattr(record, name) is None:
                    do = f"State {name} as well, here or under [rig]."
                    mistakes.note(StudyError(where, f"the uncertainty of {name}", f"a value of {name}", do))
            for pair in _TOGETHER:
                stated = [getattr(record, name) is not None for name in pair if name in type(record).model_fields]
                if len(stated) == len(pair) and any(stated) != all(stated):
                    got = f"{' or '.join(pair)} alone"
                    mistakes.note(StudyError(where, got, "both or neither", "They go together."))
        number = len(self.records)
        for name in self.model.effects:
            found = _OF_RECORD.search(name)
            if number and found is not None and int(found[1]) > number:
                got = f'"{name}", of record {found[1]}'
                expected = f"one of its {number} record{'s' * (number != 1)}"
                do = "Records are numbered from 1, in the order of the study."
                mistakes.note(StudyError(self._locate("model.effects"), got, expected, do))

    def _check_units(self, mistakes: Mistakes) -> None:
        """Note units that are not known, do not suit their channel, or belong to no channel."""
        tables = [dict(self.channels), *(record.channels for record in self.records if record.channels)]
        role_of = {role: role for role, _ in self.channels}
        said_of = [(role, said) for table in tables for role, said in table.items() if said]
        role_of |= {(said.column if isinstance(said, ChannelTable) else said) or role: role for role, said in said_of}
        scaled = {role for role, said in said_of if isinstance(said, ChannelTable) and said.scale}
        check_channels(dict(self.channels), self.units, self._locate("channels"), mistakes)
        for i, record in enumerate(self.records):
            for role in (record.channels or {}).keys() - dict(self.channels).keys():
                where, known = self._locate(f"records[{i}].channels.{role}"), list(dict(self.channels))
                mistakes.note(StudyError(where, "unknown key", f"one of {', '.join(known)}", did_you_mean(role, known)))
            check_channels(record.channels or {}, self.units, self._locate(f"records[{i}].channels"), mistakes)
        for key, unit in self.units.items():
            where = self._locate(f"units.{key}")
            with mistakes.collect():
                if key not in role_of:
                    do = did_you_mean(key, role_of)
                    raise StudyError(where, "unknown channel", f"one of {', '.join(role_of)}", do)
                if role_of[key] not in scaled:
                    to_si(unit, ROLES[role_of[key]], where, error=StudyError)
                elif expression(unit) is None:
                    raise StudyError(where, f'unit "{unit}"', "a known unit", did_you_mean(unit, SUGGESTED))

    def _check_laws(self, mistakes: Mistakes) -> None:
        """Note files with effects that have changed since the study was written: another SHA-256 than it states."""
        files = {effect.rpartition(":")[0] for effect in self.own_effects()}
        for file, expected in self.model.laws.items():
            path = self.path_of(file)
            if file not in files and not os.path.isfile(path):
                do = did_you_mean(file, files) or "Correct its name, or remove the line."
                mistakes.note(StudyError(self._locate(f"model.laws.{file}"), "no such file", "that of an effect", do))
            elif os.path.isfile(path) and (found := sha256_of(path)) != expected.lower():
                got = f"{path} has changed: its SHA-256 is {found[:12]}..."
                known = f"{expected[:12]}..., that of the law this study was written with"
                do = "Look at what has changed; then put the new digest there, or remove the line."
                mistakes.note(StudyError(self._locate(f"model.laws.{file}"), got, known, do))

    def resolved_toml(
        self, relative_to: Path | None = None, growing: Path | None = None, *, as_written: bool = False
    ) -> str:
        """The study as a TOML file that reads back as the same study.

        Parameters
        ----------
        relative_to : pathlib.Path, optional
            Folder the text will be written to; the files it names are then relative to it.
        growing : pathlib.Path, optional
            Folder that is about to take its place: laws in it are told by what they are there.
        as_written : bool
            Whether quantities keep the units in which they were stated: for a person. In SI, two studies that say the
            same in other units have the same text.

        Returns
        -------
        str
            TOML with every constant in each record; quantities are in SI, unless they stand as they were written.
        """
        context = AS_WRITTEN if as_written else None
        content = self.model_dump(mode="json", by_alias=True, exclude_none=True, context=context)
        if relative_to is not None:
            self._name_files_from(relative_to, content, growing)
        if not content["model"].get("laws"):
            content["model"].pop("laws", None)
        return to_toml({key: value for key, value in content.items() if value not in ({}, [])})

    def _name_files_from(self, folder: Path, content: dict[str, Any], growing: Path | None) -> None:
        """Put into the content of a study the paths of its files from a folder, and the digests of its laws."""
        here = folder.resolve()

        def moved(file: str | Path) -> str:
            """Path from the folder to where links lead."""
            return path_from(here, self.path_of(str(file)).resolve())

        for record in content["records"]:
            if "file" in record:
                record.setdefault("name", record["file"])
            for table, key in ((record, "file"), (record, "header"), (record.get("beside", {}), "file")):
                if key in table:
                    table[key] = moved(table[key])
            if "parts" in record:
                record["parts"] = [moved(part) for part in record["parts"]]
        if content["files"].get("header"):
            content["files"]["header"] = moved(content["files"]["header"])
        named = [effect.rpartition(":") for effect in content["model"]["effects"]]
        content["model"]["effects"] = [f"{moved(file)}:{name}" if colon else name for file, colon, name in named]
        laws = {}
        for path in sorted(set(self.own_effects().values())):
            written = real = path.resolve()
            if growing is not None and real.is_relative_to(here):
                written = growing / real.relative_to(here)
            if os.path.isfile(written):
                laws[path_from(here, real)] = sha256_of(written)
        content["model"]["laws"] = laws

    def _card(self) -> Card:
        number = len(self.records)
        effects = f" with {', '.join(self.model.effects)}" if self.model.effects else ""
        line = f"{number} record{'s' * (number != 1)}; {self.model.tension_law} fibre{effects}"
        rows = [(record.label, record.file or "planned") for record in self.records]
        return Card(f'Study "{self.name}" of a {self.kind} rig, {self.source}', line, ("record", "file"), rows)

    def _setting(self, name: str, unit: str) -> ParameterSetting:
        table = self.parameters.get(name, ParameterTable())
        return setting_of(name, table, unit, self._locator_of(name))

    def _locator_of(self, parameter: str) -> Callable[[str], str]:
        return lambda key: self._locate(f"parameters.{parameter}{key}")


def to_toml(content: Mapping[str, Any]) -> str:
    """TOML text of tables, arrays of tables, text, numbers, booleans, dates and times.

    Parameters
    ----------
    content : mapping
        What ``tomllib.loads`` would return.
    """
    return "\n".join(_table((), content)).strip() + "\n"


def _table(path: tuple[str, ...], content: Mapping[str, Any]) -> list[str]:
    plain = {key: value for key, value in content.items() if not isinstance(value, Mapping) and not _is_array(value)}
    lines = [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in content.items():
        here = (*path, key)
        header = ".".join(map(_key, here))
        if isinstance(value, Mapping):
            lines += ["", f"[{header}]", *_table(here, value)]
        elif _is_array(value):
            for table in value:
                lines += ["", f"[[{header}]]", *_table(here, table)]
    return lines


def _is_array(value: Any) -> bool:
    """Whether a value is an array of tables."""
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(one, Mapping) for one in value)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _text(text: str | bool) -> str:
    # JSON and TOML agree on truth and on basic strings, but for one control character that TOML wants escaped.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, str | bool):
        return _text(value)
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items())
        return f"{{ {inner} }}"
    return f"[{', '.join(map(_value, value))}]"
