"""Whether channels are what they are called, before anything is fitted: which is which, their signs, scales and times.

Signs: a weight falls as gravity has it, is drawn the way its fibre pulls, and follows its drive: that of the three it
moves against has another sign than was read, and where it moves against gravity its position has. A mean below zero
proves nothing, as gauges have offsets: these change gravity as the records show it, and the force not at all.

Scales: what a file or its user leaves unsaid, a gain, a decimation or a unit, shows in the numbers: a weight of a known
mass does not move so under such a force.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number, format_quantity, in_words
from fibrefit.problem.thresholds import (
    CARRIES_LOAD,
    FEWEST_READINGS,
    FOLLOWS,
    MISREAD,
    PROVEN_FACTOR,
    TELLS_A_SIGN,
)
from fibrefit.rigs.rig import Rig
from fibrefit.rigs.signals.newton import newton_of
from fibrefit.rigs.signals.trace import Trace

GRAVITY, FORCE, POSITION, DRIVE = "gravity", "force", "position", "drive"
WORDS = {GRAVITY: "gravity", FORCE: "the measured force", DRIVE: "the drive"}
TINY = np.finfo(float).tiny
MOST_NAMES = 3
"""Records that are called by their names: of others their number is told."""


class Sense(NamedTuple):
    """How far a weight moves the way one thing moves it.

    Parameters
    ----------
    size : float
        1 where it moves just so, -1 where it moves just against it.
    error : float
        Standard error.
    """

    size: float
    error: float

    @property
    def sign(self) -> int:
        """1 or -1 where that is beyond doubt, 0 elsewhere."""
        return int(np.sign(self.size)) if abs(self.size) > PROVEN_FACTOR * self.error else 0


def refuse_contradictory(
    traces: Sequence[Trace], rig: Rig, effects: Sequence[str] = (), known: Collection[str] = ()
) -> None:
    """Refuse records of which a channel has another sign or scale than the rig's: `refuse_turned`, `refuse_misread`."""
    refuse_turned(traces, rig)
    refuse_misread(traces, rig, effects, known)


def refuse_turned(traces: Sequence[Trace], rig: Rig) -> None:
    """Refuse records of which a channel has another sign than the rig's.

    Parameters
    ----------
    traces : sequence of Trace
    rig : Rig
        One that does not say what acts on its weight is not examined.

    Raises
    ------
    DataError
        With the records in which it is the same, what their weights move against, and how a channel is turned round.
    """
    if rig.pulled is None:
        return
    found = [senses_of(trace, rig) for trace in traces]
    against = [against_which(senses) for senses in found]
    first = next((i for i, what in enumerate(against) if what), None)
    if first is None:
        return
    same = [trace.name for trace, what in zip(traces, against, strict=True) if what == against[first]]
    number, senses = len(traces), found[first]
    moves = [
        f"{WORDS[name]} ({format_number(senses[name].size, 2)} times what follows from it)" for name in against[first]
    ]
    ways = turned_channels(senses)
    right = {
        FORCE: "a force is positive while the fibre pulls",
        POSITION: f"a position grows {rig.directions[0]} the guide",
        DRIVE: "a drive grows as it takes fibre in",
    }
    turned = tuple(dict.fromkeys(name for way in ways for name in way))
    columns = ", ".join(f'{name} = {{ column = "...", scale = "-1" }}' for name in turned)
    all_of_them = len(same) == number
    says = [f"Check the sign of the {', or of the '.join(' and the '.join(way) for way in ways)}:"]
    says += [f"{in_words([right[name] for name in turned])}."]
    says += [f"If it was logged the other way, state it {'under [channels]' if all_of_them else 'in [[records]]'}:"]
    says += [columns if all_of_them else f"channels = {{ {columns} }}", "(a scale that is there gets another sign)."]
    expected = f"a weight that moves as {in_words([WORDS[name] for name in senses])} have it (1 times)"
    rest = len(same) - MOST_NAMES
    where = in_words([*same[:MOST_NAMES], f"{rest} more"] if rest > 0 else same)
    if all_of_them and number > 1:
        where = f"all {number} records"
    raise DataError(where, f"the weight moves against {in_words(moves)}", expected, " ".join(says))


def senses_of(trace: Trace, rig: Rig) -> dict[str, Sense]:
    """Senses in which the weight of a record moves, by what moves it; those that the record tells nothing of left out.

    Law
    ---
    Of gravity and of the measured force: their sizes by Newton's law (`newton_of`), 1 where these are as they were
    read. Of the drive: see `_followed`.
    """
    position, force = trace.channels.get(POSITION), trace.channels.get(FORCE)
    found = dict[str, Sense]()
    if position is None or rig.pulled is None:
        return found
    if force is not None:
        pulled = rig.pulled(trace.conditions, position)
        sizes = newton_of(trace.times, position, force, pulled)
        if sizes is not None and sizes.explained >= TELLS_A_SIGN:
            if pulled.mass * abs(pulled.gravity) > CARRIES_LOAD * (np.nanmax(force) - np.nanmin(force)):
                # A force that reads nil under the weight makes gravity nil, one that reads less than nil turns it
                # round: it has a sign where it is nearer to 1, or to -1, than to nil.
                found[GRAVITY] = Sense(sizes.gravity, max(sizes.gravity_error, 0.5 / PROVEN_FACTOR))
            found[FORCE] = Sense(sizes.force, sizes.force_error)
    if DRIVE in trace.inputs:
        found[DRIVE] = Sense(_followed(trace.inputs[DRIVE][:, 0], position, force), FOLLOWS / PROVEN_FACTOR)
    return found


def _followed(drive: np.ndarray, position: np.ndarray, force: np.ndarray | None) -> float:
    """How far a weight follows its drive, from -1 to 1; near nil where one of them rests.

    Law
    ---
    The covariance of both over the larger variance; and, counting twice, the share of the force's variance that their
    distance explains while the fibre carries load, as it stretches it, less that which their sum does, the distance of
    a drive turned round. A weight that is flung up and comes down while its drive goes on tells nothing by the first,
    one that goes with its drive under an even force nothing by the second.
    """
    signals = [drive, position] + ([] if force is None else [force])
    known = np.isfinite(signals).all(axis=0)
    if not known.any():
        return 0.0
    x, u, *load = (signal[known] for signal in signals)
    follows = _product(x, u) / max(_product(x, x), _product(u, u), TINY)
    if not load:
        return follows
    taut = np.abs(load[0]) > CARRIES_LOAD * np.abs(load[0]).max()
    return (follows + 2.0 * (_explained(load[0], x - u, taut) - _explained(load[0], x + u, taut))) / 3.0


def _explained(force: np.ndarray, stretch: np.ndarray, taut: np.ndarray) -> float:
    """Share of a force's variance that a stretch explains while it is there."""
    one, other = force[taut], stretch[taut]
    return _product(one, other) ** 2 / max(_product(one, one) * _product(other, other), TINY)


def _product(one: np.ndarray, other: np.ndarray) -> float:
    """Sum of the products of two signals about their means."""
    return float((one - one.mean()) @ (other - other.mean())) if one.size else 0.0


def against_which(senses: Mapping[str, Sense]) -> tuple[str, ...]:
    """What a weight moves against beyond doubt."""
    return tuple(name for name, sense in senses.items() if sense.sign < 0)


def turned_channels(senses: Mapping[str, Sense]) -> tuple[tuple[str, ...], ...]:
    """Channels of the wrong sign; in two ways where gravity does not tell which.

    Gravity has its sign from the study, so that it tells that of the position; those of force and drive follow.
    """
    falls = senses[GRAVITY].sign if GRAVITY in senses else 0
    signs = {name: sense.sign for name, sense in senses.items() if name != GRAVITY and sense.sign}
    upright = tuple(name for name, sign in signs.items() if sign < 0)
    upside_down = (POSITION, *(name for name, sign in signs.items() if sign > 0))
    return {1: (upright,), -1: (upside_down,)}.get(falls, (upright, upside_down))


EXPLAINED = ("study.", "sensor.force_gain", "sensor.position_gain", "pulley.", "rig.")
"""Beginnings of names of effects by which a model has other scales, slopes or inertias than the study states."""


def refuse_misread(traces: Sequence[Trace], rig: Rig, effects: Sequence[str] = (), known: Collection[str] = ()) -> None:
    """Refuse records whose force or position is not that of the weight, by a factor.

    Parameters
    ----------
    rig : Rig
        One that does not say what acts on its weight is not examined.
    effects : sequence of str
        Names of those in the model: where one of them may be the reason, the fit has to tell.
    known : collection of str
        Constants of the rig that are parameters of the model and known beforehand too well to be the reason.

    Raises
    ------
    DataError
        With the factor, and what to check.
    """
    found_too = {parameter.name for parameter in rig.parameters} & {condition.name for condition in rig.conditions}
    if rig.pulled is None or found_too - set(known) or any(name.startswith(EXPLAINED) for name in effects):
        return
    for trace in traces:
        position, force = trace.channels.get("position"), trace.channels.get("force")
        if position is None or force is None:
            continue
        pulled = rig.pulled(trace.conditions, position)
        sizes = newton_of(trace.times, position, force, pulled)
        # Sizes are believed where Newton's law with them explains more of the positions than it leaves.
        if sizes is None or not sizes.explained >= 0.5:
            continue
        # Gravity alone is no reason: a slope or a zero that is stated wrongly can be found, and the fit tells it.
        if not (sizes.force > 0.0 and is_off(sizes.force, sizes.force_error)):
            continue
        law = "a weight that moves as gravity and the measured force have it"
        falls = is_off(sizes.gravity, sizes.gravity_error)
        if falls and sizes.gravity and not is_off(sizes.force / sizes.gravity, 0.0):
            times = format_number(sizes.gravity, 3)
            got = f"the weight is accelerated by {times} times what gravity and the measured force do"
            pace, clock = format_number(1.0 / sizes.gravity, 3), format_number(np.sqrt(sizes.gravity), 3)
            do = f"Check the scale and unit of the position, which would be off by {pace}, or that of the times by "
            raise DataError(trace.name, got, law, f"{do}{clock} (the rate, a decimation).")
        got = f"the measured force is {format_number(1.0 / sizes.force, 3)} times the one that moves the weight so"
        do = f"Check the scale and unit of the force, to be multiplied by {format_number(sizes.force, 3)}, or "
        do += f"weight_mass: with {format_quantity(pulled.mass / sizes.force, 'kg', 2)} in motion the force would fit."
        raise DataError(trace.name, got, law, do)


def rules_out_a_factor(relative: float) -> bool:
    """Whether a value known with such a relative standard deviation is not off by what is refused as misread."""
    return PROVEN_FACTOR * relative < MISREAD - 1.0


def is_off(size: float, error: float) -> bool:
    """Whether a size that should be 1 is surely another one."""
    return abs(size - 1.0) > PROVEN_FACTOR * error and not 1.0 / MISREAD < size < MISREAD


SPAN = 5e-3
"""Time over which readings are averaged, in s: noise is small then, and impacts are still seen."""


def force_and_position_exchanged(traces: Sequence[Trace]) -> bool:
    """Whether the force of every record is the smoother one of the two.

    A force accelerates a mass, and a position is the double integral of its acceleration: whatever their units, a
    position is smoother than a force. The roughness of the position is 0.01 to 0.5 of that of the force in the records
    of drops, of driven weights and of guided masses at hand, so that it would be 2 to 100 times where the two are
    exchanged; the limit is 1. Where nothing moves both are noise, which is rougher than its own spread: what stands in
    the place of the force must be smooth, as the position of something that moves is.

    Parameters
    ----------
    traces : sequence of Trace
        Records without both a force and a position say nothing.
    """
    pairs = [(trace.times, _readings(trace, "position"), _readings(trace, "force")) for trace in traces]
    rough = [
        (roughness(times, position), roughness(times, force))
        for times, position, force in pairs
        if position is not None and force is not None
    ]
    return bool(rough) and all(force < min(position, 1.0) for position, force in rough)


def roughness(times: np.ndarray, values: np.ndarray) -> float:
    """Second differences of a signal over `SPAN` beside its own spread; a pure number.

    Parameters
    ----------
    times : (n_time,) in s
    values : (n_time,)
        Any unit; NaN where there is none.
    """
    there = np.isfinite(values)
    if there.sum() < 2 or not np.ptp(values[there]) > 0.0:
        return np.nan
    number = max(1, round(SPAN / float(np.median(np.diff(times)))))
    blocks = len(times) // number
    whole = np.interp(times, times[there], values[there])
    means = whole[: blocks * number].reshape(blocks, number).mean(axis=1)
    if blocks < FEWEST_READINGS or not np.ptp(means) > 0.0:
        return np.nan
    return float(np.sqrt(np.mean(np.diff(means, 2) ** 2)) / np.std(means))


def _readings(trace: Trace, role: str) -> np.ndarray | None:
    if role in trace.channels:
        return np.asarray(trace.channels[role])
    # An input is kept with its readings beside what was made of them.
    return np.asarray(trace.inputs[role])[:, -1] if role in trace.inputs else None
