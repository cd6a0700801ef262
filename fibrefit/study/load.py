"""Reading a study: from its file, or from bare records and what the command line says."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import ValidationError

from fibrefit.core.declarations import KINDS
from fibrefit.core.errors import Mistakes, StudyError, did_you_mean
from fibrefit.core.limits import LARGEST_STUDY
from fibrefit.core.paths import (
    is_folder,
    is_plain_file,
    name_of_several,
    nearest_file,
    read_plain_file,
    sha256_of,
    shown_path,
)
from fibrefit.study.explain import explained, in_place_of, meant_as
from fibrefit.study.files.scaled import with_scale_parameters
from fibrefit.study.files.uncertain import check_uncertain, take_uncertainties
from fibrefit.study.overrides import apply_overrides, note_unused
from fibrefit.study.parameters import ParameterTable
from fibrefit.study.places import Places
from fibrefit.study.quantity import Unit, shown
from fibrefit.study.rigs.catalogue import study_type
from fibrefit.study.series import read_series
from fibrefit.study.study import SCHEMA, Study
from fibrefit.study.table import StudyTable

Missing = Literal["none", "some", "all"]
"""Of how many records the files need not be there."""
#: Bytes of a file's name that file systems take.
_LONGEST_NAME = 255
#: Records that a message names one by one; more are counted.
_RECORDS_NAMED = 3
_KEY = r"(?:[\w-]+|\"[^\"\n]*\"|'[^'\n]*')"
_DEEP = re.compile(rf"(?<![\w-]){_KEY}(?:[ \t]*\.[ \t]*{_KEY}){{64}}")
"""A key of more parts than any study has: what the parser takes of memory for one grows with their square."""
_RECORD = re.compile(r"\s*\[{1,2}\s*records\s*\]{1,2}\s*(?:#.*)?")
_BARE_VALUE = re.compile(rf"\s*(?P<key>{_KEY}(?:\.{_KEY})*)\s*=\s*(?P<value>[^\"'#{{}}]*?)\s*(?:#.*)?")
"""A key and what stands behind it without quotes."""
_UNQUOTED = re.compile(r"(?!(?:true|false|[+-]?[\d._]+(?:[eE][+-]?\d+)?)$)[^\s\"'\[\]{},=][^\"'{}=]*")
_OF_RECORD = re.compile(r"@(?:1-|(?:\d{1,9}\+)*)(\d{1,9})$")
"""The last record of an effect that belongs to one or some, or that happens once in each."""


def load_study(
    path: str | Path, overrides: Sequence[str] = (), *, some_missing: bool = False, all_missing: bool = False
) -> Study:
    """Read a study.

    Parameters
    ----------
    path : str or pathlib.Path
        A study file, or a folder with a ``study.toml``.
    overrides : sequence of str
        Changes to it, as on the command line: ``'rig.weight_mass="3.1 kg"'``.
    some_missing : bool
        Whether files of some of the records need not be there: those are refused when they are read.
    all_missing : bool
        Whether none of them need be there, as where the model of a result is all that is asked for.

    Returns
    -------
    Study
        Complete, in SI units; it cannot be changed.

    Raises
    ------
    StudyError
        If the file cannot be read, is not valid, or names records that do not exist.
    UsageError
        If an override is not of the form ``key=value``.

    Examples
    --------
    >>> study = fibrefit.load_study(fibrefit.example("drop_series"), ['rig.weight_mass="3.1 kg"'])
    >>> study.records[0].lift, study.records[0].weight_mass
    (0.005, 3.1)
    """
    source = Path(path)
    if is_folder(source):
        source = source / "study.toml"
    missing: Missing = "all" if all_missing else "some" if some_missing else "none"
    return _study(_read_toml(source), source, overrides, missing)


def as_study(study: Study | str | Path) -> Study:
    """A study as it is, or read from its path.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        A path is that of a study file, or of a folder with a ``study.toml``.

    Raises
    ------
    StudyError
        As `load_study`.
    """
    return study if isinstance(study, Study) else load_study(study)


def study_from_files(files: Sequence[str | Path], rig: str, overrides: Sequence[str] = ()) -> Study:
    """Study of bare records, all measured under the conditions that `overrides` give.

    Parameters
    ----------
    files : sequence of str or pathlib.Path
        Measured records.
    rig : str
        Kind of the rig.
    overrides : sequence of str
        Constants and all else a study holds, e.g. ``rig.weight_mass=3.1 kg`` or ``records[0].lift=5 mm``.

    Returns
    -------
    Study
        Complete and in SI; its files are relative to the working folder.

    Raises
    ------
    StudyError
        As `load_study`.
    """
    records = [{"file": Path(file).as_posix()} for file in files]
    names = [Path(file).name for file in files]
    if len(set(names)) == len(names):
        for record, short in zip(records, names, strict=True):
            record["name"] = short
    raw = {"schema": SCHEMA, "name": name_of_several(files) or "nothing", "rig": {"kind": rig}, "records": records}
    return _study(raw, Path("command line"), overrides)


def _read_toml(path: Path) -> dict[str, Any]:
    """Content of a TOML file."""
    near = "" if is_plain_file(path) else nearest_file(path, ".toml")
    data = read_plain_file(path, "a study file", StudyError, near, LARGEST_STUDY)
    try:
        text = data.decode("utf-8-sig")
        if _DEEP.search(text):
            raise RecursionError
        return tomllib.loads(text.replace("\r\n", "\n"))
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise StudyError(f"{path}, line {line}", "not UTF-8", "text in UTF-8", "Save it with that encoding.") from None
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(path, str(error), text) from None
    except ValueError:  # of an integer that Python does not read
        raise StudyError(str(path), "a number of thousands of digits", "numbers a person can read", "") from None
    except RecursionError:
        raise StudyError(str(path), "nested too deeply", "a study file", "") from None


def _syntax_error(path: Path, said: str, text: str) -> StudyError:
    found = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)", said)
    if found is None:
        return StudyError(str(path), said, "TOML", "")
    lines = text.splitlines() or [""]
    number = int(found[1] or len(lines))
    column = f", column {found[2]}" if found[2] else ""
    said = said[: found.start()]
    remedies = {"Cannot": "A key or table is given twice.", "Invalid value": "Text and quantities stand in quotes."}
    do = next((remedy for start, remedy in remedies.items() if said.startswith(start)), "")
    do = _as_toml(lines[min(number, len(lines)) - 1], said) or do
    return StudyError(f"{path}, line {found[1] or text.count(chr(10)) + 1}{column}", f"not TOML: {said}", "", do)


def _as_toml(line: str, said: str) -> str:
    """How a line that is not TOML is meant to be written: text in quotes, a record in double brackets; or empty."""
    if _RECORD.fullmatch(line) and said.startswith("Cannot"):
        return "Write [[records]], in double brackets, above each record."
    found = _BARE_VALUE.fullmatch(line)
    inside = re.fullmatch(r"\[(.*)\]", found["value"]) if found else None
    texts = [text.strip() for text in inside[1].split(", ")] if inside else [found["value"]] if found else []
    if found is None or not all(map(_UNQUOTED.fullmatch, texts)):
        return ""
    # What stands in quotes is written with a decimal point.
    value = ", ".join('"' + re.sub(r"^([+-]?\d+),(?=\d)", r"\1.", text) + '"' for text in texts)
    return f"Write it in quotes: {found['key']} = {f'[{value}]' if inside else value}"


def _study(raw: dict[str, Any], source: Path, overrides: Sequence[str], missing: Missing = "none") -> Study:
    """Study from the content of a file and the changes to it, of which files of records may be missing."""
    _name_parameters(raw, source)
    table = _read_table(raw, source)
    changed = apply_overrides(raw, overrides)
    table = _read_table(raw, source) or table
    take_uncertainties(raw)
    place = Places(source, table, changed)
    kind = _model(raw, place)
    try:
        study = kind.model_validate(raw)
    except ValidationError as error:
        raise explained(error, raw, place, lambda key: _belongs(key, kind)) from None
    with Mistakes(place("")) as mistakes:
        study = study.model_copy(update={"records": _completed(study, place, mistakes)})
        with mistakes.apart():
            study = with_scale_parameters(study, place)
        study._source, study._table, study._place = source, table, place
        study.digests.update({path: sha256_of(path) for path in (source, table) if path and is_plain_file(path)})
        study.check(mistakes)
        check_uncertain(study, place, mistakes)
        _check_records(study, place, mistakes)
        _check_effects(study, place, mistakes)
        _check_files(study, place, missing, mistakes)
    return study


def _read_table(raw: dict[str, Any], source: Path) -> Path | None:
    """Put the rows of a table in place of its name; the table's path, or None where the study has none."""
    if not isinstance(raw.get("records"), str):
        return None
    table = source.parent / raw["records"]
    raw["records"] = read_series(table)
    return table


def _name_parameters(raw: dict[str, Any], source: Path) -> None:
    """Join the nested tables of ``[parameters.guide.viscous_friction.viscous_coefficient]`` into one dotted name."""
    nested = raw.get("parameters")
    if not isinstance(nested, dict):
        return
    named: dict[str, Any] = {}

    def walk(name: str, content: Any) -> None:
        is_group = isinstance(content, dict) and content and all(isinstance(v, dict) for v in content.values())
        if is_group and not set(content) & set(ParameterTable.known_keys()):
            for key, value in content.items():
                walk(f"{name}.{key}", value)
        elif name in named:
            raise StudyError(f"{source}, parameters.{name}", "given twice", "one table", "Remove one.")
        else:
            named[name] = content

    for key, content in nested.items():
        walk(key, content)
    raw["parameters"] = named


def _model(raw: dict[str, Any], place: Places) -> type[Study]:
    """Model of the study for its kind of rig."""
    rig = raw.get("rig")
    expected = ", ".join(f'"{name}"' for name in KINDS)
    if not isinstance(rig, dict):
        if "rig" not in raw and (meant := meant_as("rig", raw, Study.known_keys())):
            raise StudyError(place(meant), "unknown key", "[rig]", 'Did you mean "rig"?')
        got = "a list" if isinstance(rig, list) else "no table [rig]" if rig is None else shown(rig)
        table = f"[rig] with kind = one of {expected}"
        raise StudyError(place("rig" if "rig" in raw else ""), got, table, "")
    kind = rig.get("kind")
    if isinstance(kind, str) and kind in KINDS:
        return study_type(kind)
    if kind is None:
        do = in_place_of("kind", rig, (), KINDS)
        raise StudyError(place("rig"), "no kind of rig", f"kind = one of {expected}", do)
    raise StudyError(place("rig.kind"), shown(kind), f"one of {expected}", did_you_mean(str(kind), KINDS))


def _completed(study: Study, place: Places, mistakes: Mistakes) -> tuple[Any, ...]:
    """Records with the constants of the rig that they do not override; what a record still needs is a mistake."""
    own = type(study.records[0]).model_fields if study.records else {}
    constants = {key: getattr(study.rig, key) for key in type(study.rig).model_fields if key in own}
    records, lacking = [], set[str]()
    for i, record in enumerate(study.records):
        absent = {key: value for key, value in constants.items() if getattr(record, key) is None}
        for key, value in absent.items():
            if value is None and key in type(record).needed() and key not in lacking:
                example = next(
                    unit.example for unit in type(record).model_fields[key].metadata if isinstance(unit, Unit)
                )
                do = _stands_in(key, study, place)
                do += f'Write {key} = "{example}" {"under [rig]" if do else "there"}, or --set rig.{key}="{example}".'
                mistakes.note(StudyError(place(f"records[{i}]"), f"no {key}", "it here or under [rig]", do))
                lacking.add(key)
        records.append(record.model_copy(update=absent))
    for key, value in constants.items():
        note_unused(key, value, study.records, place, mistakes)
    return tuple(records)


def _stands_in(key: str, study: Study, place: Places) -> str:
    """Beginning of the advice on a key that all records need: which of them alone have it; empty where none has."""
    own = [i for i, record in enumerate(study.records) if getattr(record, key) is not None]
    if not own:
        return ""
    if own[_RECORDS_NAMED:]:
        return f"It stands in {len(own)} of {len(study.records)} records alone. "
    names = [f"records[{i}]" if place.table is None else f"record {i + 1}" for i in own]
    return f"It stands in {' and '.join(filter(None, (', '.join(names[:-1]), names[-1])))} alone. "


_TOGETHER = (("lateral_offset", "guide_distance"), ("mass", "centre_distance"))
"""Keys of a record that say nothing one without the other."""


def _check_records(study: Study, place: Places, mistakes: Mistakes) -> None:
    """Note records that have the same name, or half of what belongs together."""
    seen: dict[str, Any] = {}
    for i, record in enumerate(study.records):
        where = place(f"records[{i}]")
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


def _check_effects(study: Study, place: Places, mistakes: Mistakes) -> None:
    """Note effects of a record that the study has not: nothing could be said of them."""
    number = len(study.records)
    for name in study.model.effects:
        found = _OF_RECORD.search(name)
        if number and found is not None and int(found[1]) > number:
            got = f'"{name}", of record {found[1]}'
            expected = f"one of its {number} record{'s' * (number != 1)}"
            do = "Records are numbered from 1, in the order of the study."
            mistakes.note(StudyError(place("model.effects"), got, expected, do))


def _check_files(study: Study, place: Places, may_be: Missing, mistakes: Mistakes) -> None:
    """Note records without a file where one is named; where some may be missing, only if all are."""
    if may_be == "all":
        return
    missing: dict[int, list[str]] = {}
    for i, record in enumerate(study.records):
        for file in (*record.files, *((record.header,) if record.header else ())):
            if not is_plain_file(study.path_of(file)):
                missing.setdefault(i, []).append(file)
    if may_be == "some" and len(missing) < len(study.records):
        return
    for i, files in missing.items():
        for file in dict.fromkeys(files):
            mistakes.note(_no_file(study.path_of(file), file, place(f"records[{i}].file"), suggest=not mistakes.full))


def _no_file(path: Path, named: str, where: str, *, suggest: bool) -> StudyError:
    """Why a name is not that of a file with measured data; what a folder holds in its place, if asked, takes longer."""
    folder = path.parent
    if "\0" in named or len(path.name.encode(errors="replace")) > _LONGEST_NAME:
        return StudyError(where, f'"{shown_path(named)}"', "a name that a file can have", "")
    if not is_folder(folder):
        return StudyError(where, f'no folder for "{shown_path(named)}"', f"{shown_path(folder)} to exist", "")
    if os.path.exists(path):
        what = "a folder" if is_folder(path) else "a device or a pipe"
        return StudyError(where, f'"{named}" is {what}', "a file with measured data", "")
    if not os.access(folder, os.X_OK):
        return StudyError(where, f'"{named}" cannot be reached', f"leave to look into {shown_path(folder)}", "")
    near = nearest_file(path) if suggest else ""
    return StudyError(where, f'no file "{named}"', f"it in {folder.resolve()}", near)


def _belongs(key: str, study: type[Study]) -> str:
    """Sentence on where a key or the name of a parameter belongs; empty where no table of a study knows it.

    Other kinds of rig are consulted only where this one does not know the key.
    """
    if key in study.base_parameters:
        return f"Write [parameters.{key}]."
    if places := [place for place, table in _tables(study) if key in table.known_keys()]:
        return f"It stands under {' or '.join(places)}."
    others = ((kind, study_type(kind)) for kind in KINDS)
    kinds = [kind for kind, other in others if any(key in table.known_keys() for _, table in _tables(other))]
    return f"It is a key of {' and '.join(kinds)}." if kinds else ""


def _tables(study: type[Study]) -> Iterator[tuple[str, type[StudyTable]]]:
    """Each table of a study with its heading; what holds further tables only is none."""
    for name, field in study.model_fields.items():
        for model in _models(field.annotation):
            heading = {"records": "[[records]]", "parameters": "[parameters.NAME]"}.get(name, f"[{name}]")
            yield heading, model


def _models(annotation: Any) -> Iterator[type[StudyTable]]:
    if isinstance(annotation, type) and issubclass(annotation, StudyTable):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)
