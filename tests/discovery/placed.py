"""Brackets of what decides where a gap is said to lie, and when something is said to have happened."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.core.declarations import LOADING, SLACK, STICKING
from fibrefit.discovery.residuals import chance, contacts, events, spectrum, where
from fibrefit.discovery.residuals.residuals import channel_residuals
from fibrefit.discovery.residuals.spectrum import Spectrum
from fibrefit.problem.noise.spectrum import Noise
from tests.brackets import Bracket
from tests.discovery.left import BOUNCE, COUNT, noise_alone, of_colour, with_gap

SAMPLE = np.arange(COUNT)
WIDTH = 20
"""Samples of a window."""
WAVE = 20.0 * np.sin(0.7 * SAMPLE)


def one_way(share: float, of_time: float = 0.5) -> bool:
    """Whether a gap with such a share of it while the guide slides up, for such a share of the time, is said to."""
    up = (np.arange(1000) < 1000 * of_time)[None]
    excess = np.where(up, share / up.sum(), (1.0 - share) / (~up).sum()) * 1e3
    data = SimpleNamespace(weight={"force": np.ones((1, 1000))})
    rig = SimpleNamespace(directions=("up", "down"))
    moved = SimpleNamespace(sliding=np.where(up, 1, -1), driven=None, phase=np.full((1, 1000), SLACK))
    problem = SimpleNamespace(observations=data, model=SimpleNamespace(rig=rig))
    found: Any = SimpleNamespace(
        motion=moved, problem=problem, channels=("force",), residuals=np.sqrt(1.0 + excess)[:, None]
    )
    return ("sliding", "up") in where._ways(found, 0, SLACK)


def stands_out(ratio: float) -> bool:
    """Whether a window with so many times the excess of the others is told."""
    power = np.full(64, 5.0)
    power[10] = 1.0 + 4.0 * ratio
    piece: Any = SimpleNamespace(
        times=np.arange(64 * WIDTH), residual=np.sqrt(np.repeat(power, WIDTH)), counted=np.ones(64 * WIDTH, dtype=bool),
        noise=None, rate=1.0,
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(where, "loudest", lambda *given: 1.5)
        return bool(where._loud(piece, WIDTH, 1)[10])


def parts(worst: float, other: float, block: float) -> bool:
    """Whether one record is said to depart from the model, by its mean squares, those of another, and of a window."""
    squares = np.full((2, 1, COUNT), other)
    squares[1] = (worst * COUNT - block * WIDTH) / (COUNT - WIDTH)
    squares[1, 0, -WIDTH:] = block
    times = np.tile(SAMPLE / 2000.0, (2, 1))
    experiment = SimpleNamespace(count=np.full(2, COUNT), times=times)
    problem = SimpleNamespace(
        layout=SimpleNamespace(records=("a", "b")), observations=SimpleNamespace(experiment=experiment)
    )
    return where.onset(SimpleNamespace(problem=problem, residuals=np.sqrt(squares))) is not None  # type: ignore[arg-type]


def within(share: float, part: float) -> float | None:
    """Time in which most of a gap is said to lie, of which a share lies evenly in the first part of the time."""
    since = np.linspace(0.0, 1.0, 3000)
    early = since < part
    excess = np.where(early, share / early.sum(), (1.0 - share) / (~early).sum())
    contact: Any = SimpleNamespace(channel=SimpleNamespace(noise=None, times=since, rate=1.0))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(contacts, "_since", lambda contact, phase: (since, excess))
        patched.setattr(contacts, "loudest", lambda *given: 0.0)
        return contacts.soon([contact], LOADING)[0]


def lies_soon(share: float) -> bool:
    """Whether most of a gap is said to lie in the tenth of the time that holds such a share of it."""
    found = within(share, 0.1)
    return found is not None and found < 0.15


def ordered(chance: float, number: float = 8, samples: float = 20) -> bool:
    """Whether so many contacts of so many samples, whose order has such a probability, are said to have one."""
    one: Any = SimpleNamespace(speed=1.0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(contacts, "_since", lambda contact, phase: (np.zeros(int(samples)), np.ones(int(samples))))
        patched.setattr("scipy.stats.kendalltau", lambda *given: SimpleNamespace(pvalue=chance, statistic=1.0))
        return contacts.trend([one] * int(number), LOADING, None) is not None


def band(share: float, number: float = 8, at: float = 200.0, line: float = 0.0) -> bool:
    """Whether a gap with such a share of it at so many frequencies near one is said to lie there."""
    near = at + 0.1 * np.arange(int(number))
    frequency = np.sort(np.concatenate([near, np.geomspace(1e3, 1e5, 200)]))
    held = np.isin(frequency, near)
    power = np.where(held, share / held.sum(), (1.0 - share) / (~held).sum())
    found = Spectrum(frequency, power, np.zeros(len(power)), (0.0, 1.0))
    return spectrum.narrow_band(found, Noise(1.0, 0.0, line, 1000)) is not None


def beyond(probability: float) -> bool:
    """Whether noise with such a probability to be louder is drawn beyond the upper limit of a spectrum."""
    from scipy.stats import chi2

    own = [piece for piece in channel_residuals(noise_alone(0, records=1)) if piece.channel == 0]
    freedom = 2.0 * spectrum.OVERLAP * 3
    return float(chi2.ppf(1.0 - probability, freedom) / freedom) > spectrum.spectrum_of(own).chance[1]


def happens(gap: np.ndarray, **changed: Any) -> bool:
    """Whether an event is seen in one record with such a gap."""
    left = with_gap(noise_alone(0, records=1), gap)
    return events.events(replace(left, motion=replace(left.motion, **changed))) != ()


def at_the_end(windows: float) -> bool:
    """Whether what happens so many windows before the end is an event."""
    return happens(np.where(COUNT - WIDTH * windows <= SAMPLE, WAVE, 0.0))


def lasts(share: float) -> bool:
    """Whether what is seen in such a share of the windows after it, and in all of the first ones, is an event."""
    after = (SAMPLE - 1120) // WIDTH
    on = (after >= 0) & ((after < 5) | (np.floor((after + 1) * share) > np.floor(after * share)))
    return happens(np.where(on, WAVE, 0.0))


def at_once(share: float) -> bool:
    """Whether what begins with such a share of what it comes to is an event."""
    size = np.where(SAMPLE < 1120 + 5 * WIDTH, np.sqrt(share), 1.0)
    return happens(np.where(SAMPLE >= 1120, size * WAVE, 0.0))


def known_phase(windows: float) -> bool:
    """Whether an event in a phase is seen that there was for so many windows before."""
    stuck = (SAMPLE >= 1120) | ((SAMPLE >= 400) & (400 + WIDTH * windows > SAMPLE))
    return happens(np.where(SAMPLE >= 1120, WAVE, 0.0), phase=np.where(stuck, STICKING, SLACK)[None], states={})


def known_state(beyond: float) -> bool:
    """Whether an event is seen where a state is beyond its range by such a share of it."""
    state = np.where(SAMPLE >= 1120, 1.0 + beyond, (SAMPLE % BOUNCE) / (BOUNCE - 1.0))
    phase = np.full((1, COUNT), SLACK)
    return happens(np.where(SAMPLE >= 1120, WAVE, 0.0), phase=phase, states={"position": state[None]})


def limit(samples: int, rests: int) -> float:
    """Mean square of samples of white noise beyond which they are loud, known from so many at rest."""
    return chance.loudest.__wrapped__(of_colour(0.0, rests), samples, COUNT, 2000.0, 1)


def left_out(samples: float) -> bool:
    """Whether the lowest frequencies are left out of the spectrum of segments of so many samples."""
    (piece,) = (piece for piece in channel_residuals(noise_alone(0, records=1)) if piece.channel == 0)
    first = slice(0, 2 * int(samples))
    short = piece._replace(residual=piece.residual[first], times=piece.times[first])
    frequency = spectrum.spectrum_of([short]).frequency
    return float(frequency[0]) > 1.5 * float(frequency[1] - frequency[0])


PLACES = (
    Bracket("SHORTEST_SEGMENT", spectrum, left_out, 33.0, 31.0),
    Bracket("WRONGLY", chance, lambda x: x < limit(WIDTH, 0), 2.24, 2.34),
    Bracket("KNOWN", chance, lambda x: 1.0 + x * 0.1 < limit(WIDTH, 200) / limit(WIDTH, 0), 2.5, 4.5),
    Bracket("LOUDER_STILL", where, lambda x: not stands_out(x), 1.8, 2.2),
    Bracket("ONE_WAY", where, one_way, 0.85, 0.75),
    Bracket("OF_TIME", where, lambda x: one_way(0.999, x), 0.6, 0.8),
    Bracket("BY_ITSELF", where, lambda x: not parts(x, 1.0, 100.0), 1.8, 2.2),
    Bracket("HAPPENED", where, lambda x: not parts(0.5, 0.1, x), 7.0, 9.0),
    Bracket("SOON", contacts, lies_soon, 0.7, 0.6),
    Bracket("DENSE", contacts, lambda x: within(0.72, 0.72 / x) is not None, 2.2, 1.8),
    Bracket("ORDERED", contacts, ordered, 0.008, 0.012),
    Bracket("FEWEST_CONTACTS", contacts, lambda x: ordered(1e-4, x), 7.0, 5.0),
    Bracket("FEWEST_IN_CONTACT", contacts, lambda x: ordered(1e-4, samples=x), 5.0, 3.0),
    Bracket("NARROW", spectrum, band, 0.55, 0.45),
    Bracket("FEWEST_IN_BAND", spectrum, lambda x: band(1.0, x), 4.0, 2.0),
    Bracket("BESIDE_MAINS", spectrum, lambda x: band(1.0, at=60.0 + x, line=1e-3), 5.0, 3.0),
    Bracket("OUTSIDE", spectrum, beyond, 0.02, 0.03),
    Bracket("AROUND_EVENT", events, at_the_end, 11.0, 9.0),
    Bracket("LOUD_AFTER", events, lasts, 0.72, 0.6),
    Bracket("LOUD_AT_ONCE", events, at_once, 0.3, 0.2),
    Bracket("PHASE_SEEN", events, known_phase, 4.0, 2.0),
    Bracket("STRETCHED", events, known_state, 0.015, 0.03),
)
