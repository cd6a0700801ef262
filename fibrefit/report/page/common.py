"""Parts that the pages of several kinds of results share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fibrefit.core.units import format_quantity, shown_unit
from fibrefit.report.any import report_of
from fibrefit.report.checks import failure, quantity_of
from fibrefit.report.page.blocks import Block, Hidden, TableBlock
from fibrefit.report.text import parameter_row
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.summaries import FitResultSummary, Gap, ParameterSummary, Provenance

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
        then = "" if before is None or name not in before else _like(before[name], found)
        rows.append((label, *(() if before is None else (then,)), value, error, unit, interval))
    rest = ("standard error", "unit", "95 % interval")
    if before is None:
        return TableBlock("Parameters", ("parameter", "value", *rest), rows, frozenset({1, 2}))
    return TableBlock(
        "What it does to the parameters", ("parameter", "before", "after", *rest), rows, frozenset({1, 2, 3})
    )


def _like(then: ParameterSummary, now: ParameterSummary) -> str:
    """An earlier value in the unit of the later one."""
    worth = shown_unit(now.value if now.value else now.std_error or 0.0, now.unit)[1]
    return f"{then.value / worth:.4g}"


def between_note(summary: FitResultSummary) -> str:
    """How much records differ, in a sentence; empty where nothing was asked."""
    differ = [
        f"{name} by {100 * one.sd:.2g} % ({100 * one.interval_95[0]:.2g} to {100 * one.interval_95[1]:.2g} %)"
        for name, one in summary.between_records.items()
        if one.interval_95[0] > 0.0
    ]
    if differ:
        return f"Records differ beyond their errors: {', '.join(differ)}; the values are means of the population."
    return "Records do not differ beyond their errors." if summary.between_records else ""


def gaps_table(after: Mapping[str, Gap], whole: Gap, before: Mapping[str, Gap] | None, first: Gap | None) -> TableBlock:
    """Gap of each record and channel, worst first, with that of the first model where there is one."""
    channels = list(whole.channels)
    names = sorted(after, key=lambda name: -((before or after)[name].total or 0.0))
    rows = [(name, *_ratios((before or {}).get(name), after[name], channels)) for name in names]
    rows.append(("all records", *_ratios(first, whole, channels)))
    head = ("record", *(f"{channel}" for channel in channels), "all channels")
    note = "Gap: RMS of measured minus simulated over the RMS of the noise; 1 is expected of a right model."
    columns = frozenset(range(1, len(head)))
    return TableBlock(
        "The gap of each record" if first is None else "The gap before and after", head, rows, columns, note
    )


def _ratios(before: Gap | None, after: Gap, channels: Sequence[str]) -> list[str]:
    now = [after.channels[channel].ratio if channel in after.channels else None for channel in channels]
    then = [before.channels[channel].ratio if before else None for channel in channels]
    pairs = [*zip(then, now, strict=True), (before.total if before else None, after.total)]
    return [changed(one, other) for one, other in pairs]


def changed(before: float | None, after: float | None) -> str:
    """``3.61 → 1.02``; the later number alone where there is no earlier one."""
    if after is None:
        return ""
    return f"{after:.2f}" if before is None else f"{before:.2f}{ARROW}{after:.2f}"


def told_gap(gap: Gap) -> str:
    """Gap of each channel in a line: ``force 1.02 (0.42 N), position 0.98 (21 um)``."""
    return ", ".join(
        f"{name} {one.ratio:.2f} ({format_quantity(one.rms, one.unit, 2)})"
        for name, one in gap.channels.items()
        if one.ratio is not None
    )


def in_full(summary: Part) -> list[Block]:
    """The terminal report, all checks, and where the result comes from: what opens when it is asked for."""
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
