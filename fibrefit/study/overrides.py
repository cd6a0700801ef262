"""``--set key=value``: changing a study without editing its file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.study.parameters import ParameterTable
from fibrefit.study.table import key_text

_PART = re.compile(r'"([^"]+)"|\[(\d{1,9})\]|([^.\[\]"]+)')


def apply_overrides(raw: dict[str, Any], overrides: Sequence[str]) -> dict[str, str]:
    """Change `raw` as the overrides say, making tables that are not there yet.

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
        where, inside = f"--set {override}", raw
        for depth, key in enumerate(keys):
            if isinstance(key, int) and isinstance(inside, list):
                if key >= len(inside):
                    raise StudyError(where, f"no {key_text(keys[: depth + 1])}", f"an index below {len(inside)}", "")
            elif isinstance(key, int) or not isinstance(inside, dict):
                got = f"{key_text(keys[:depth])} is not a {'list' if isinstance(key, int) else 'table'}"
                raise StudyError(where, got, "a key of the study file", "Records are counted from 0: records[0].lift.")
            if depth == len(keys) - 1:
                inside[key] = value
                break
            if isinstance(inside, dict):
                inside.setdefault(key, {})
                if keys[:depth] == ["channels"] and isinstance(inside[key], str):
                    inside[key] = {"column": inside[key]}  # a heading alone becomes the table that says it
            inside = inside[key]
        changed[key_text(keys)] = where
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
    path, text = path.strip(), text.strip()
    parts = list(_PART.finditer(path))
    spelt = "".join(match.group(0) + "." for match in parts).rstrip(".").replace(".[", "[")
    if not separator or not path or spelt != path:
        do = 'For example --set rig.weight_mass="3 kg".'
        raise UsageError(f"--set {override}", "not understood", "key=value", do)
    keys = [int(index) if index else quoted or plain.strip() for quoted, index, plain in (m.groups() for m in parts)]
    value: Any = text
    try:
        read = tomllib.loads(f"value = {text}")
        value = read["value"] if list(read) == ["value"] else text
    except (ValueError, RecursionError):  # not TOML, or a number of thousands of digits
        pass
    if keys[0] == "parameters" and len(keys) > 2:
        # The dotted name of an effect's parameter is one key, up to a key of its table; a whole table has none.
        known = ParameterTable.known_keys()
        whole = isinstance(value, dict) and bool(value) and value.keys() <= set(known)
        end = next((i for i, key in enumerate(keys) if i > 1 and key in known), len(keys) if whole else len(keys) - 1)
        keys = [keys[0], ".".join(map(str, keys[1:end])), *keys[end:]]
    return keys, value
