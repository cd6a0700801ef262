"""How checks stand in a report: a failed one under the quantity that was tested, those that passed by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fibrefit.core.formatting import in_words
from fibrefit.report.layout import LONGEST_RECORD_NAME, items, paragraph, shortened_names
from fibrefit.study.summaries.check import OTHERWISE, Check
from fibrefit.study.summaries.results import RecordSummary

GLOSSARY = "Terms: fibrefit glossary."
"""Last line of the reports."""
MOST_NOTES = 8
"""Notes on records that a report tells, and records that each is told of by name."""


def quantity_of(check: Check) -> str:
    """What a check tests, in the words under which its failure is listed."""
    return check.quantity or check.name


def failure(check: Check) -> str:
    """``FAILED residual size: ...``: what was tested and what was found; ``MODEL`` where the numbers may be right."""
    return f"{'FAILED' if check.about == 'numbers' else 'MODEL'} {quantity_of(check)}: {check.says}"


def failures(checks: Sequence[Check]) -> list[str]:
    """Lines of all checks that failed."""
    return items(failure(check) for check in sorted(checks, key=_weight) if not check.passed)


def _weight(check: Check) -> tuple[bool, bool]:
    """What explains all the rest comes first, and what speaks of the model alone last."""
    return check.about == "model", check.identifier != OTHERWISE


def passes(checks: Sequence[Check]) -> list[str]:
    """The names of those that passed in one paragraph; nothing where there are none."""
    passed = [check.name for check in checks if check.passed]
    if not passed:
        return []
    return [paragraph(f"{'Passed' if len(passed) < len(checks) else 'All checks passed'}: {'; '.join(passed)}.")]


def notes_on_records(records: Mapping[str, RecordSummary]) -> list[str]:
    """What files hold that may be a reason to doubt a number, each sentence once, behind the records that it is of."""
    of: dict[str, list[str]] = {}
    for name, short in shortened_names(records, LONGEST_RECORD_NAME).items():
        for note in records[name].notes:
            of.setdefault(note, []).append(short)
    told = [f"{_whose(names, len(records))}: {note}" for note, names in of.items()]
    others = len(told) - MOST_NOTES
    more = [f"And {others} more such notes: records.*.notes of summary.json."] if others > 0 else []
    return [*told[:MOST_NOTES], *more]


def _whose(names: Sequence[str], records: int) -> str:
    if len(names) == records > 1:
        return f"All {records} records"
    if len(names) > MOST_NOTES:
        return f"{', '.join(names[:MOST_NOTES])} and {len(names) - MOST_NOTES} more"
    return in_words(names)
