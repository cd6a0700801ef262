"""The curves of an unexplained gap: their shapes with errors, and where the records support them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.discovery.curves.free_form import SI, Reading, acting, in_motion, shape_of
from fibrefit.discovery.model.finding import FreeCurve
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.fitting.result import Identification


def drawn(
    readings: Sequence[Reading], found: Identification, samples: float, law: ProposedLaw | None = None
) -> tuple[FreeCurve, ...]:
    """Fitted probes as curves a person can look at, in the same order.

    Parameters
    ----------
    readings : sequence of Reading
    found : Identification
        Of the model they were fitted on: its motion tells where the records spend their time.
    samples : float
        Number of measured samples.
    law : ProposedLaw, optional
        Drawn over the curve that it stands for.
    """
    stays = in_motion(found)
    curves = [_curve(reading, *stays[reading.probe.variable], samples) for reading in readings]
    over = [law.heights if law is not None and reading.probe.name == law.probe else None for reading in readings]
    return tuple(replace(curve, law=heights) for curve, heights in zip(curves, over, strict=True))


def _curve(reading: Reading, values: np.ndarray, stays: np.ndarray, samples: float) -> FreeCurve:
    probe, knots, shape = reading.probe, reading.knots, shape_of(reading)
    places = np.rint((values - knots[0]) / (knots[1] - knots[0])).astype(int)
    acts = acting(shape)
    return FreeCurve(
        variable=probe.variable,
        says=probe.says,
        unit=SI[probe.variable],
        height_unit=probe.unit,
        knots=knots,
        heights=shape,
        errors=reading.errors,
        seconds=np.bincount(np.clip(places, 0, len(knots) - 1), stays, len(knots)),
        acts=None if acts is None else (float(knots[acts[0]]), float(knots[acts[1]])),
        gap_after=float(np.sqrt(reading.hypothesis.fit.cost / samples)),
        cost=reading.hypothesis.fit.cost - 2.0 * reading.gain,
    )
