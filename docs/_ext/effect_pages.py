"""One page an effect: law, parameters, range, source, picture; all of it from the catalogue."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

PORTS = {
    "drive": "Drive",
    "fibre": "Fibre",
    "guide": "Guide",
    "pivot": "Pivot",
    "pulley": "Pulley",
    "push": "Measured force that pushes",
    "rig": "Rig",
    "sensor": "Sensors",
    "study": "Mistakes of a study",
}
_SECTION = re.compile(r"^(Law|Parameters|Valid range|Source)\n-+\n", re.MULTILINE)


def write_effects(folder: Path, write: Callable[[Path, str], None], with_pictures: bool = True) -> None:
    """Write the pages of all effects, with their pictures if they are wanted, and a page that lists them."""
    from fibrefit.laws.catalogue import CATALOGUE

    folder.mkdir(parents=True, exist_ok=True)
    effects = sorted(CATALOGUE.values(), key=lambda effect: (effect.name.partition(".")[0], effect.name))
    drawn = {effect.name for effect in effects if with_pictures and _drawn(effect, folder)}
    for effect in effects:
        write(folder / f"{_file(effect.name)}.md", _page(effect, effect.name in drawn))
    lines = [
        "# Effects",
        "",
        f"The {len(effects)} laws that can be added to a model, by the part of the rig they act on. "
        "`fibrefit effects NAME` prints the same page; "
        "[a law of your own](../../extending.md) is a small class in one file.",
        "",
    ]
    for port, group in groupby(effects, key=lambda effect: effect.name.partition(".")[0]):
        members = list(group)
        lines += [f"## {PORTS.get(port, port)}", "", "| effect | says |", "|---|---|"]
        lines += [f"| [{e.name}]({_file(e.name)}.md) | {_cell(_parts(e)[''])} |" for e in members]
        lines += ["", "```{toctree}", ":hidden:", "", *(_file(e.name) for e in members), "```", ""]
    write(folder / "index.md", "\n".join(lines))


def _file(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", name)


def _parts(effect: Any) -> dict[str, str]:
    """Sections of the docstring, with its code marks."""
    parts = _SECTION.split(inspect.cleandoc(effect.__doc__ or ""))
    titles, texts = ["", *parts[1::2]], parts[0::2]
    return {title: " ".join(text.split()) for title, text in zip(titles, texts, strict=True)}


def _plain(text: str) -> str:
    """Text as Markdown: what is not marked as code stands for itself."""
    pieces = re.split(r"(`+[^`]*`+)", text)
    return "".join(p if p.startswith("`") else re.sub(r"([\\*_$<\[\]])", r"\\\1", p) for p in pieces)


def _cell(text: str) -> str:
    return _plain(text).replace("|", "\\|")


def _page(effect: Any, has_picture: bool) -> str:
    from fibrefit.rigs.effects import effect_facts

    facts, parts = effect_facts(effect), _parts(effect)
    lines = [f"# {effect.name}", "", _plain(parts[""]), "", "## Law", "", _plain(parts.get("Law", "")), ""]
    lines += [
        "## Parameters",
        "",
        "| parameter | symbol | unit | typical | range | says |",
        "|---|---|---|---|---|---|",
    ]
    for one in facts["parameters"]:
        says = one["says"]
        if one["name"].rpartition(".")[2] in facts["strength"]:
            says += f"; without effect at {_number(one['null'])}"
        row = (f"`{one['name']}`", one["symbol"], one["unit"], _number(one["typical"]), _range(one), _cell(says))
        lines.append(f"| {' | '.join(row)} |")
    lines += ["", f"Rigs: {', '.join(f'`{rig}`' for rig in facts['rigs'])}.", ""]
    if facts["needs"]:
        lines += [f"Only together with {', '.join(f'`{name}`' for name in facts['needs'])}.", ""]
    if has_picture:
        lines += ["## Picture", "", f"![{effect.name} beside the base model]({_file(effect.name)}.png)", ""]
        lines += ["At its typical values, beside the base model.", ""]
    for title in ("Valid range", "Source"):
        if title in parts:
            lines += [f"## {title}", "", _plain(parts[title]), ""]
    lines += ["## In a study", "", "```toml", "[model]", f'effects = ["{effect.name}"]', "```", ""]
    return "\n".join(lines)


def _number(value: float | None) -> str:
    """A number in few digits; JSON has none for infinity."""
    return "infinity" if value is None else f"{value:g}"


def _range(one: dict[str, Any]) -> str:
    low, high = one["lower"], one["upper"]
    if low is None and high is None:
        return "any"
    return f"from {low:g}" if high is None else f"to {high:g}" if low is None else f"{low:g} to {high:g}"


def _drawn(effect: Any, folder: Path) -> bool:
    """Whether there is a picture of an effect; it is drawn unless it is there and newer than the law."""
    from fibrefit.rigs.effects import picture_of

    file, law = folder / f"{_file(effect.name)}.png", Path(inspect.getfile(effect))
    if file.is_file() and file.stat().st_mtime > law.stat().st_mtime:
        return True
    found = picture_of(effect)
    if found is None:
        return False
    _draw(found, file)
    return True


def _draw(found: Any, file: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(found.x, found.without, color="0.6", label="base model")
    axes.plot(found.x, found.with_it, color="C0", label="with the effect")
    axes.set(xlabel=found.across, ylabel=found.up)
    axes.legend(frameon=False)
    figure.savefig(file, dpi=100)
