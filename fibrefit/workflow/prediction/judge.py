"""The checks of a prediction, and its verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import chi2, f

from fibrefit.fitting.checks import check, finite
from fibrefit.fitting.uncertainty import Freedom
from fibrefit.problem import GAP_OF_NOISE
from fibrefit.study.summaries.check import Check
from fibrefit.workflow.prediction.known import widened
from fibrefit.workflow.thresholds import LACKING, RARE


def expected_square(parts: Mapping[str, np.ndarray], counted: np.ndarray) -> float:
    """Mean square of measured minus predicted that is expected, in SI units squared.

    Parameters
    ----------
    parts : mapping of cause to (n_record, n_time)
        Variance of a new reading, in SI units squared: residuals are not weighed by the noise of each.
    counted : (n_record, n_time) bool
    """
    return float(np.mean(sum(parts.values())[counted]))  # type: ignore[index]


def limit(parts: Mapping[str, np.ndarray], counted: np.ndarray, freedom: Freedom) -> float:
    """Largest ratio of that which was found to that which is expected, both rms, that still passes.

    Parameters
    ----------
    parts, counted
        As of `expected_square`.
    freedom : Freedom
        Of the part that the error bars of the values bring.

    Law
    ---
    Noise is known to a few percent; the share of the values scatters as F of the degrees of freedom that it has in
    these readings, chi-square where its variance is known; what the model lacks may be half as large again in other
    records.
    """
    allowed = {
        "noise": GAP_OF_NOISE**2,
        "model": LACKING**2,
        "values": _most(freedom),
    }
    share = {cause: float(np.mean(part[counted])) for cause, part in parts.items()}
    return float(np.sqrt(sum(allowed[cause] * size for cause, size in share.items()) / sum(share.values())))


def _most(freedom: Freedom) -> float:
    """Mean square of errors that values leave, over what their error bars let expect, beyond which it is rare."""
    directions, known = freedom
    if np.isinf(known):
        return float(chi2.isf(RARE, directions) / directions)
    # Error bars of what few records scatter by are wider than that scatter.
    return float(f.isf(RARE, directions, known) / widened(known) ** 2)


def prediction_checks(
    ratios: Mapping[str, tuple[float, float]],
    readings: np.ndarray,
    trouble: np.ndarray,
    records: tuple[str, ...],
    known: Sequence[str],
) -> tuple[Check, ...]:
    """Checks of a prediction.

    Parameters
    ----------
    ratios : mapping of channel to (ratio, limit)
        Residual rms over what is expected.
    readings : (...)
        All that was simulated.
    trouble : (n_record,) bool
    known : sequence of str
        Records the values were found from.
    """
    checks = [check("simulation", finite(readings, trouble, records)), _unseen(known)]
    checks += [_within(channel, *pair) for channel, pair in ratios.items()]
    return tuple(checks)


def _unseen(known: Sequence[str]) -> Check:
    return Check.none_of(
        known,
        name="the records are new",
        identifier="new_records",
        quantity="independence of the records",
        facts={"records": tuple(known)},
    )


def _within(channel: str, ratio: float, most: float) -> Check:
    return Check(
        name=f"the {channel} is as predicted",
        passed=bool(ratio <= most),
        statistic=ratio,
        threshold=most,
        identifier=f"{channel}_predicted",
        quantity=f"prediction of the {channel}",
    )
