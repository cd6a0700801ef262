"""The curves of an unexplained gap: their shapes with errors, and where the records support them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from fibrefit.discovery.curves.free_form import SI, Reading, acting, in_motion, price, shape_of, with_curve
from fibrefit.discovery.engine.candidates import Ground, fit_all
from fibrefit.discovery.engine.refit import ROUGH, covariance
from fibrefit.discovery.model.finding import FreeCurve
from fibrefit.fitting.result import Identification


def drawn(
    readings: Sequence[Reading], found: Identification, ground: Ground, samples: float, kappa: float
) -> tuple[FreeCurve, ...]:
    """Fitted probes as curves a person can look at, in the same order.

    Parameters
    ----------
    readings : sequence of Reading
    found : Identification
        Of the model they were fitted on: its motion tells where the records spend their time.
    ground : Ground
    samples : float
        Number of measured samples.
    kappa : float
        Colour of the noise.
    """
    stays = in_motion(found)
    jobs = [partial(shape_errors, reading, ground, samples, kappa) for reading in readings]
    errors = fit_all(jobs, lambda done: None)
    return tuple(
        _curve(reading, error, *stays[reading.probe.variable], samples, kappa)
        for reading, error in zip(readings, errors, strict=True)
    )


def shape_errors(reading: Reading, ground: Ground, samples: float, kappa: float) -> np.ndarray:
    """Standard errors ``(n_knot,)`` of the heights but for their level, which base parameters may take up as well.

    They are of the differences from the mean height, each counted by what the records see of it. Noise counts for more
    by its colour and by what is left unexplained; how much neighbours are alike is taken for known.

    Parameters
    ----------
    reading : Reading
    ground : Ground
    samples : float
        Number of measured samples.
    kappa : float
        Colour of the noise.
    """
    hypothesis = reading.hypothesis
    subset = with_curve(ground, hypothesis.effects[:-1], reading.probe)
    n = len(reading.heights)
    spread = covariance(hypothesis.frame, subset, hypothesis.fit.local, ground.whole)[-n:, -n:]
    inflation = kappa * max(hypothesis.fit.cost / samples, 1.0)
    steepness = np.diff(np.eye(n), axis=0) / (ROUGH * reading.probe.size)
    known = spread @ steepness.T @ steepness @ spread
    spread = inflation * spread - (inflation - 1.0) * known
    seen = 1.0 / np.diag(spread)
    without_level = np.eye(n) - seen / seen.sum()
    return np.sqrt(np.abs(np.diag(without_level @ spread @ without_level.T)))


def _curve(
    reading: Reading, errors: np.ndarray, values: np.ndarray, stays: np.ndarray, samples: float, kappa: float
) -> FreeCurve:
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
        errors=errors,
        seconds=np.bincount(np.clip(places, 0, len(knots) - 1), stays, len(knots)),
        acts=None if acts is None else (float(knots[acts[0]]), float(knots[acts[1]])),
        gap_after=float(np.sqrt(reading.hypothesis.fit.cost / samples)),
        cost=price(reading, kappa),
    )
