"""Sentences of what a fit takes to be the same in all records, of how they differ, and of what one cannot tell."""

from __future__ import annotations

from collections.abc import Mapping

from fibrefit.report.sentences.thresholds import SMALL_DIFFERENCE
from fibrefit.study.summaries.results import BetweenRecordsSummary, FitResultSummary

RECORDS_AGREE = "records_agree"
"""Identifier of the check whether single records ask for the same values."""


def taken_alike_sentence(summary: FitResultSummary) -> str:
    """Of which parameters no difference between records was looked for; empty where there is none."""
    free = [name for name, one in summary.parameters.items() if one.free]
    if not free or not summary.records:
        return ""
    if len(summary.records) == 1:
        return (
            "There is one record: values and intervals are those of this record, and say nothing of how much another "
            "one would differ."
        )
    taken = [name for name in free if name not in summary.between_records]
    if not taken:
        return ""
    names = f"{', '.join(taken[:-1])} and {taken[-1]}" if len(taken) > 1 else taken[0]
    said = f"Taken to be the same in all records: {names}"
    if any(check.identifier == RECORDS_AGREE for check in summary.checks):
        return f"{said}. Whether single records ask for other values was looked at; no interval allows for it."
    return (
        f"{said}. Differences between records in {'these' if len(taken) > 1 else 'it'} were not looked for, and no "
        "interval allows for them."
    )


def between_sentence(found: Mapping[str, BetweenRecordsSummary]) -> str:
    """How much records differ, or may differ all the same unless that is little; empty where it was not requested."""
    said = []
    for name, between in found.items():
        low, high = (f"{100.0 * end:.2g}" for end in between.interval_95)
        if between.interval_95[0] > 0.0:
            size = f"{100.0 * between.sd:.2g} % (95 %: {low} to {high} %)"
            said.append(f"{name} differs by {size} from record to record, beyond its error.")
        elif between.sd > 0.0:
            said.append(f"{name} may differ by up to {high} %.")
        elif between.interval_95[1] > SMALL_DIFFERENCE:
            said.append(f"{name}: no difference found; up to {high} % is not excluded.")
    if any(between.sd > 0.0 for between in found.values()):
        means = "Values of parameters that differ are means of the population; their intervals are as wide as so few "
        said.append(f"{means}records ask for.")
    return f"Between records: {' '.join(said) or 'no difference beyond the errors.'}" if found else ""
