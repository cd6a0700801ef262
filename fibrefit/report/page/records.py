"""The view of the records: what was measured and simulated, the states behind it, and where to look."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from fibrefit.core.declarations import PHASES, STATES
from fibrefit.core.formatting import shown_unit, typeset_unit
from fibrefit.report.page.blocks import Records
from fibrefit.report.page.moments import moments
from fibrefit.report.page.packing import packed
from fibrefit.study.summaries.discovery import GapPlace
from fibrefit.study.summaries.part import AXES, Z_95, Groups, conditions_text
from fibrefit.study.summaries.results import Gap

FINE = 0.01
"""Step of what is shown in units of the noise."""
STEPS = 20000
"""Steps in the range of a state."""


class CourseModel(NamedTuple):
    """One simulation of all records.

    Parameters
    ----------
    role : {"first", "final", "round", "tried"}
        What it is drawn as.
    shown : bool
        Whether it is drawn to begin with.
    readings : mapping of channel to (n_record, n_time) in SI units
    """

    key: str
    label: str
    role: str
    shown: bool
    readings: Mapping[str, np.ndarray]


class Band(NamedTuple):
    """Ends of the interval of a new measurement, ``(n_record, n_time)`` in SI units."""

    low: np.ndarray
    high: np.ndarray


class Sight(NamedTuple):
    """What is seen of all records.

    Parameters
    ----------
    groups : Groups
        ``observed_data``, ``motion`` and ``constant_data`` are read.
    gaps : mapping of record to Gap
        With the noise of each channel.
    models : sequence of CourseModel
        The final one last.
    bands : mapping of channel to Band
    band : str
        What the band is.
    places : sequence of GapPlace
        Where the first model goes wrong.
    """

    groups: Groups
    gaps: Mapping[str, Gap]
    models: Sequence[CourseModel]
    bands: Mapping[str, Band]
    band: str
    places: Sequence[GapPlace] = ()


class _Scale(NamedTuple):
    unit: str
    worth: float


def records_block(sight: Sight) -> Records | None:
    """The view of all records; None where the result does not hold what is needed."""
    observed, data = sight.groups.get("observed_data", {}), []
    if "time" not in observed or not sight.models:
        return None
    records = [str(name) for name in observed["record"].values]
    channels = [name for name in sight.models[0].readings if name in observed]
    scales = {channel: _scale(observed[channel].values, observed[channel].unit) for channel in channels}
    counts = _counts(sight.groups)
    states = _states(sight.groups, counts)
    shown = []
    for r, record in enumerate(records):
        span = slice(0, counts[r])
        noise = {c: _noise(sight.gaps.get(record), c, observed[c].values[r, span]) for c in channels}
        data.append(packed(_series(sight, scales, r, span, noise) | _of_states(sight.groups, states, r, span)))
        shown.append(_record(sight, record, r, span, {c: noise[c] / scales[c].worth for c in channels}))
    view = {
        "channels": [{"name": c, "unit": scales[c].unit} for c in channels],
        "states": [{"name": name, "unit": scale.unit} for name, scale in states.items()],
        "phases": list(PHASES),
        "models": [{"key": m.key, "label": m.label, "role": m.role, "shown": m.shown} for m in sight.models],
        "band": sight.band,
        "records": shown,
        "places": [_place(one) for one in sight.places if one.record in records and one.channel in channels],
    }
    return Records("The records", view, data)


def fit_bands(groups: Groups, readings: Mapping[str, np.ndarray], gaps: Mapping[str, Gap]) -> dict[str, Band]:
    """95 % interval of a new measurement: the noise, and the errors of the values."""
    found, names = {}, [str(name) for name in groups["observed_data"]["record"].values]
    for channel, values in readings.items():
        error = groups["predictions"].get(f"{channel}_error")
        spread = np.zeros_like(values) if error is None else np.nan_to_num(error.values)
        own = groups["predictions"].get(f"{channel}_noise")  # none in results of earlier versions
        noise = np.array([_of_gap(gaps.get(name), channel) or np.nan for name in names])[:, None]
        half = Z_95 * np.hypot(noise if own is None else own.values, spread)
        found[channel] = Band(values - half, values + half)
    return found


def simulated(groups: Groups, group: str) -> dict[str, np.ndarray]:
    """Readings of each channel in a group of predictions."""
    channels = groups.get("observed_data", {})
    return {name: one.values for name, one in groups.get(group, {}).items() if name in channels and name not in AXES}


def _scale(values: np.ndarray, unit: str) -> _Scale:
    known = np.abs(values[np.isfinite(values)])
    shown, worth = shown_unit(float(known.max()) if known.size and known.max() > 0.0 else 1.0, unit)
    return _Scale(typeset_unit(shown), worth)


def _counts(groups: Groups) -> list[int]:
    samples = groups.get("constant_data", {}).get("samples")
    if samples is not None:
        return [int(count) for count in samples.values]
    # A record ends with the last sample that was measured.
    observed = [one.values for name, one in groups["observed_data"].items() if name not in AXES]
    there = np.any([np.isfinite(values) for values in observed], axis=0)
    return [int(np.flatnonzero(row)[-1]) + 1 if row.any() else 0 for row in there]


def _noise(gap: Gap | None, channel: str, measured: np.ndarray) -> float:
    """Noise rms in SI units; where it is not known, a hundredth of the signal's."""
    return _of_gap(gap, channel) or 0.01 * float(np.nanstd(measured)) or 1.0


def _of_gap(gap: Gap | None, channel: str) -> float | None:
    own = gap.channels.get(channel) if gap is not None else None
    return own.noise if own is not None else None


def _states(groups: Groups, counts: Sequence[int]) -> dict[str, _Scale]:
    motion, found = groups.get("motion", {}), {}
    for name in STATES:
        if (one := motion.get(name.replace(" ", "_"))) is not None:
            # Beyond the end of a record stands what the model would have done after it.
            rows = [row[:count] for row, count in zip(one.values, counts, strict=True)]
            found[name] = _scale(np.concatenate(rows), one.unit)
    return found


def _series(
    sight: Sight, scales: Mapping[str, _Scale], record: int, span: slice, noise: Mapping[str, float]
) -> dict[str, tuple[np.ndarray, float]]:
    """Time, what was measured, every model, and the band, in the units in which they are shown."""
    observed = sight.groups["observed_data"]
    found = {"time": (observed["time"].values[record, span], 1e-7)}
    for channel, (_, worth) in scales.items():
        step = FINE * noise[channel] / worth
        found[f"measured {channel}"] = (observed[channel].values[record, span] / worth, step)
        for model in sight.models:
            found[f"{model.key} {channel}"] = (model.readings[channel][record, span] / worth, step)
        if channel in sight.bands:
            last = sight.models[-1].readings[channel][record, span]
            low, high = (end[record, span] for end in sight.bands[channel])
            found[f"below {channel}"] = ((last - low) / worth, step)
            found[f"above {channel}"] = ((high - last) / worth, step)
    return found


def _of_states(
    groups: Groups, states: Mapping[str, _Scale], record: int, span: slice
) -> dict[str, tuple[np.ndarray, float]]:
    motion = groups.get("motion", {})
    found = {}
    for name, scale in states.items():
        values = motion[name.replace(" ", "_")].values[record, span] / scale.worth
        found[f"state {name}"] = (values, max(float(np.ptp(values)), 1e-12) / STEPS)
    if "phase" in motion:
        found["phase"] = (motion["phase"].values[record, span].astype(float), 1.0)
    return found


def _record(sight: Sight, name: str, record: int, span: slice, noise: Mapping[str, float]) -> dict[str, Any]:
    gap, motion = sight.gaps.get(name), sight.groups.get("motion", {})
    times = sight.groups["observed_data"]["time"].values[record, span]
    found = moments(times, motion["phase"].values[record, span].astype(int)) if "phase" in motion else []
    return {
        "name": name,
        "says": conditions_text(sight.groups.get("constant_data", {}), record),
        "gap": None if gap is None or gap.total is None else round(gap.total, 3),
        "noise": noise,
        "moments": [{"kind": one.kind, "at": round(one.at, 6)} for one in found],
    }


def _place(place: GapPlace) -> dict[str, Any]:
    return {
        "record": place.record,
        "channel": place.channel,
        "from": place.from_s,
        "to": place.to_s,
        "phase": place.phase,
        "share": place.share,
    }
