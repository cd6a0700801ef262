"""The terminal report of a sweep."""

from __future__ import annotations

from fibrefit.core.formatting import format_quantity
from fibrefit.report.checks import GLOSSARY, failures
from fibrefit.report.layout import items, paragraph, section, table, titled
from fibrefit.study.summaries.results import BranchSummary, CurveSummary, SweepSummary

BRANCHES = {"rest": "from rest", "up": "sweep up", "down": "sweep down"}
#: What the columns hold.
COLUMNS = paragraph(
    "amplitude: steady state; max |angle|: transient included; |mu|: largest Floquet multiplier (below 1: stable). "
    "from rest: started from rest at each frequency; sweep up, sweep down: continued from the frequency before."
)
NO_MORE = 4
"""Ranges or jumps listed of one branch; the rest are counted."""


def sweep_report(summary: SweepSummary) -> str:
    """Report of a sweep in at most 80 columns; no line break at its end."""
    seconds = summary.provenance.seconds if summary.provenance else None
    took = "" if seconds is None else f" in {seconds:.0f} s"
    first = (
        f"{summary.runs} runs at {summary.frequencies} frequencies from {summary.lowest_hz:g} to "
        f"{summary.highest_hz:g} Hz{took}."
    )
    parts = [titled(summary.study), paragraph(first)]
    parts += [_curve(name, curve) for name, curve in summary.curves.items()]
    parts += [section("What to doubt", failures(summary.checks)), f"{COLUMNS}\n{GLOSSARY}"]
    return "\n\n".join(part for part in parts if part)


def _curve(name: str, curve: CurveSummary) -> str:
    amplitude = format_quantity(curve.amplitude_m, "m", 3)
    preload = f"preload {format_quantity(curve.preload_n, 'N', 3)}" if curve.preload_n else "no preload"
    lines = [f"drive {amplitude}, {preload}; linear natural frequency {curve.natural_frequency_hz:.3g} Hz", ""]
    head = ("", "amplitude", "at", "max |angle|", "at", "max force", "|mu|")
    lines += table(head, [_row(kind, branch) for kind, branch in curve.branches.items()], set(range(1, len(head))))
    for kind, branch in curve.branches.items():
        lines += _marks(BRANCHES[kind], branch)
    return section(name, lines)


def _row(kind: str, branch: BranchSummary) -> tuple[str, ...]:
    cells = [BRANCHES[kind]]
    for peak in (branch.peak, branch.farthest):
        cells += ["", ""] if peak is None else [f"{peak.angle_rad:.3g} rad", f"{peak.frequency_hz:.4g} Hz"]
    cells.append("" if branch.largest_force_n is None else f"{branch.largest_force_n:.4g} N")
    cells.append("" if branch.largest_multiplier is None else f"{branch.largest_multiplier:.3f}")
    return tuple(cells)


def _marks(kind: str, branch: BranchSummary) -> list[str]:
    said = [
        f"{kind}: jumps between {j.from_hz:g} and {j.to_hz:g} Hz, amplitude {j.from_rad:.2g} to {j.to_rad:.2g} rad, "
        f"max |angle| {j.farthest_from_rad:.2g} to {j.farthest_to_rad:.2g} rad"
        for j in branch.jumps[:NO_MORE]
    ]
    if (others := len(branch.jumps) - NO_MORE) > 0:
        said.append(f"{kind}: {others} more jump{'s' * (others > 1)}")
    for word, spans in (
        ("overturns", branch.overturned_hz),
        ("is not periodic", branch.not_periodic_hz),
        ("is unstable", branch.unstable_hz),
    ):
        if spans:
            shown = ", ".join(_span(*span) for span in spans[:NO_MORE])
            more = (
                f" and in {len(spans) - NO_MORE} more range{'s' * (len(spans) - NO_MORE > 1)}"
                if len(spans) > NO_MORE
                else ""
            )
            said.append(f"{kind}: {word} {shown}{more}")
    return items(said)


def _span(first: float, last: float) -> str:
    return f"at {first:g} Hz" if first == last else f"from {first:g} to {last:g} Hz"
