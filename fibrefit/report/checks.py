"""How checks stand in a report: a failed one under the quantity that was tested, those that passed by name."""

from __future__ import annotations

from collections.abc import Sequence

from fibrefit.report.layout import items, paragraph
from fibrefit.study.summaries.check import OTHERWISE, Check

GLOSSARY = "Terms: fibrefit glossary."
"""Last line of the reports."""


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
