"""Reading a study: from its file, or from bare records and what the command line says."""

from __future__ import annotations

import csv
import io
import os
import re
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import ValidationError

from fibrefit.core.declarations import KINDS
from fibrefit.core.errors import Mistakes, StudyError, UsageError, did_you_mean
from fibrefit.core.formatting import in_words
from fibrefit.core.limits import LARGEST_STUDY
from fibrefit.core.paths import name_of_several, nearest_file, read_plain_file, sha256_of, shown_path
from fibrefit.core.units import Scale, uncertain
from fibrefit.study.overrides import apply_overrides
from fibrefit.study.parameters import NormalPrior, ParameterTable
from fibrefit.study.quantity import field_unit, quoted
from fibrefit.study.reading import ChannelTable
from fibrefit.study.rigs import study_type
from fibrefit.study.study import SCHEMA, Study
from fibrefit.study.table import KeyLocator, StudyTable, misspelling_hint, misspelt_key, study_error

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
#: The law whose gain stands for the scale of a channel; of a force that drives, that between it and the mass.
GAINS = {"force": "sensor.force_gain", "position": "sensor.position_gain"}
PUSHING = "push.force_gain"


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
    if os.path.isdir(source):
        source = source / "study.toml"
    near = "" if os.path.isfile(source) else nearest_file(source, ".toml")
    data = read_plain_file(source, "a study file", StudyError, near, LARGEST_STUDY)
    try:
        text = data.decode("utf-8-sig")
        if _DEEP.search(text):
            raise RecursionError
        raw = tomllib.loads(text.replace("\r\n", "\n"))
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise StudyError(
            f"{source}, line {line}", "not UTF-8", "text in UTF-8", "Save it with that encoding."
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(source, str(error), text) from None
    except ValueError:  # of an integer that Python does not read
        raise StudyError(str(source), "a number of thousands of digits", "numbers a person can read", "") from None
    except RecursionError:
        raise StudyError(str(source), "nested too deeply", "a study file", "") from None
    return _study(raw, source, overrides, "all" if all_missing else "some" if some_missing else "none")


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


def _syntax_error(path: Path, said: str, text: str) -> StudyError:
    """What is wrong with a text that is not TOML, and how the line is meant to be written."""
    found = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)", said)
    if found is None:
        return StudyError(str(path), said, "TOML", "")
    lines = text.splitlines() or [""]
    line = lines[min(int(found[1] or len(lines)), len(lines)) - 1]
    column = f", column {found[2]}" if found[2] else ""
    where, said = f"{path}, line {found[1] or text.count(chr(10)) + 1}{column}", said[: found.start()]
    remedies = {"Cannot": "A key or table is given twice.", "Invalid value": "Text and quantities stand in quotes."}
    do = next((remedy for start, remedy in remedies.items() if said.startswith(start)), "")
    if _RECORD.fullmatch(line) and said.startswith("Cannot"):
        do = "Write [[records]], in double brackets, above each record."
    elif bare := _BARE_VALUE.fullmatch(line):
        inside = re.fullmatch(r"\[(.*)\]", bare["value"])
        texts = [text.strip() for text in inside[1].split(", ")] if inside else [bare["value"]]
        if all(map(_UNQUOTED.fullmatch, texts)):
            # What stands in quotes is written with a decimal point.
            value = ", ".join('"' + re.sub(r"^([+-]?\d+),(?=\d)", r"\1.", text) + '"' for text in texts)
            do = f"Write it in quotes: {bare['key']} = {f'[{value}]' if inside else value}"
    return StudyError(where, f"not TOML: {said}", "", do)


def _study(raw: dict[str, Any], source: Path, overrides: Sequence[str], missing: Missing = "none") -> Study:
    """Study from the content of a file and the changes to it, of which files of records may be missing."""
    _name_parameters(raw, source)
    table = _read_table(raw, source)
    changed = apply_overrides(raw, overrides)
    table = _read_table(raw, source) or table
    # A constant with an uncertainty, "3.1 +/- 0.05 kg", is a parameter with that prior; what is said of it stands.
    rig, parameters = raw.get("rig"), raw.get("parameters", {})
    for key, said in list(rig.items()) if isinstance(rig, dict) and isinstance(parameters, dict) else ():
        if (parts := uncertain(said)) is not None:
            raw["rig"][key] = parts[0] if " " in parts[0] else float(parts[0])
            named = raw.setdefault("parameters", parameters).setdefault(key, {})
            if isinstance(named, dict):
                named.update({"initial": parts[0], "prior": said} | named)
    locate = KeyLocator(source, table, changed)
    kind = _kind_of_study(raw, locate)
    try:
        study = kind.model_validate(raw)
    except ValidationError as error:
        raise study_error(error, raw, locate, lambda key: _where_it_belongs(key, kind)) from None
    with Mistakes(locate("")) as mistakes:
        study = study.model_copy(update={"records": _completed(study, locate, mistakes)})
        with mistakes.collect():
            study = _with_scale_parameters(study, locate)
        study._source, study._table, study._locate = source, table, locate
        study.digests.update({path: sha256_of(path) for path in (source, table) if path and os.path.isfile(path)})
        study.check(mistakes)
        _check_files(study, locate, missing, mistakes)
    return study


def _read_table(raw: dict[str, Any], source: Path) -> Path | None:
    """Put the rows of a table in place of its name; the table's path, or None where the study has none."""
    if not isinstance(raw.get("records"), str):
        return None
    table = source.parent / raw["records"]
    raw["records"] = read_series(table)
    return table


_HEADER = re.compile(r"\s*(?P<key>[^\[(]+?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_DECIMAL = re.compile(r"[+-]?\d*[.,]\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_NAMES = ("file", "name")
DIMENSIONLESS = ("gain",)
"""What is stated of records and has no unit: a study writes it without quotes."""


def read_series(path: Path) -> list[dict[str, str | float]]:
    """Records of a table, as ``[[records]]`` would give them.

    Parameters
    ----------
    path : pathlib.Path
        File with a header such as ``file,lift [mm],inclination [deg]``, separated by comma, semicolon or tab.

    Returns
    -------
    list of dict
        Key to text with its unit, one for each row, and to a number where it has none by nature; empty cells are left
        out.

    Raises
    ------
    StudyError
        If it cannot be read, has no column ``file`` or ``name``, names a column twice, or a row has another length.
    """
    rows = _rows(path)
    (line, header), body = rows[0], rows[1:]
    columns = []
    for cell in header:
        if (match := _HEADER.fullmatch(cell)) is None:
            raise StudyError(str(path), f'column "{cell}"', 'a name and its unit, such as "lift [mm]"', "")
        columns.append((match["key"], match["unit"] or ""))
    names = [key for key, _ in columns]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise StudyError(f"{path}, line {line}", f'column "{twice}" twice', "each column once", "")
    if not set(_NAMES) & set(names):
        raise StudyError(f"{path}, line {line}", 'no column "file"', "file, and conditions with their unit", "")
    if not body:
        raise StudyError(str(path), "no rows", "one row a record", "")
    records: list[dict[str, str | float]] = []
    for line, row in body:
        if len(row) != len(columns):
            raise StudyError(f"{path}, line {line}", f"{len(row)} cells", f"{len(columns)}, as in the header", "")
        records.append({key: f"{cell} {unit}".strip() for (key, unit), cell in zip(columns, row, strict=True) if cell})
        # What is a pure number a study writes without quotes.
        for (key, unit), cell in zip(columns, row, strict=True):
            if cell and key in DIMENSIONLESS and unit in ("", "-", "1"):
                with suppress(ValueError):
                    records[-1][key] = float(cell)
    return records


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of every line that is not empty, with decimal points."""
    try:
        text = read_plain_file(path, "a table of records", StudyError, most=LARGEST_STUDY).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise StudyError(str(path), "not UTF-8", "text in UTF-8", "Save it with that encoding.") from None
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise StudyError(str(path), "empty", "a header and one row a record", "")
    delimiter = max("\t;,", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise StudyError(f"{path}, line {reader.line_num}", str(error), "a table of cells", "") from None
    # Commas are decimal ones where none stands between cells, no number has a point, and not all may part thousands.
    names = {i for i, cell in enumerate(rows[0][1]) if cell in _NAMES}
    cells = {cell for _, row in rows[1:] for i, cell in enumerate(row) if i not in names}
    numbers = {cell for cell in cells if _DECIMAL.fullmatch(cell)}
    if delimiter == "," or all(map(_THOUSANDS.fullmatch, numbers)) or any("." in number for number in numbers):
        return rows
    return [
        (line, [cell.replace(",", ".") if cell in numbers and i not in names else cell for i, cell in enumerate(row)])
        for line, row in rows
    ]


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


def _with_scale_parameters(study: Study, locate: KeyLocator) -> Study:
    """Study with a gain, one within the relative uncertainty of the scale, for each channel whose scale is uncertain.

    What the study itself says of the gain stands. No law stands for the uncertainty of another channel, or of one
    record alone.
    """

    def relative_error(said: Any) -> float:
        scale = said.scale if isinstance(said, ChannelTable) else None
        return 0.0 if scale is None else Scale.parse(scale, "scale").relative_error

    found = {role: error for role, said in study.channels if (error := relative_error(said))}
    for i, record in enumerate(study.records):
        for role, said in (record.channels or {}).items():
            if (error := relative_error(said)) and found.get(role) != error:
                do = "State the scale with its uncertainty under [channels]: it is one gain for all records."
                raise StudyError(locate(f"records[{i}].channels.{role}"), "an uncertainty of one record alone", "", do)
    for role in found:
        if role not in GAINS:
            where = locate(f"channels.{role}.scale")
            raise StudyError(where, "an uncertainty", f"it for {' or '.join(GAINS)} only", "Leave it out.")
    effects, parameters = list(study.model.effects), dict(study.parameters)
    for role, error in found.items():
        gain = PUSHING if role == "force" and study.driven_by_force else GAINS[role]
        effects += [] if gain in effects else [gain]
        prior = NormalPrior(kind="normal", mean=1.0, sd=error)
        parameters.setdefault(f"{gain}.gain", ParameterTable(initial=1.0, prior=prior))
    if len(effects) == len(study.model.effects) and parameters == study.parameters:
        return study
    model = study.model.model_copy(update={"effects": tuple(effects)})
    return study.model_copy(update={"model": model, "parameters": parameters})


def _kind_of_study(raw: dict[str, Any], locate: KeyLocator) -> type[Study]:
    """Model of the study for its kind of rig."""
    rig = raw.get("rig")
    expected = ", ".join(f'"{name}"' for name in KINDS)
    if not isinstance(rig, dict):
        if "rig" not in raw and (meant := misspelt_key("rig", raw, Study.known_keys())):
            raise StudyError(locate(meant), "unknown key", "[rig]", 'Did you mean "rig"?')
        got = "a list" if isinstance(rig, list) else "no table [rig]" if rig is None else quoted(rig)
        table = f"[rig] with kind = one of {expected}"
        raise StudyError(locate("rig" if "rig" in raw else ""), got, table, "")
    kind = rig.get("kind")
    if isinstance(kind, str) and kind in KINDS:
        return study_type(kind)
    if kind is None:
        do = misspelling_hint("kind", rig, KINDS)
        raise StudyError(locate("rig"), "no kind of rig", f"kind = one of {expected}", do)
    raise StudyError(locate("rig.kind"), quoted(kind), f"one of {expected}", did_you_mean(str(kind), KINDS))


def _completed(study: Study, locate: KeyLocator, mistakes: Mistakes) -> tuple[Any, ...]:
    """Records with the constants of the rig that they do not override.

    What a record still needs is a mistake, and so is a constant that was set for this run and that no record takes.
    """
    fields = type(study.records[0]).model_fields if study.records else {}
    constants = {key: getattr(study.rig, key) for key in type(study.rig).model_fields if key in fields}
    records, lacking = [], set[str]()
    for i, record in enumerate(study.records):
        absent = {key: value for key, value in constants.items() if getattr(record, key) is None}
        for key, value in absent.items():
            if value is None and key in type(record).needed() and key not in lacking:
                unit, do = field_unit(fields[key]), ""
                example = unit.example if unit else ""
                if own := [j for j, other in enumerate(study.records) if getattr(other, key) is not None]:
                    names = [f"records[{j}]" if locate.table is None else f"record {j + 1}" for j in own]
                    counted = f"{len(own)} of {len(study.records)} records"
                    those = counted if own[_RECORDS_NAMED:] else in_words(names)
                    do = f"It stands in {those} alone. "
                do += f'Write {key} = "{example}" {"under [rig]" if do else "there"}, or --set rig.{key}="{example}".'
                mistakes.note(StudyError(locate(f"records[{i}]"), f"no {key}", "it here or under [rig]", do))
                lacking.add(key)
        records.append(record.model_copy(update=absent))
    for key, value in constants.items():
        own_values = [getattr(record, key) for record in study.records]
        set_here = f"rig.{key}" in locate.changed
        if set_here and None not in own_values and any(one != value for one in own_values):
            got, do = f"set for the rig, and each record states its own {key}", f"Set it there: records[0].{key}=..."
            mistakes.note(StudyError(locate(f"rig.{key}"), got, "a value that some record takes", do))
    return tuple(records)


def _check_files(study: Study, locate: KeyLocator, may_be: Missing, mistakes: Mistakes) -> None:
    """Note records without a file where one is named; where some may be missing, only if all are."""
    if may_be == "all":
        return
    missing: dict[int, list[str]] = {}
    for i, record in enumerate(study.records):
        for file in (*record.files, *((record.header,) if record.header else ())):
            if not os.path.isfile(study.path_of(file)):
                missing.setdefault(i, []).append(file)
    if may_be == "some" and len(missing) < len(study.records):
        return
    for i, file in ((i, file) for i, files in missing.items() for file in dict.fromkeys(files)):
        path, where = study.path_of(file), locate(f"records[{i}].file")
        folder = path.parent
        do = ""
        if "\0" in file or len(path.name.encode(errors="replace")) > _LONGEST_NAME:
            got, expected = f'"{shown_path(file)}"', "a name that a file can have"
        elif not os.path.isdir(folder):
            got, expected = f'no folder for "{shown_path(file)}"', f"{shown_path(folder)} to exist"
        elif os.path.exists(path):
            got = f'"{file}" is {"a folder" if os.path.isdir(path) else "a device or a pipe"}'
            expected = "a file with measured data"
        elif not os.access(folder, os.X_OK):
            got, expected = f'"{file}" cannot be reached', f"leave to look into {shown_path(folder)}"
        else:
            got, expected = f'no file "{file}"', f"it in {folder.resolve()}"
            do = "" if mistakes.full else nearest_file(path)  # to look what a folder holds in its place takes long
        mistakes.note(StudyError(where, got, expected, do))


def _where_it_belongs(key: str, study: type[Study]) -> str:
    """Sentence on where a key or the name of a parameter belongs; empty where no table of a study knows it.

    Other kinds of rig are consulted only where this one does not know the key.
    """
    if key in study.base_parameters:
        return f"Write [parameters.{key}]."
    if places := [heading for heading, table in _tables(study) if key in table.known_keys()]:
        return f"It stands under {' or '.join(places)}."
    others = ((kind, study_type(kind)) for kind in KINDS)
    kinds = [kind for kind, other in others if any(key in table.known_keys() for _, table in _tables(other))]
    return f"It is a key of {' and '.join(kinds)}." if kinds else ""


def _tables(study: type[Study]) -> Iterator[tuple[str, type[StudyTable]]]:
    """Each table of a study with its heading; what holds further tables only is none."""
    headings = {"records": "[[records]]", "parameters": "[parameters.NAME]"}
    for name, field in study.model_fields.items():
        parts = [field.annotation]
        while parts:
            part = parts.pop(0)
            if isinstance(part, type) and issubclass(part, StudyTable):
                yield headings.get(name, f"[{name}]"), part
            parts = [*get_args(part), *parts]


PACKAGE = Path(__file__).resolve().parents[1]

#: Where the studies that ship with the program are: in an installed package, and beside it in a checkout.
SHIPPED = (PACKAGE / "shipped_studies", PACKAGE.parent / "configs")


def examples() -> tuple[str, ...]:
    """Names of the studies that ship with the program.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> "drop_series" in fibrefit.examples()
    True
    """
    return tuple(sorted(file.parent.name for file in _shipped().glob("*/study.toml")))


def example(name: str) -> Path:
    """Folder of a study that ships with the program, with its records.

    Parameters
    ----------
    name : str
        Such as ``"drop_series"``; `examples` lists them.

    Returns
    -------
    pathlib.Path
        To be given to whatever takes a study. Files there are part of the program: copy the folder to change them.

    Raises
    ------
    UsageError
        If there is no such example.

    Examples
    --------
    >>> fibrefit.load_study(fibrefit.example("drop_series")).name
    'drop series, vertical and 45 degrees'
    """
    known = examples()
    if name not in known:
        raise UsageError(f'example "{name}"', "not known", f"one of {', '.join(known)}", did_you_mean(name, known))
    return _shipped() / name


def _shipped() -> Path:
    return next((folder for folder in SHIPPED if folder.is_dir()), SHIPPED[0])
