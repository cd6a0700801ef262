"""Parts that the pages of several kinds of results share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from fibrefit.core.formatting import format_quantity, typeset_unit
from fibrefit.report.any import report_of
from fibrefit.report.checks import failure, notes_on_records, quantity_of
from fibrefit.report.page.blocks import Block, Hidden, PageContent, Pictures, Result, TableBlock, Words
from fibrefit.report.text import (
    ABOUT_RECORDS,
    GAP,
    conditions_told,
    earlier_value,
    parameter_row,
    population_sentence,
    said_of_values,
    size_of,
)
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import (
    FitResultSummary,
    Gap,
    ParameterSummary,
    PredictionSummary,
    Provenance,
    RecordSummary,
)

ARROW = " \N{RIGHTWARDS ARROW} "


def failed_checks(checks: Sequence[Check]) -> list[str]:
    """Checks that were not passed, in sentences."""
    return [failure(check) for check in checks if not check.passed]


def checks_table(checks: Sequence[Check]) -> TableBlock:
    """Every check with what it says, those that failed first."""
    ordered = sorted(checks, key=lambda check: check.passed)
    rows = [
        (
            quantity_of(check),
            "passed" if check.passed else "FAILED" if check.about == "numbers" else "MODEL",
            check.says,
        )
        for check in ordered
    ]
    return TableBlock("Checks", ("what was tested", "", "what was found"), rows)


def parameters_table(
    parameters: Mapping[str, ParameterSummary], before: Mapping[str, ParameterSummary] | None = None
) -> TableBlock:
    """Values with errors and intervals, and what they were before where there is a before."""
    rows = []
    for name, found in parameters.items():
        label, value, error, unit, interval = parameter_row(name, found)
        then = "" if before is None or name not in before else earlier_value(before[name], found, error)
        rows.append((label, *(() if before is None else (then,)), value, error, unit, interval))
    rest, note = ("standard error", "unit", "95 % interval"), population_sentence(parameters)
    if before is None:
        return TableBlock("Parameters", ("parameter", "value", *rest), rows, frozenset({1, 2}), note)
    return TableBlock(
        "What it does to the parameters", ("parameter", "before", "after", *rest), rows, frozenset({1, 2, 3}), note
    )


def values_tables(summary: FitResultSummary, before: Mapping[str, ParameterSummary] | None = None) -> list[TableBlock]:
    """Tables of shared values, with what is said of them, and of those that each record has for itself."""
    table = replace(parameters_table(summary.parameters, before), note=" ".join(said_of_values(summary)))
    return [table, *(own_table(name, summary.records) for name in summary.own_parameters)]


def own_table(name: str, records: Mapping[str, RecordSummary]) -> TableBlock:
    """Values of a parameter that each record has for itself."""
    rows = [parameter_row(record, one.parameters[name]) for record, one in records.items() if name in one.parameters]
    head = ("record", "value", "standard error", "unit", "95 % interval")
    return TableBlock(f"{name} of each record", head, rows, frozenset({1, 2}))


def gaps_table(after: Mapping[str, Gap], whole: Gap, before: Mapping[str, Gap] | None, first: Gap | None) -> TableBlock:
    """Gap of each record and channel, worst first, with that of the first model where there is one."""
    channels = list(whole.channels)
    names = sorted(after, key=lambda name: -size_of((before or after)[name]))
    rows = [(name, *_ratios((before or {}).get(name), after[name], channels)) for name in names]
    rows.append(("all records", *_ratios(first, whole, channels)))
    head = ("record", *(f"{channel}" for channel in channels), "all channels")
    columns = frozenset(range(1, len(head)))
    return TableBlock(
        "The gap of each record" if first is None else "The gap before and after", head, rows, columns, GAP
    )


def records_table(records: Mapping[str, RecordSummary]) -> TableBlock | None:
    """Files of each record, and the conditions in which they differ; None where neither is known."""
    if not any(one.files or one.conditions for one in records.values()):
        return None
    alike, own = conditions_told(records)
    names = tuple(dict.fromkeys(name for of in own.values() for name in of))
    rows = [
        (record, ", ".join(one.files), *(_typeset(own[record].get(name, "")) for name in names))
        for record, one in records.items()
    ]
    return TableBlock(ABOUT_RECORDS, ("record", "file", *names), rows, note=_typeset(alike))


def _typeset(text: str) -> str:
    return typeset_unit(text.replace("+/-", "\N{PLUS-MINUS SIGN}"))


def _ratios(before: Gap | None, after: Gap, channels: Sequence[str]) -> list[str]:
    now = [after.ratio_of(channel) for channel in channels]
    then = [before.ratio_of(channel) if before else None for channel in channels]
    pairs = [*zip(then, now, strict=True), (before.total if before else None, after.total)]
    return [changed(one, other) for one, other in pairs]


def changed(before: float | None, after: float | None) -> str:
    """``3.61 → 1.02``; the later number alone where there is no earlier one."""
    if after is None:
        return ""
    return f"{after:.2f}" if before is None else f"{before:.2f}{ARROW}{after:.2f}"


def gap_line(gap: Gap) -> str:
    """Gap of each channel in a line: ``force 1.02 (0.42 N), position 0.98 (21 um)``."""
    return ", ".join(
        f"{name} {one.ratio:.2f} ({format_quantity(one.rms, one.unit, 2)})"
        for name, one in gap.channels.items()
        if one.ratio is not None
    )


def page_content(
    result: Result, blocks: Sequence[Block | None], verdict: str,
    opening: str = "", facts: Sequence[tuple[str, str]] = (), status: str = "",
) -> PageContent:  # fmt: skip
    """A result as it is shown: its own blocks, its pictures, and what opens on request; none is empty.

    Parameters
    ----------
    blocks : sequence of Block or None
        Those of its kind, in their order.
    verdict, opening, facts, status
        As of `PageContent`; the status is that of the summary unless said.
    """
    summary: Any = result.summary
    checks = getattr(summary, "checks", ())
    failed = failed_checks(checks)
    pictures = Pictures("Pictures", result.pictures) if result.pictures else None
    shown = [block for block in (*blocks, pictures, *in_full(summary)) if block is not None]
    return PageContent(
        kind=str(getattr(summary, "schema_name", "fibrefit/result")).split("/")[1].capitalize(),
        status=status or str(getattr(summary, "status", "suspect" if failed else "ok")),
        verdict=verdict,
        opening=opening,
        facts=facts,
        failed=failed,
        passed=sum(check.passed for check in checks),
        notes=notes_on_records(summary.records) if isinstance(summary, FitResultSummary | PredictionSummary) else (),
        blocks=[block for block in shown if not isinstance(block, Words) or block.paragraphs],
    )


def in_full(summary: Part) -> list[Block]:
    """The terminal report, all checks, and where the result comes from: what opens on request."""
    blocks: list[Block] = []
    if checks := getattr(summary, "checks", ()):
        blocks.append(Hidden("All checks", tables=(checks_table(checks),)))
    blocks.append(Hidden("The report of the terminal", report_of(summary)))
    if (origin := getattr(summary, "provenance", None)) is not None:
        blocks.append(origin_block(origin))
    return blocks


def origin_block(origin: Provenance) -> Hidden:
    """Study, files and versions a result rests on."""
    facts = [("made", origin.created), ("seed", str(origin.seed)), *origin.settings.items()]
    if origin.seconds is not None:
        facts.append(("seconds", f"{origin.seconds:.1f}"))
    tables = (
        TableBlock("Run", ("setting", "value"), facts),
        TableBlock("Files", ("file", "SHA-256"), list(origin.inputs.items())),
        TableBlock("Packages", ("package", "version"), list(origin.versions.items())),
    )
    return Hidden("Where it comes from: study, files, versions", origin.resolved_study, tables)
