"""``--set key=value``: changing a study without editing its file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

from fibrefit.core.errors import Mistakes, StudyError, UsageError
from fibrefit.study.explain import key_text
from fibrefit.study.parameters import ParameterTable
from fibrefit.study.places import Places

_PART = re.compile(r'"([^"]+)"|\[(\d{1,9})\]|([^.\[\]"]+)')


def apply_overrides(raw: dict[str, Any], overrides: Sequence[str]) -> dict[str, str]:
    """Change `raw` as the overrides say.

    Parameters
    ----------
    raw : dict
        Content of a study file, changed in place.
    overrides : sequence of str
        ``key=value`` each; the value is TOML where it can be read as TOML, text otherwise.

    Returns
    -------
    dict of str to str
        The key path of each change, as messages write it, to the override it came from.

    Raises
    ------
    UsageError
        If an override is not of the form ``key=value``.
    StudyError
        If its key leads through something that is not a table.
    """
    changed = {}
    for override in overrides:
        keys, value = parse(override)
        _put(raw, keys, value, f"--set {override}")
        changed[key_text(keys)] = f"--set {override}"
    return changed


def parse(override: str) -> tuple[list[str | int], Any]:
    """Keys and value of one override.

    Parameters
    ----------
    override : str
        ``key=value``.

    Returns
    -------
    keys : list of str or int
        Path into the study; a parameter's dotted name is one key.
    value : object
        What TOML makes of the value, or its text.

    Raises
    ------
    UsageError
        If it has no ``=``, or a key that cannot be read.
    """
    path, separator, text = override.partition("=")
    path = path.strip()
    spelt = "".join(match.group(0) + "." for match in _PART.finditer(path)).rstrip(".").replace(".[", "[")
    if not separator or not path or spelt != path:
        raise UsageError(
            f"--set {override}", "not understood", "key=value", 'For example --set rig.weight_mass="3 kg".'
        )
    keys, value = [_key(match) for match in _PART.finditer(path)], _value(text.strip())
    return _parameter_name_joined(keys, _is_table_of_parameter(value)), value


def _key(match: re.Match[str]) -> str | int:
    quoted, index, plain = match.groups()
    return int(index) if index else quoted or plain.strip()


def _value(text: str) -> Any:
    try:
        read = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):  # not TOML, or a number of thousands of digits
        return text
    return read["value"] if list(read) == ["value"] else text


def _is_table_of_parameter(value: Any) -> bool:
    return isinstance(value, dict) and bool(value) and value.keys() <= set(ParameterTable.known_keys())


def _parameter_name_joined(keys: list[str | int], whole: bool) -> list[str | int]:
    """Path with the dotted name of an effect's parameter as one key; `whole` where its whole table may be given."""
    if keys[0] != "parameters" or len(keys) < 3:
        return keys
    known = ParameterTable.known_keys()
    unless_known = len(keys) if whole else len(keys) - 1
    end = next((i for i, key in enumerate(keys) if i > 1 and key in known), unless_known)
    return [keys[0], ".".join(map(str, keys[1:end])), *keys[end:]]


def _put(raw: Any, keys: list[str | int], value: Any, where: str) -> None:
    """Put `value` at the path `keys`, making tables that are not there yet."""
    for depth, key in enumerate(keys):
        last = depth == len(keys) - 1
        if isinstance(key, int) and isinstance(raw, list):
            if key >= len(raw):
                raise StudyError(where, f"no {key_text(keys[: depth + 1])}", f"an index below {len(raw)}", "")
        elif isinstance(key, int) or not isinstance(raw, dict):
            got = f"{key_text(keys[:depth])} is not a {'list' if isinstance(key, int) else 'table'}"
            raise StudyError(where, got, "a key of the study file", "Records are counted from 0: records[0].lift.")
        if last:
            raw[key] = value
            return
        raw = _inside(raw, key, a_channel=depth == 1 and keys[0] == "channels")


def _inside(raw: Any, key: str | int, a_channel: bool) -> Any:
    """What stands under a key, made where nothing does; of a channel that is a heading alone the table that says it."""
    if isinstance(raw, dict) and (key not in raw or (a_channel and isinstance(raw[key], str))):
        raw[key] = {"column": raw[key]} if key in raw else {}
    return raw[key]


def note_unused(key: str, value: Any, records: Sequence[Any], place: Places, mistakes: Mistakes) -> None:
    """Note a constant of the rig that was set for this run, and that no record takes: each has a value of its own."""
    own = [getattr(record, key) for record in records]
    if f"rig.{key}" in place.changed and None not in own and any(one != value for one in own):
        got, do = f"set for the rig, and each record states its own {key}", f"Set it there: records[0].{key}=..."
        mistakes.note(StudyError(place(f"rig.{key}"), got, "a value that some record takes", do))
