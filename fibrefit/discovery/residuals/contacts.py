"""Contacts: each time a fibre goes taut, how soon after it the gap opens, and whether it goes with the speed."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fibrefit.core.declarations import SLACK, TAUT
from fibrefit.discovery.engine.thresholds import DENSE, FEWEST_CONTACTS, FEWEST_IN_CONTACT, ORDERED, SOON
from fibrefit.discovery.residuals.chance import loudest
from fibrefit.discovery.residuals.residuals import ChannelResidual
from fibrefit.problem import ResidualSet

STEPS = 60
"""Times after take-up that are tried."""


class Contact(NamedTuple):
    """One contact of the fibre.

    Parameters
    ----------
    channel : ChannelResidual
    start, stop : int
        First sample that is taut, and the one past the last.
    speed : float
        At take-up, in m/s.
    """

    channel: ChannelResidual
    start: int
    stop: int
    speed: float


def contacts(found: ResidualSet, own: list[ChannelResidual]) -> list[Contact]:
    """Contacts that begin with a slack fibre, in the order of records and time.

    Parameters
    ----------
    found : ResidualSet
    own : list of ChannelResidual
        One channel of each record.
    """
    states, listed = found.motion.states, []
    speeds = np.abs(states.get("stretch rate", states["speed"]))
    for piece in own:
        taut = np.isin(piece.phase, TAUT)
        changes = np.flatnonzero(np.diff(taut.astype(int)))
        starts = [int(i) + 1 for i in changes if taut[i + 1] and piece.phase[i] == SLACK]
        for start in starts:
            later = np.flatnonzero(~taut[start:])
            stop = start + int(later[0]) if later.size else len(taut)
            if stop - start >= FEWEST_IN_CONTACT:
                listed.append(Contact(piece, start, stop, float(speeds[piece.record, start])))
    return listed


def after_take_up(found: ResidualSet, own: list[ChannelResidual], phase: int) -> dict[str, Any]:
    """What is known of the gap of one channel in a taut phase and the take-ups before it; empty where nothing is.

    Parameters
    ----------
    found : ResidualSet
    own : list of ChannelResidual
        The channel in each record.
    phase : int

    Returns
    -------
    dict of str to object
        ``soon``, the time [s] in which most of it lies, and ``soon_share``; ``with_speed``, as `trend` has it.
    """
    listed = contacts(found, own)
    if not listed:
        return {}
    within, share = soon(listed, phase)
    return {"soon": within, "soon_share": share, "with_speed": trend(listed, phase, within)}


def soon(listed: list[Contact], phase: int) -> tuple[float | None, float]:
    """Time [s] after take-up in which most of a phase's gap lies, and its share; None where it lies everywhere."""
    since, excess = (np.concatenate(parts) for parts in zip(*(_since(c, phase) for c in listed), strict=True))
    whole = float(excess.sum())
    if whole <= 0.0 or len(since) < FEWEST_IN_CONTACT:
        return None, 0.0
    order = np.argsort(since, kind="stable")
    since, running = since[order], np.cumsum(excess[order])
    times = np.linspace(0.0, float(since[-1]), STEPS + 1)[1:]
    numbers = np.maximum(np.searchsorted(since, times, side="right"), FEWEST_IN_CONTACT)
    shares, parts = running[numbers - 1] / whole, numbers / len(since)
    # Where the gap falls furthest behind what it was soon after take-up: the knee of the curve.
    best = int(np.argmax(np.where(shares > SOON, shares - parts, -1.0)))
    piece, power = listed[0].channel, 1.0 + float(running[numbers[best] - 1]) / numbers[best]
    limit = loudest(piece.noise, int(numbers[best]), len(piece.times), piece.rate, STEPS)
    if shares[best] <= max(SOON, DENSE * parts[best]) or power <= limit:
        return None, 0.0
    return float(since[numbers[best] - 1]), float(min(shares[best], 1.0))


def trend(listed: list[Contact], phase: int, within: float | None) -> str | None:
    """``grows`` or ``shrinks`` where the gap of the contacts is ordered by the speed at take-up; None where not.

    Source
    ------
    Kendall, Biometrika 30 (1938); exact for few contacts.
    """
    from scipy.stats import kendalltau

    speeds, gaps = [], []
    for contact in listed:
        since, excess = _since(contact, phase)
        inside = since <= (np.inf if within is None else within)
        if inside.sum() >= FEWEST_IN_CONTACT:
            speeds.append(contact.speed)
            gaps.append(float(excess[inside].mean()))
    if len(speeds) < FEWEST_CONTACTS:
        return None
    found = kendalltau(speeds, gaps)
    if not found.pvalue < ORDERED:
        return None
    return "grows" if found.statistic > 0.0 else "shrinks"


def _since(contact: Contact, phase: int) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] since take-up and excess of the samples of a contact that count, in one phase."""
    piece, inside = contact.channel, slice(contact.start, contact.stop)
    chosen = (piece.phase[inside] == phase) & piece.counted[inside]
    return (piece.times[inside] - piece.times[contact.start])[chosen], piece.excess[inside][chosen]
