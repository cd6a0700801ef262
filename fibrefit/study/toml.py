"""Writing TOML: the standard library reads it only."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from datetime import date, time
from typing import Any


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
