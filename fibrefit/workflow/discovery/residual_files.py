"""What a search leaves, round by round, and where the first model goes wrong, as groups of ``result.h5``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core.declarations import PHASES
from fibrefit.discovery.model.finding import Finding, TracedRound
from fibrefit.discovery.residuals.residuals import channel_residuals
from fibrefit.discovery.residuals.spectrum import narrow_band, spectrum_of
from fibrefit.discovery.residuals.where import phase_shares
from fibrefit.fitting.result import Identification
from fibrefit.study.summaries.part import Variable
from fibrefit.workflow.groups_in_common import motion_group

MODELS = ("first", "final")
GRID = ("record", "channel", "sample")
DIGITS = 3
"""Digits of a residual over its noise: more would be noise, and do not compress."""

Group = dict[str, Variable]


def residual_groups(finding: Finding) -> dict[str, Group]:
    """Motion of the first model, residuals of each round, spectra, and shares of the phases."""
    return {
        "motion_before": motion_group(finding.before.problem, finding.before.motion),
        "rounds": _rounds(finding),
        "residual_spectrum": _spectra(finding),
        "phase_shares": _shares(finding.before),
    }


def _rounds(finding: Finding) -> Group:
    """Residuals before each round, and with the first candidates of its ranking; nothing where no round kept them."""
    kept = [(number, found) for number, found in enumerate(finding.steps, 1) if found.residuals is not None]
    if not kept:
        return {}
    tried = [(number, c.effect, left) for number, found in kept for c, left in _traced(found)]
    doc, noise = "Simulated minus measured over the noise", _noise_of_readings(finding.before)
    return {
        **_coordinates(finding.before),
        "noise": Variable(noise, GRID, doc="Noise of each reading in SI units; NaN where nothing counts, or in steps."),
        "round": Variable(np.array([number for number, _ in kept]), ("round",), doc="Counted from 1."),
        "left": Variable(_rounded([found.residuals for _, found in kept]), ("round", *GRID), doc=f"{doc}, before."),
        "tried_in": Variable(np.array([n for n, *_ in tried], dtype=int), ("tried",), doc="Round it was tried in."),
        "effect": Variable(np.array([name for _, name, _ in tried], dtype=object), ("tried",)),
        "left_with": Variable(_rounded([left for *_, left in tried]), ("tried", *GRID), doc=f"{doc}, with the effect."),
    }


def _noise_of_readings(found: Identification) -> np.ndarray:
    """What residuals are in units of; those of readings in coarse steps say nothing of what is inside a step."""
    data, channels = found.problem.observations, found.problem.model.rig.channels
    weights = np.stack([np.asarray(data.weight[channel], dtype=float) for channel in channels], axis=1)
    told = np.array([data.steps.get(channel) is None for channel in channels])[:, None] & (weights > 0.0)
    return np.divide(1.0, weights, out=np.full_like(weights, np.nan), where=told)


def _traced(step: TracedRound) -> list:
    return list(zip(step.summary.ranking, step.residuals_with, strict=False))


def _rounded(residuals: Sequence) -> np.ndarray:
    return np.round(np.array(residuals, dtype=float), DIGITS)


def _coordinates(found: Identification) -> Group:
    layout, channels = found.problem.layout, found.problem.model.rig.channels
    return {
        "record": Variable(np.array(layout.records, dtype=object), ("record",)),
        "channel": Variable(np.array(channels, dtype=object), ("channel",)),
    }


def _spectra(finding: Finding) -> Group:
    """Spectrum of each channel before and after, and the band that holds most of the gap."""
    channels = finding.before.problem.model.rig.channels
    found = {model: _spectra_of(one) for model, one in zip(MODELS, (finding.before, finding.after), strict=True)}
    first = found["first"]
    bands = [narrow_band(one, finding.before.noise[channel]) for one, channel in zip(first, channels, strict=True)]
    return {
        "channel": _coordinates(finding.before)["channel"],
        "model": Variable(np.array(MODELS, dtype=object), ("model",)),
        "frequency": Variable(first[0].frequency, ("frequency",), "Hz"),
        "power": Variable(
            np.array([[one.power for one in of] for of in found.values()]),
            ("model", "channel", "frequency"),
            doc="Of the residuals, in unit of the channel squared per Hz.",
        ),
        "floor": Variable(np.array([one.floor for one in first]), ("channel", "frequency"), doc="Of the noise."),
        "chance": Variable(
            np.array([one.chance for one in first]),
            ("channel", "end"),
            doc="Factors on the floor between which noise stays at nineteen frequencies of twenty.",
        ),
        "band": Variable(
            np.array([band or (np.nan,) * 3 for band in bands]),
            ("channel", "of_band"),
            doc="Ends in Hz and share of a third of an octave that holds most of the gap; NaN where none does.",
        ),
    }


def _spectra_of(found: Identification) -> list:
    channels = range(len(found.problem.model.rig.channels))
    return [spectrum_of([one for one in channel_residuals(found.residual_set) if one.channel == c]) for c in channels]


def _shares(found: Identification) -> Group:
    shares, channels = phase_shares(found.residual_set), found.problem.model.rig.channels
    return {
        "channel": _coordinates(found)["channel"],
        "phase": Variable(np.array(PHASES, dtype=object), ("phase",)),
        "share": Variable(
            np.array([[shares[channel, phase] for phase in PHASES] for channel in channels]),
            ("channel", "phase"),
            doc="Share of the gap beyond noise of the first model.",
        ),
    }
