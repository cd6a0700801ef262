"""A sweep as its summary has it, and the checks it is put to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.series.jumps import jumps, ranges
from fibrefit.series.sweep import Branch, SweptCurve
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import BranchSummary, CurveSummary, JumpSummary, PeakSummary
from fibrefit.workflow.thresholds import LOCATED


def curve_summary(curve: SweptCurve) -> CurveSummary:
    """One curve of a sweep."""
    return CurveSummary(
        amplitude_m=curve.conditions.amplitude,
        preload_n=curve.conditions.rig["preload"],
        natural_frequency_hz=curve.natural_frequency,
        branches={name: _branch(curve.frequencies, branch) for name, branch in curve.branches.items()},
    )


def sweep_checks(curves: Sequence[SweptCurve]) -> tuple[Check, ...]:
    """Whether the integration held, all motions settled, and the jumps are located."""
    branches = [branch for curve in curves for branch in curve.branches.values()]
    runs = sum(len(branch.time) for branch in branches)
    chattered = sum(int(branch.trouble.sum()) for branch in branches)
    restless = sum(int(((branch.periods == 0) & ~branch.overturned).sum()) for branch in branches)
    jumped = sum(
        len(jumps(curve.frequencies, branch.amplitude)) for curve in curves for branch in curve.branches.values()
    )
    step = float(np.max(np.diff(curves[0].frequencies)))
    return (
        Check(
            name="switches are located",
            passed=chattered == 0,
            says=f"In {chattered} of {runs} runs the fibres went taut and slack too often to be followed.",
            identifier="switches",
            quantity="location of switches",
            statistic=chattered,
            threshold=0.0,
            fatal=True,
        ),
        Check(
            name="motions are periodic",
            passed=restless == 0,
            says=f"{restless} of {runs} runs did not reach a motion that is periodic within four periods of the drive.",
            identifier="periodicity",
            quantity="periodicity of the steady state",
            statistic=restless,
            threshold=0.0,
        ),
        Check(
            name="the grid is fine enough",
            passed=not jumped or step <= LOCATED * (1.0 + 1e-9),
            says=f"{jumped} jumps lie between frequencies {step:.3g} Hz apart, threshold {LOCATED:g} Hz.",
            identifier="frequency_step",
            quantity="frequency step at jumps",
            statistic=step,
            threshold=LOCATED,
            unit="Hz",
        ),
    )


def _branch(frequencies: np.ndarray, branch: Branch) -> BranchSummary:
    standing = ~branch.overturned
    max_angle = branch.max_angle
    place = {frequency: i for i, frequency in enumerate(frequencies)}
    found = []
    for jump in jumps(frequencies, branch.amplitude):
        first, last = max_angle[place[jump.lower]], max_angle[place[jump.upper]]
        found.append(
            JumpSummary(
                from_hz=jump.lower,
                to_hz=jump.upper,
                from_rad=jump.before,
                to_rad=jump.after,
                farthest_from_rad=float(first),
                farthest_to_rad=float(last),
            )
        )
    known = np.isfinite(branch.multiplier)
    return BranchSummary(
        peak=_peak(frequencies, branch.amplitude, standing),
        farthest=_peak(frequencies, max_angle, standing),
        largest_force_n=float(branch.highest[standing, 1:].max()) if standing.any() else None,
        jumps=tuple(found),
        overturned_hz=ranges(frequencies, branch.overturned),
        not_periodic_hz=ranges(frequencies, (branch.periods == 0) & standing),
        unstable_hz=ranges(frequencies, known & (branch.multiplier > 1.0)),
        largest_multiplier=float(branch.multiplier[known].max()) if known.any() else None,
    )


def _peak(frequencies: np.ndarray, angle: np.ndarray, standing: np.ndarray) -> PeakSummary | None:
    if not standing.any():
        return None
    best = int(np.argmax(np.where(standing, angle, -np.inf)))
    return PeakSummary(frequency_hz=float(frequencies[best]), angle_rad=float(angle[best]))
