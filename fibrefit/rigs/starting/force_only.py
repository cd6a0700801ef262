"""Starting values of a fall of which force alone was measured: the first catch gives all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Starting, Stated
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.starting.fibre_mass import SMOOTHED_DROP
from fibrefit.rigs.thresholds import CAUGHT


def starting_force_only(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """The first catch gives stiffness, damping and the speed at take-up, that speed the lift and the release.

    Law
    ---
    From take-up on ``v = v0 + ∫ (a - F/m)`` and ``x = ∫ v``; ``F = k x + b v`` is linear in k, b, k v0 and b v0.

    Parameters
    ----------
    traces : sequence of Trace
        Force in N over time in s, one a record; mass, inclination and, where it is known, lift among its conditions.
    stated : sequence of mapping
        What each record states of itself, such as its ``release`` in s.
    initial : mapping
        Values the study gives.

    Raises
    ------
    DataError
        If a weight would have fallen before the first sample.
    """
    caught = [_catch(trace) for trace in traces]
    stiffness, damping, lifts = (np.array([one[i] for one in caught]) for i in (0, 1, 2))
    lift = np.array([t.conditions["lift"] for t in traces])
    lift = np.where(np.isnan(lift), lifts, lift)
    pull = np.array([STANDARD_GRAVITY * np.sin(trace.conditions["inclination"]) for trace in traces])
    taken, over = (np.array([one[i] for one in caught]) for i in (3, 4))
    release = np.array([said.get("release", np.nan) for said in stated]) if stated else np.full(len(traces), np.nan)
    release = np.where(np.isnan(release), taken - np.sqrt(2.0 * lift / pull), release)
    for trace, begun in zip(traces, release, strict=True):
        if begun < trace.times[0]:
            do = "Let the record begin before the weight is let go."
            raise DataError(trace.name, "the weight falls before the first sample", "the whole fall", do)
    weight = np.array([_mass(trace) * STANDARD_GRAVITY for trace in traces])
    return Starting(
        shared={
            "stiffness": float(np.median(stiffness)),
            "damping": float(max(np.median(damping), 1e-4 * np.median(stiffness))),
            "friction": 0.01 * float(np.median(weight)),
        },
        each={"release": release, "lift": lift},
        moving=release,
        settled=over,
        spread={"stiffness": 1.5, "damping": 5.0, "friction": 5.0},
    )


def _mass(trace: Trace) -> float:
    return trace.conditions["weight_mass"] + trace.conditions["added_mass"]


def _catch(trace: Trace) -> tuple[float, float, float, float, float]:
    """Stiffness, damping, lift, instant of take-up, and the end of the first contact."""
    force, times = trace.channels["force"], trace.times
    seen = np.isfinite(force)
    force = np.interp(times, times[seen], force[seen])
    held = [rest for rest in rests(trace) if rest.start == 0]
    force = force - (float(np.mean(force[held[0]])) if held else float(np.min(force)))
    taut = derivative(force, times, SMOOTHED_DROP, 0) > CAUGHT * force.max()
    if not force.max() > 0.0 or taut[0]:
        do = "Check the sign of the force, and let the record begin before the fall."
        raise DataError(trace.name, "no catch in the force", "a force that rises from rest as a fibre goes taut", do)
    first = int(np.argmax(taut))
    peak = first + int(np.argmax(force[first : first + _until_slack(taut, first)]))
    last = first + _until_slack(taut, first)
    over = min(last, len(times) - 1, peak + max(2 * (peak - first), 4))
    inside = slice(first, over + 1)
    step, t = float(np.diff(times).mean()), times[inside] - times[first]
    pull = STANDARD_GRAVITY * np.sin(trace.conditions["inclination"])
    speed = np.cumsum(pull - force[inside] / _mass(trace)) * step
    columns = np.column_stack([np.cumsum(speed) * step, speed, t, np.ones_like(t)])
    (stiffness, damping, rise, _), *_ = np.linalg.lstsq(columns, force[inside], rcond=None)
    if not stiffness > 0.0:
        quarter = max(times[peak] - times[first], 2.0 * step)
        stiffness, rise = _mass(trace) * (0.5 * np.pi / quarter) ** 2, 0.0
    speed_at_take_up = rise / stiffness if rise > 0.0 else force.max() / np.sqrt(stiffness * _mass(trace))
    return (
        float(stiffness),
        float(damping),
        float(speed_at_take_up**2 / (2.0 * pull)),
        float(times[first]),
        float(times[over]),
    )


def _until_slack(taut: np.ndarray, first: int) -> int:
    """Samples from take-up until the fibre goes slack, or to the end."""
    slack = ~taut[first:]
    return int(np.argmax(slack)) if slack.any() else len(taut) - first
