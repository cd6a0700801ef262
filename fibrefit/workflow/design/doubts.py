"""What is said of results that rest on a fit of the records at hand which does not pass its checks."""

from __future__ import annotations

from fibrefit.fitting.result import Identification


def doubts(fit: Identification | None) -> tuple[str, ...]:
    """Remark on a fit that failed checks; none where all passed, or nothing is measured."""
    failed = [] if fit is None else [check.name for check in fit.checks if not check.passed]
    if not failed:
        return ()
    return (f"The fit of the records at hand does not pass its checks ({', '.join(failed)}): so is all that follows.",)
