"""How checks stand in a report: a failed one under the quantity that was tested, those that passed by name."""

from __future__ import annotations

from collections.abc import Sequence

from fibrefit.report.layout import items, paragraph
from fibrefit.study.summaries.check import Check

GLOSSARY = "Terms: fibrefit glossary."
"""Last line of the reports."""

#: What is tested by a check that does not say so itself, such as one of an older file, by its name.
QUANTITIES = {
    "a second solver agrees": "agreement with a second solver",
    "every parameter is determined": "identifiability of the parameters",
    "no parameter at a bound": "distance of the parameters from their bounds",
    "no phase stands out": "residuals by phase",
    "plain and whitened estimates agree": "OLS against GLS estimate (Hausman test)",
    "residuals do not depend on the state": "residuals vs state",
    "residuals have the noise's spectrum": "residual spectrum",
    "starts agree": "agreement of the starts (multistart)",
    "the fit ran to its end": "completion of the fit",
    "the force is the one the motion asks for": "force balance (inverse dynamics)",
    "the gap is noise": "residual size",
    "the noise is known": "noise level",
    "the simulation is sound": "soundness of the simulation",
    "the solver converged": "convergence of the solver",
}


def quantity_of(check: Check) -> str:
    """What a check tests, in the words under which its failure is listed."""
    if check.quantity:
        return check.quantity
    if check.name.startswith("the ") and check.name.endswith(" is as measured"):
        return f"error of the measured {check.name.removeprefix('the ').removesuffix(' is as measured')}"
    return QUANTITIES.get(check.name, check.name)


def failure(check: Check) -> str:
    """``FAILED residual size: ...``: what was tested and what was found; ``MODEL`` where the numbers may be right."""
    return f"{'FAILED' if check.about == 'numbers' else 'MODEL'} {quantity_of(check)}: {check.says}"


def failures(checks: Sequence[Check]) -> list[str]:
    """Lines of all checks that failed."""
    return items(
        failure(check) for check in sorted(checks, key=lambda check: check.about == "model") if not check.passed
    )


def passes(checks: Sequence[Check]) -> list[str]:
    """The names of those that passed in one paragraph; nothing where there are none."""
    passed = [check.name for check in checks if check.passed]
    if not passed:
        return []
    return [paragraph(f"{'Passed' if len(passed) < len(checks) else 'All checks passed'}: {'; '.join(passed)}.")]
