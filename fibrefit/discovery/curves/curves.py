"""The curves of an unexplained gap: their shapes with errors, and where the records support them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core.declarations import SI
from fibrefit.discovery.curves.free_form import FittedCurve, acting, shape_of
from fibrefit.discovery.curves.variables import in_motion
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.fitting.result import Identification
from fibrefit.study.summaries.discovery import FreeCurve


def drawn(curves: Sequence[FittedCurve], found: Identification) -> tuple[FreeCurve, ...]:
    """Fitted probes as curves a person can look at, in the same order.

    Parameters
    ----------
    curves : sequence of FittedCurve
    found : Identification
        Of the model they were fitted on: its motion tells where the records spend their time.
    """
    stays = in_motion(found)
    return tuple(_drawn(curve, *stays[curve.probe.variable]) for curve in curves)


def with_law_over(curves: Sequence[FreeCurve], law: ProposedLaw) -> tuple[FreeCurve, ...]:
    """Curves with a law drawn over the one that it stands for."""
    over = {"law": tuple(law.heights.tolist())}
    return tuple(one.model_copy(update=over) if one.says == law.curve else one for one in curves)


def _drawn(curve: FittedCurve, values: np.ndarray, stays: np.ndarray) -> FreeCurve:
    probe, knots, shape = curve.probe, curve.knots, shape_of(curve)
    places = np.rint((values - knots[0]) / (knots[1] - knots[0])).astype(int)
    acts = acting(shape)
    # Those that counted where it was drawn: a law may since have been found in whole records.
    samples = curve.hypothesis.supermodel.samples.sum()
    return FreeCurve(
        variable=probe.variable,
        says=probe.says,
        unit=SI[probe.variable],
        height_unit=probe.unit,
        knots=tuple(knots.tolist()),
        heights=tuple(shape.tolist()),
        std_errors=tuple(curve.errors.tolist()),
        seconds=tuple(np.bincount(np.clip(places, 0, len(knots) - 1), stays, len(knots)).tolist()),
        acts=None if acts is None else (float(knots[acts[0]]), float(knots[acts[1]])),
        gap_after=float(np.sqrt(curve.hypothesis.fit.cost / samples)),
        cost=curve.hypothesis.fit.cost,
    )
