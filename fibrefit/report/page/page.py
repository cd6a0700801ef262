"""One page of HTML that needs no other file: verdicts, numbers, words, records and figures of any number of results."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from fibrefit.core.environment import versions
from fibrefit.report.page.blocks import PageContent, Result, TableBlock
from fibrefit.report.page.kinds import page_of
from fibrefit.report.text import with_error
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import FitResultSummary, PosteriorSummary

ASSETS = Path(__file__).parent / "assets"
TEMPLATE = "page.html.j2"
STYLES = ("page.css", "view.css", "uPlot.min.css")
SCRIPTS = (
    "uPlot.iife.min.js",
    "unpack.js",
    "levels.js",
    "panels.js",
    "overlay.js",
    "states.js",
    "records.js",
    "items.js",
    "trends.js",
    "start.js",
)


def page(results: Sequence[Result], title: str) -> str:
    """HTML of all results, one below the other, with a table that sets their parameters side by side.

    Returns
    -------
    str
        A whole document; names of files and studies are escaped, and its browser is instructed to fetch nothing.
    """
    pages = [page_of(result) for result in results]
    script = _script(needed=any(_is_alive(one) for one in pages))
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(
            title=title,
            version=versions()["fibrefit"],
            made=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
            results=[
                {"number": number, "result": result, "page": one, "summary": _as_json(result.summary)}
                for number, (result, one) in enumerate(zip(results, pages, strict=True), 1)
            ],
            side_by_side=_side_by_side(results),
            style=Markup("\n".join(_read(name) for name in STYLES)),
            script=Markup(script),
            digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        )
    )


def _is_alive(page: PageContent) -> bool:
    return any(block.kind in ("records", "items") for block in page.blocks)


@lru_cache(maxsize=1)
def _environment() -> Environment:
    # Everything that comes from a file is escaped.
    made = Environment(
        loader=FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["json"] = lambda value: _inside_script(json.dumps(value, separators=(",", ":"), allow_nan=False))
    return made


def _inside_script(text: str) -> Markup:
    """JSON as it may stand within a script element, whatever names are in it."""
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def _as_json(summary: Part) -> Markup:
    return _inside_script(summary.model_dump_json(by_alias=True))


@lru_cache(maxsize=32)
def _read(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")


def _script(needed: bool) -> str:
    """All scripts, each in a scope of its own; uPlot only where there is something to draw."""
    names = SCRIPTS if needed else ("start.js",)
    parts = [_read(name) if name.startswith("uPlot") else f"(() => {{\n{_read(name)}}})();" for name in names]
    return "\n".join(["window.fibrefit = {};", *parts])


def _side_by_side(results: Sequence[Result]) -> TableBlock | None:
    """Value and error of every parameter that more than one result has; nothing where there is none."""
    columns = [_values(result.summary) for result in results]
    names = list(dict.fromkeys(n for column in columns for n in column))
    shared = [name for name in names if sum(name in column for column in columns) > 1]
    used = [i for i, column in enumerate(columns) if column]
    if not shared or len(used) < 2:
        return None
    head = ("parameter", *(f"{results[i].name} ({results[i].folder})" for i in used))
    rows = [(name, *(columns[i].get(name, "") for i in used)) for name in shared]
    return TableBlock("Side by side", head, rows, frozenset(range(1, len(used) + 1)))


def _values(summary: Part) -> dict[str, str]:
    found: dict[str, Any] = {}
    if isinstance(summary, FitResultSummary):
        found = {name: (one.value, one.std_error, one.unit) for name, one in summary.parameters.items()}
    elif isinstance(summary, PosteriorSummary):
        found = {name: (one.mean, one.sd, one.unit) for name, one in summary.parameters.items()}
    shown = {}
    for name, (value, error, unit) in found.items():
        text, wide, chosen = with_error(value, error, unit)
        shown[name] = f"{text}{f' ± {wide}' if wide else ''}{'' if chosen == '-' else f' {chosen}'}"
    return shown
