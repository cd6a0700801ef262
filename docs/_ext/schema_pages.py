"""The keys of a study and of results, as tables, from the JSON Schemas."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

#: Tables of a study, in the order in which a file has them: title, and what is said first.
TABLES = {
    "Rig": "`[rig]`: constants of the rig. A record may overrule them.",
    "Channels": "`[channels]`: which column holds which channel.",
    "Files": "`[files]`: what the files do not say of themselves.",
    "Model": "`[model]`: tension law and effects.",
    "ParameterTable": "`[parameters.NAME]`: of a parameter of the base model (`stiffness`) or of an effect "
    "(`guide.viscous_friction.viscous_coefficient`).",
    "Prior": "Priors of `[parameters.NAME]`.",
    "Noise": "`[noise]`: standard deviations, where they are known.",
    "Record": "`[[records]]`: one table a record.",
    "Sweep": "`[sweep]` of an inverted pendulum.",
}
BEGINNING = """# The study file

One TOML file says what was measured and what is fitted. Quantities are strings with a unit, such as `"599 mm"`; a bare
number where a unit is needed is refused. `--set rig.weight_mass="3.1 kg"` changes any key for one run. These tables are
made from `data_schemas/study.schema.json`, which an editor can use to complete and check a study.

"""


def study_page(schema: Path) -> str:
    """Page of all keys of a study."""
    loaded = json.loads(schema.read_text(encoding="utf-8"))
    kinds, lines, shown = loaded["$defs"], [BEGINNING], set()
    lines += ["## At the top\n"]
    for reference in loaded["anyOf"]:
        lines += _section(kinds, reference["$ref"].rpartition("/")[2], shown)
    for ending, says in TABLES.items():
        found = [name for name in kinds if _belongs(name, ending) and name not in shown]
        if found:
            lines.append(f"## {says.split(':')[0].rstrip('.')}\n\n{says}\n")
        for name in found:
            lines += _section(kinds, name, shown)
    rest = [name for name in kinds if name not in shown]
    if rest:
        lines.append("## Tables inside others\n")
        for name in rest:
            lines += _section(kinds, name, shown)
    return "\n".join(lines)


def _belongs(name: str, ending: str) -> bool:
    if ending in ("Channels", "Noise", "Sweep"):
        return ending in name or (ending == "Channels" and name.endswith("Channel"))
    return name.endswith(ending)


def _section(kinds: dict[str, Any], name: str, shown: set[str]) -> list[str]:
    shown.add(name)
    kind = kinds[name]
    lines = [f"({_anchor(name)})=", f"### {name}", "", _escaped(kind.get("description", "")), ""]
    required = set(kind.get("required", ()))
    if kind.get("properties"):
        lines += ["| key | value | default | says |", "|---|---|---|---|"]
        for key, rule in kind["properties"].items():
            default = "**required**" if key in required else _default(rule)
            lines.append(f"| `{key}` | {_value(rule)} | {default} | {_escaped(_said(rule))} |")
        lines.append("")
    elif isinstance(inner := kind.get("additionalProperties"), dict):
        lines += [f"A table of names, each with {_value(inner)}.", ""]
    return lines


def _anchor(name: str) -> str:
    return f"study-{name.lower()}"


def _said(rule: dict[str, Any]) -> str:
    examples = ", ".join(f"`{json.dumps(example, ensure_ascii=False)}`" for example in rule.get("examples", ()))
    said = rule.get("description", "")
    return f"{said} Such as {examples}." if examples else said


def _default(rule: dict[str, Any]) -> str:
    if "const" in rule:
        return ""
    value = rule.get("default")
    return "" if value is None or value == {} or value == [] else f"`{json.dumps(value, ensure_ascii=False)}`"


def _value(rule: dict[str, Any]) -> str:
    """What may stand there, in a few words."""
    if "$ref" in rule:
        name = rule["$ref"].rpartition("/")[2]
        return f"[{name}](#{_anchor(name)})"
    if "const" in rule:
        return f"`{json.dumps(rule['const'])}`"
    if "enum" in rule:
        return " or ".join(f"`{json.dumps(word)}`" for word in rule["enum"])
    for word in ("anyOf", "oneOf"):
        if word in rule:
            said = [_value(other) for other in rule[word] if other.get("type") != "null"]
            return " or ".join(dict.fromkeys(said))
    if "x-unit" in rule:
        return f"quantity in {rule['x-unit']}" if rule["x-unit"] not in ("", "-", "1") else "quantity"
    kind = rule.get("type", "anything")
    if kind == "array":
        inside = [_value(item) for item in rule.get("prefixItems", ())] or [_value(rule.get("items", {}))]
        return f"list of {', '.join(dict.fromkeys(inside))}"
    if kind == "object":
        inner = rule.get("additionalProperties")
        return f"table of {_value(inner)}" if isinstance(inner, dict) and inner else "table"
    return {"string": "text", "number": "number", "integer": "whole number", "boolean": "true or false"}.get(kind, kind)


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "\\<").replace("$", "\\$")


def result_page(folder: Path) -> str:
    """Page that lists what each kind of ``summary.json`` holds at its top."""
    lines = [
        "# Files of a result",
        "",
        "A result is a folder: `summary.json` for programs, `result.h5` with everything (HDF5, groups named as ArviZ "
        "names them), `figures/`, and `study.toml`: the study it was made from, of `discover` and `series` the final "
        "model with its values. `plan`, `distinguish` and `batch` have neither of the two. The schemas in "
        "`data_schemas/` hold all of `summary.json`; these are its topmost keys.",
        "",
    ]
    for path in sorted(folder.glob("*.schema.json")):
        if path.name == "study.schema.json":
            continue
        loaded = json.loads(path.read_text(encoding="utf-8"))
        if "properties" not in loaded and "$ref" in loaded:
            loaded = loaded["$defs"][loaded["$ref"].rpartition("/")[2]]
        lines += [f"## {path.name.partition('.')[0]}", "", _escaped(loaded.get("description", "")), ""]
        lines += ["| key | says |", "|---|---|"]
        lines += [
            f"| `{key}` | {_escaped(rule.get('description', ''))} |" for key, rule in loaded["properties"].items()
        ]
        lines.append("")
    return "\n".join(lines)
