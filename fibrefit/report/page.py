"""One page of HTML that needs no other file: numbers, words and figures of any number of results."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from fibrefit.core.environment import versions
from fibrefit.report.any import report_of
from fibrefit.report.checks import quantity_of
from fibrefit.report.text import parameter_row, with_error
from fibrefit.study.summaries.summaries import BatchSummary, FitResultSummary, Part, PosteriorSummary, Provenance

TEMPLATE = "page.html.j2"


class Table(NamedTuple):
    """A table as it stands on the page.

    Parameters
    ----------
    caption : str
    head : tuple of str
    rows : sequence of tuple of str
    right : set of int
        Columns that are flush right.
    """

    caption: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    right: frozenset[int] = frozenset()


class Result(NamedTuple):
    """A result as it was read.

    Parameters
    ----------
    folder : str
    summary : Part
    figures : sequence of (str, bytes)
        Caption and PNG.
    """

    folder: str
    summary: Part
    figures: Sequence[tuple[str, bytes]]


def page(results: Sequence[Result], title: str) -> str:
    """HTML of all results, one below the other, with a table that sets their parameters side by side.

    Parameters
    ----------
    results : sequence of Result
    title : str

    Returns
    -------
    str
        A whole document; names of files and studies are escaped.
    """
    # Everything that comes from a file is escaped.
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(TEMPLATE).render(
        title=title,
        version=versions()["fibrefit"],
        made=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        results=[_shown(result) for result in results],
        side_by_side=_side_by_side(results),
    )


def _shown(result: Result) -> dict[str, Any]:
    summary = result.summary
    schema = str(getattr(summary, "schema_name", "")).split("/")
    figures = [{"caption": name, "content": base64.b64encode(png).decode()} for name, png in result.figures]
    return {
        "name": _name(summary),
        "kind": schema[1].capitalize() if len(schema) > 1 else "Result",
        "folder": result.folder,
        "status": getattr(summary, "status", "ok"),
        "tables": [table for table in (_parameters(summary), _checks(summary)) if table is not None],
        "text": report_of(summary),
        "figures": figures,
        "origin": _origin(getattr(summary, "provenance", None)),
    }


def _name(summary: Part) -> str:
    return str(getattr(summary, "study", None) or getattr(summary, "name", "result"))


def _parameters(summary: Part) -> Table | None:
    if isinstance(summary, FitResultSummary):
        rows = [parameter_row(name, found) for name, found in summary.parameters.items()]
        head = ("parameter", "value", "standard error", "unit", "95 % interval")
        return Table("Parameters", head, rows, frozenset({1, 2}))
    if isinstance(summary, PosteriorSummary):
        kind = f"{100 * summary.interval_probability:g} % interval"
        rows = []
        for name, known in summary.parameters.items():
            mean, sd, unit = with_error(known.mean, known.sd, known.unit)
            ends = " to ".join(with_error(end, known.sd, known.unit)[0] for end in known.interval)
            rows.append((name, mean, sd, "" if unit == "-" else unit, ends))
        return Table("Parameters", ("parameter", "mean", "sd", "unit", kind), rows, frozenset({1, 2}))
    if isinstance(summary, BatchSummary):
        rows = [(name, item.status or "not possible", item.error or "") for name, item in summary.items.items()]
        return Table("Items", ("item", "status", "why not"), rows)
    return None


def _checks(summary: Part) -> Table | None:
    checks = getattr(summary, "checks", ())
    if not checks:
        return None
    rows = [
        ("passed", check.name, check.says) if check.passed else ("FAILED", quantity_of(check), check.says)
        for check in checks
    ]
    return Table("Checks", ("", "check", "what it says"), rows)


def _origin(provenance: Provenance | None) -> dict[str, Any] | None:
    if provenance is None:
        return None
    tables = [
        Table("", ("file", "SHA-256"), list(provenance.inputs.items())),
        Table("", ("package", "version"), list(provenance.versions.items())),
    ]
    facts = [("made", provenance.created), ("seed", str(provenance.seed)), *provenance.settings.items()]
    return {"tables": [Table("", ("", ""), facts), *tables], "study": provenance.resolved_study}


def _side_by_side(results: Sequence[Result]) -> Table | None:
    """Value and error of every parameter that more than one result has; nothing where there is none."""
    columns = [_values(result.summary) for result in results]
    names = list(dict.fromkeys(n for column in columns for n in column))
    shared = [name for name in names if sum(name in column for column in columns) > 1]
    used = [i for i, column in enumerate(columns) if column]
    if not shared or len(used) < 2:
        return None
    head = ("parameter", *(f"{_name(results[i].summary)} ({results[i].folder})" for i in used))
    rows = [(name, *(columns[i].get(name, "") for i in used)) for name in shared]
    return Table("Side by side", head, rows, frozenset(range(1, len(used) + 1)))


def _values(summary: Part) -> dict[str, str]:
    if isinstance(summary, FitResultSummary):
        found = {name: (one.value, one.std_error, one.unit) for name, one in summary.parameters.items()}
    elif isinstance(summary, PosteriorSummary):
        found = {name: (one.mean, one.sd, one.unit) for name, one in summary.parameters.items()}
    else:
        return {}
    shown = {}
    for name, (value, error, unit) in found.items():
        text, wide, chosen = with_error(value, error, unit)
        shown[name] = f"{text}{f' ± {wide}' if wide else ''}{'' if chosen == '-' else f' {chosen}'}"
    return shown
