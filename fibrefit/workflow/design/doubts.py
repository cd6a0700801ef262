"""What is said of results that rest on a fit of the records at hand which does not pass its checks."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from fibrefit.core.formatting import in_words
from fibrefit.fitting.result import Identification

MOST_LISTED = 3
"""Names that a sentence tells one by one."""


def doubts_of_fit(fit: Identification | None, told: Collection[str] = ()) -> tuple[str, ...]:
    """Remark on a fit that is not ``ok`` and the checks it failed; none where nothing is measured.

    Parameters
    ----------
    fit : Identification, optional
    told : collection of str
        Identifiers of checks that another remark tells of.
    """
    if fit is None or fit.status == "ok":
        return ()
    failed = [check.name for check in fit.checks if not check.passed and check.identifier not in told]
    if not failed:
        return ()
    which = few_by_name(failed)
    return (f"The fit of the records at hand fails checks ({which}): what follows is no surer than that fit.",)


def few_by_name(names: Sequence[str]) -> str:
    """Names in words; of many the first few."""
    if len(names) > MOST_LISTED:
        return f"{', '.join(names[:MOST_LISTED])} and {len(names) - MOST_LISTED} more"
    return in_words(names)
