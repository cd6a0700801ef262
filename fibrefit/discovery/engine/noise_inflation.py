"""The colour of the noise as an effect meets it: chance gains of one that acts slowly are those of slow noise.

Law
---
An effect's parameter changes the residuals by ``s`` beyond what all other values can imitate. With noise of covariance
``N`` it gains ``(s'n)² / s's`` by chance, on average ``s'N s / s's``: the power of the noise where the effect has its
own. Where errors of inputs are eliminated (``P = (I + A A')⁻¹``), ``q = P s`` takes the place of ``s``, and the gain by
chance is ``(q'N q + |A'q|²) / s'q``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis, alone
from fibrefit.discovery.engine.refit import STEP
from fibrefit.discovery.engine.supermodel import Reactions
from fibrefit.effects.law import Effect
from fibrefit.problem.inputs.errors_in_variables import Waves, input_errors, residuals
from fibrefit.problem.inputs.linearity_weights import faded
from fibrefit.problem.statement.layout import assembled
from fibrefit.problem.task import Task

SEEN = 1e-10
"""Share of the largest eigenvalue of the scaled normal matrix below which nothing is seen."""


def colour_of(task: Task, hypothesis: Hypothesis, added: Sequence[type[Effect]]) -> float:
    """Mean gain by chance of a parameter of the added effects, the largest of them; 1 where the noise is white.

    Parameters
    ----------
    task : Task
        Of the model the search began with.
    hypothesis : Hypothesis
        With the effects added.
    added : sequence of Effect classes
    """
    own, values = alone(task, hypothesis)
    layout, reactions = own.problem.layout, hypothesis.frame.reactions
    slopes = _slopes(own, hypothesis, values)
    kept = slopes if reactions is None else _beyond_waves(slopes, reactions)
    normal = assembled(slopes @ kept.transpose(0, 2, 1), layout.local_columns, layout.size)
    names = {f"{effect.name}.{parameter.name}" for effect in added for parameter in effect.parameters}
    wanted = [i for i, (slot, _) in enumerate(layout.entries) if slot.name in names]
    return max(1.0, *(_chance(own, normal, kept, reactions, i) for i in wanted))


def _slopes(task: Task, hypothesis: Hypothesis, values: np.ndarray) -> np.ndarray:
    """How the residuals move with each free value of a record, ``(n_record, n_local_free, n_channel * n_time)``."""
    reactions, layout = hypothesis.frame.reactions, task.problem.layout
    problem = task.problem if reactions is None else faded(task.problem, reactions.fade)
    known = {} if reactions is None else input_errors(task)
    waves: Waves = {} if reactions is None else reactions.waves
    here, rows = residuals(problem, known, values, waves), []
    for slot in (layout.slots[i] for i in layout.local_free):
        size = 0.01 * abs(hypothesis.frame.declared[slot.name].typical)
        moved, steps = values.copy(), np.ones(len(layout.records))
        for i, (other, record) in enumerate(layout.entries):
            if other.name == slot.name:
                step = STEP * max(abs(values[i]), size)
                moved[i] += step
                steps[slice(None) if record is None else record] = step
        there = residuals(problem, known, moved, waves)
        rows.append((there - here).reshape(len(here), -1) / steps[:, None])
    return np.stack(rows, axis=1)


def _beyond_waves(slopes: np.ndarray, reactions: Reactions) -> np.ndarray:
    """What of the slopes no error of the inputs imitates: ``P`` times each."""
    kept = []
    for own, rows, inverse in zip(slopes, reactions.rows, reactions.inverse, strict=True):
        rows = np.asarray(rows, dtype=float)
        kept.append(own - (own @ rows.T) @ np.asarray(inverse) @ rows)
    return np.stack(kept)


def _chance(task: Task, normal: np.ndarray, kept: np.ndarray, reactions: Reactions | None, wanted: int) -> float:
    """Mean gain by chance of one value, see the law above."""
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=SEEN, hermitian=True)
    direction = inverse[:, wanted] / scale
    length, gain = direction @ normal @ direction, 0.0
    if length <= 0.0:
        return 1.0
    channels, padded = task.problem.model.rig.channels, np.append(direction, [0.0, 0.0])
    for r, trace in enumerate(task.traces):
        part = padded[task.problem.layout.local_columns[r]] @ kept[r]
        rate = 1.0 / float(np.diff(trace.times).mean())
        for channel, wave in zip(channels, part.reshape(len(channels), -1), strict=True):
            gain += _power(task, channel, wave[: len(trace.times)], rate)
        if reactions is not None:
            gain += float(np.sum((np.asarray(reactions.rows[r], dtype=float) @ part) ** 2))
    return gain / length


def _power(task: Task, channel: str, wave: np.ndarray, rate: float) -> float:
    """``s'N s`` of one channel of one record, for noise of mean power one."""
    size = len(wave)
    frequency = np.fft.rfftfreq(size, 1.0 / rate)
    density = task.noise[channel].over_mean(np.maximum(frequency, 0.5 * rate / size), size / rate, rate)
    squares = np.abs(np.fft.rfft(wave)) ** 2 / size
    twice = np.where((frequency > 0.0) & (frequency < 0.5 * rate), 2.0, 1.0)
    return float(np.sum(twice * squares * density))
