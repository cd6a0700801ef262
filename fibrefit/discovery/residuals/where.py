"""Where model and measurement part: which record, channel, time and phase."""

from __future__ import annotations

import numpy as np

from fibrefit.core.declarations import FORWARDS, HELD, PHASES, TAUT, Statement
from fibrefit.discovery.engine.thresholds import BY_ITSELF, HAPPENED, LOUDER_STILL, OF_TIME, ONE_WAY
from fibrefit.discovery.residuals.chance import loudest
from fibrefit.discovery.residuals.contacts import after_take_up
from fibrefit.discovery.residuals.events import events
from fibrefit.discovery.residuals.residuals import SHORTEST_WINDOW, ChannelResidual, channel_residuals
from fibrefit.discovery.residuals.spectrum import narrow_band, spectrum_of
from fibrefit.problem import ResidualSet
from fibrefit.study.summaries.discovery import GapPlace

SPANS = (1, 4, 16)
"""Lengths of the windows in units of that: what is too weak to be seen in short ones may last."""
MOST = 6
"""Places that are listed."""


def places(found: ResidualSet) -> tuple[GapPlace, ...]:
    """Stretches that hold most of the gap, the largest share first.

    Parameters
    ----------
    found : ResidualSet
        An identification, or what any other fit leaves.

    Returns
    -------
    tuple of GapPlace
        At most `MOST`; none where the residuals are noise, but for one series in a hundred.
    """
    records, channels = found.problem.layout.records, found.channels
    pieces = channel_residuals(found)
    trials = sum(len(piece.times) // piece.window // span for piece in pieces for span in SPANS)
    listed = []
    for piece in pieces:
        width = piece.window
        for first, last in _runs(_loud(piece, width, trials)):
            inside = slice(first * width, last * width)
            phase = PHASES[int(np.bincount(piece.phase[inside]).argmax())]
            excess = float(piece.excess[inside].sum())
            start, stop = float(piece.times[inside.start]), float(piece.times[inside.stop - 1])
            listed.append((excess, records[piece.record], channels[piece.channel], phase, start, stop))
    listed.sort(reverse=True)
    # The same whole as that of the phases, and never less than what is listed.
    whole = max(sum(_by_phase(pieces).values()), sum(max(excess, 0.0) for excess, *_ in listed)) or 1.0
    return tuple(
        GapPlace(record=record, channel=channel, phase=phase, from_s=start, to_s=stop, share=excess / whole)
        for excess, record, channel, phase, start, stop in listed[:MOST]
    )


def _loud(piece: ChannelResidual, width: int, trials: int) -> np.ndarray:
    """Whether each window of `width` samples is louder than noise gets by chance, by itself or among its neighbours."""
    number = len(piece.times) // width
    cut = lambda values: values[: number * width].reshape(number, width).sum(axis=1)  # noqa: E731
    sums, counted = cut(np.where(piece.counted, piece.residual**2, 0.0)), cut(piece.counted.astype(float))
    loud = np.zeros(number, dtype=bool)
    for span in SPANS:
        if (groups := number // span) == 0:
            break
        # What was loud by itself says nothing of what lies around it.
        quiet = np.where(loud, 0.0, 1.0)
        whole, counts = ((quiet * part)[: groups * span].reshape(groups, span).sum(axis=1) for part in (sums, counted))
        known = counts > 0.5 * span * width
        powers = np.where(known, whole / np.maximum(counts, 1.0), 0.0)
        limit = loudest(piece.noise, span * width, len(piece.times), piece.rate, trials)
        usual = float(np.median(powers[known])) if known.any() else 1.0
        loud[: groups * span] |= np.repeat(powers > max(limit, 1.0 + LOUDER_STILL * (usual - 1.0)), span)
    return loud


def phase_shares(found: ResidualSet) -> dict[tuple[str, str], float]:
    """Share of the gap beyond noise in each channel and phase."""
    channels, excess = found.channels, _by_phase(channel_residuals(found))
    shares = {
        (channel, phase): excess.get((c, p), 0.0)
        for c, channel in enumerate(channels)
        for p, phase in enumerate(PHASES)
    }
    whole = sum(shares.values()) or 1.0
    return {key: share / whole for key, share in shares.items()}


def _by_phase(pieces: list[ChannelResidual]) -> dict[tuple[int, int], float]:
    """Gap beyond noise, in units of the noise, by channel and phase; zero where there is less than noise leaves."""
    sums: dict[tuple[int, int], float] = {}
    for piece in pieces:
        for phase, excess in enumerate(np.bincount(piece.phase, piece.excess, len(PHASES))):
            sums[piece.channel, phase] = sums.get((piece.channel, phase), 0.0) + float(excess)
    return {key: max(excess, 0.0) for key, excess in sums.items()}


def most_of(found: ResidualSet) -> Statement:
    """Where most of the gap lies: ``place``, or ``no_place`` where it lies nowhere.

    Channel and phase; how soon after the fibre goes taut and whether it depends on the speed at which it does; whether
    it belongs to one direction of sliding or to a moving drive; and a band of frequencies. Each is named only where it
    is beyond what noise would show.
    """
    pieces = channel_residuals(found)
    excess = _by_phase(pieces)
    sure = [key for key in excess if _is_sure([p for p in pieces if p.channel == key[0]], key[1], len(excess))]
    if not sure:
        return Statement("no_place")
    c, phase = max(sure, key=lambda key: excess[key])
    channel, own = found.channels[c], [piece for piece in pieces if piece.channel == c]
    share = excess[c, phase] / sum(excess.values())
    facts = {
        "channel": channel,
        "phase": PHASES[phase],
        "share": share,
        "ways": _ways(found, c, phase),
        "band": narrow_band(spectrum_of(own), own[0].noise),
    }
    return Statement("place", facts | (after_take_up(found, own, phase) if phase in TAUT else {}))


def _is_sure(own: list[ChannelResidual], phase: int, trials: int) -> bool:
    """Whether a channel is louder in a phase than noise gets by chance, as if the phase lasted without a break."""
    inside = [piece.counted & (piece.phase == phase) for piece in own]
    number = sum(int(one.sum()) for one in inside)
    if number == 0:
        return False
    power = sum(float(np.sum(piece.residual[one] ** 2)) for piece, one in zip(own, inside, strict=True)) / number
    longest = max(own, key=lambda piece: len(piece.times))
    return power > loudest(longest.noise, number, len(longest.times), longest.rate, trials)


def _ways(found: ResidualSet, channel: int, phase: int) -> tuple[tuple[str, str], ...]:
    """What the guide or the drive does where nearly all of that gap lies, if they do not do it most of the time."""
    moved, up, down = found.motion, *found.problem.model.rig.directions
    ways: list[tuple[tuple[str, str], np.ndarray]] = []
    if moved.sliding is not None and phase < FORWARDS:
        ways += [(("sliding", up), moved.sliding == 1), (("sliding", down), moved.sliding == -1)]
    if moved.driven is not None and phase != HELD:
        ways += [(("the drive", "moves"), moved.driven), (("the drive", "is at rest"), ~moved.driven)]
    counted = np.asarray(found.problem.observations.weight[found.channels[channel]]) > 0.0
    inside = counted & (moved.phase == phase)
    excess = np.where(inside, found.residuals[:, channel] ** 2 - 1.0, 0.0)
    return tuple(
        way
        for way, mask in ways
        if excess[mask].sum() > ONE_WAY * excess.sum() and (inside & mask).sum() < OF_TIME * inside.sum()
    )


def event_of(found: ResidualSet) -> Statement | None:
    """Records that depart from the model at some instant and go on so; None where none does."""
    if (one := onset(found)) is not None:
        return Statement(
            "event", {"record": one[0], "instant": one[1], "others": len(found.problem.layout.records) > 1}
        )
    departing = tuple(events(found))
    return Statement("events", {"departing": departing}) if departing else None


def onset(found: ResidualSet) -> tuple[str, float] | None:
    """Record and instant [s] from which one record alone departs from the model; None if others do too.

    Of a series of one record it is the instant of its event; `events` tells of any number.
    """
    if len(found.problem.layout.records) == 1:
        return next(iter(events(found)), None)
    gaps = {}
    for r, record in enumerate(found.problem.layout.records):
        count = int(np.asarray(found.problem.observations.experiment.count)[r])
        gaps[record] = float(np.mean(found.residuals[r, :, :count] ** 2))
    worst = max(gaps, key=lambda record: gaps[record])
    others = [gap for record, gap in gaps.items() if record != worst]
    if not others or gaps[worst] < BY_ITSELF * max(others):
        return None
    r = found.problem.layout.records.index(worst)
    times = np.asarray(found.problem.observations.experiment.times)[r]
    step = float(times[1] - times[0])
    width = max(round(SHORTEST_WINDOW / step), 4)
    squares = (found.residuals[r] ** 2).max(axis=0)
    blocks = squares[: len(squares) // width * width].reshape(-1, width).mean(axis=1)
    loud = np.flatnonzero(blocks > HAPPENED)
    return (worst, float(times[loud[0] * width])) if len(loud) else None


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Runs of true flags as (first, past last), those a window apart joined."""
    edges = np.flatnonzero(np.diff(np.r_[0, flags.astype(int), 0]))
    runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    joined: list[tuple[int, int]] = []
    for first, last in runs:
        if joined and first - joined[-1][1] <= 1:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined
