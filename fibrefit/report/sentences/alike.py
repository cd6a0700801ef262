"""Sentences of what a fit takes to be the same in all records, and of what a single record cannot tell."""

from __future__ import annotations

from fibrefit.study.summaries.summaries import FitResultSummary

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
