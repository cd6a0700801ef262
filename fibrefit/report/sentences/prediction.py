"""Sentences of the checks of a prediction, by their identifiers."""

from __future__ import annotations

from fibrefit.report.sentences.fit import fit_sentence, worded
from fibrefit.study.summaries.check import Check

OF_PREDICTION = "_predicted"
"""End of the identifier of a check of a channel, which begins with its name."""


def prediction_sentence(check: Check) -> str:
    """What a check of a prediction found."""
    if check.identifier.endswith(OF_PREDICTION):
        return _within(check)
    return _unseen(check) if check.identifier == "new_records" else fit_sentence(check)


def prediction_check_summaries(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Checks of a prediction with the sentences that explain them."""
    return tuple(worded(check, prediction_sentence(check)) for check in checks)


def _unseen(check: Check) -> str:
    if check.passed:
        return "The values were found from none of these records."
    return f"{', '.join(check.facts['records'])} served to find the values: what is said of it is no prediction."


def _within(check: Check) -> str:
    ratio = f"{check.statistic:.3g} times what is expected; at most {check.threshold:.3g} passes."
    says = f"The {check.identifier.removesuffix(OF_PREDICTION)} differs from its prediction by {ratio}"
    return says if check.passed else f"{says} The values, or the model, do not hold for these records."
