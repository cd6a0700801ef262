"""JSON Schemas (2020-12) of every file a user writes or a program reads, made from the models."""

from __future__ import annotations

import functools
import json
import operator
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from fibrefit.core.declarations import KINDS
from fibrefit.study.rigs import study_type
from fibrefit.study.summaries.files import SUMMARIES

DIALECT = "https://json-schema.org/draft/2020-12/schema"

#: The folder of the schemas in a copy of the sources.
FOLDER = Path(__file__).resolve().parents[2] / "data_schemas"


def schemas() -> dict[str, dict[str, Any]]:
    """Every schema, by the name of its file.

    Returns
    -------
    dict of str to dict
        ``"study.schema.json"`` and so on, to the content.
    """
    kinds: TypeAdapter[Any] = TypeAdapter(functools.reduce(operator.or_, map(study_type, KINDS)))
    study = kinds.json_schema(by_alias=True, mode="validation")
    # The models', and the two other ways to write what they hold.
    table = {"$ref": "#/$defs/ParameterTable"}
    group = {"$ref": "#/$defs/ParameterGroup"}
    study["$defs"]["ParameterGroup"] = {
        "description": "The parts of an effect's dotted name, written as nested tables.",
        "type": "object",
        "minProperties": 1,
        "additionalProperties": {"anyOf": [table, group]},
    }
    series = {"type": "string", "description": "A table with one row a record and units in its header."}
    for name, definition in study["$defs"].items():
        if name.endswith("Study"):
            properties = definition["properties"]
            properties["parameters"]["additionalProperties"] = {"anyOf": [table, group]}
            properties["records"] = {"anyOf": [properties["records"], series]}
        elif name.endswith("Rig"):
            # A plain number is text where it has an uncertainty; a quantity is text anyhow.
            for described in definition["properties"].values():
                alternatives = described.get("anyOf", [])
                if any(each.get("type") == "number" for each in alternatives):
                    alternatives.insert(1, {"type": "string", "examples": ["1.02 +/- 0.01"]})
    _write_defaults_as_read(study)
    named = {"study": ("fibrefit/study/1", study)}
    for schema, model in SUMMARIES.items():
        named[schema.split("/")[1]] = (schema, model.model_json_schema(by_alias=True, mode="validation"))
    return {
        f"{name}.schema.json": {"$schema": DIALECT, "$id": f"{schema}.schema.json", **content}
        for name, (schema, content) in named.items()
    }


def _write_defaults_as_read(part: Any) -> None:
    """Defaults of quantities as text with their unit, as a study may hold them; none where absence is the default."""
    if isinstance(part, list):
        for one in part:
            _write_defaults_as_read(one)
    elif isinstance(part, dict):
        if "x-unit" in part and isinstance(default := part.get("default"), int | float):
            part["default"] = f"{default:g} {part['x-unit']}"
        elif part.get("type") == "string" and part.get("default", "") is None:
            del part["default"]
        for one in part.values():
            _write_defaults_as_read(one)


def write_schemas(folder: Path) -> None:
    """Write every schema into a folder, which is made if it does not exist."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in schemas().items():
        (folder / name).write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_schemas(FOLDER)
