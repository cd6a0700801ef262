"""A small drop series whose truth is known, made by the model itself and a noise of known colour."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.fitting.search.solve import descend, widths
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.problem.statement.observations import stack
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.model import Experiment, Model

RATE = 2000.0
TRUTH = {"stiffness": 2e4, "damping": 20.0, "friction": 3.5}
NUISANCES = {"position_zero": 1e-4, "release": 0.0502}
UNITS = {"force": "N", "position": "m"}
NOISE = {"force": 0.4, "position": 2e-5}


def pink(random: np.random.Generator, size: int) -> np.ndarray:
    """Wander with a density of 1/f, of variance 1 on the average, cut from a record eight times as long."""
    longer = 8 * size
    frequency = np.fft.rfftfreq(longer)
    amplitude = np.zeros(len(frequency), complex)
    wave = random.standard_normal(len(frequency) - 1) + 1j * random.standard_normal(len(frequency) - 1)
    amplitude[1:] = wave / np.sqrt(frequency[1:])
    drawn = np.fft.irfft(amplitude, longer)
    # As a logger's user has it: the wander slower than the record is part of the zero.
    power = np.sum(1.0 / frequency[frequency >= 1.0 / size]) * 4.0 / longer**2
    return drawn[:size] / np.sqrt(power)


def series(
    random: np.random.Generator,
    truth: dict[str, float] | None = None,
    lifts: tuple[float, ...] = (5e-3, 1e-2),
    samples: int = 1000,
    share: float = 0.5,
    effects: tuple = (),
    own: list[dict[str, float]] | None = None,
) -> list[Trace]:
    """Records of a drop series; `share` is the share of the noise's amplitude that is pink.

    `truth` are values that differ from `TRUTH`, `own` those that differ from `NUISANCES`, record by record.
    """
    model = Model(RIGS["fibre_mass"], effects)
    times = np.arange(samples) / RATE
    traces = []
    for number, lift in enumerate(lifts):
        values = {**NUISANCES, **TRUTH, **(truth or {}), **(own[number] if own else {})}
        conditions = {"weight_mass": 3.096, "added_mass": 0.0, "inclination": 0.5 * np.pi, "lift": lift}
        experiment = Experiment(jnp.asarray(times), jnp.asarray(samples), conditions, {})
        clean = _respond(model, values, experiment)
        noisy = {}
        for channel, rms in NOISE.items():
            white = np.sqrt(1.0 - share**2) * random.standard_normal(samples)
            noisy[channel] = np.asarray(clean[channel]) + rms * (white + share * pink(random, samples))
        traces.append(Trace(f"drop {number}", times, noisy, {}, conditions))
    return traces


_respond = jax.jit(lambda model, values, experiment: model.respond(values, experiment).channels, static_argnums=0)


def noise_of(share: float, samples: int = 1000) -> dict[str, Noise]:
    """Spectrum of the noise that `series` adds."""
    found = {}
    for channel, rms in NOISE.items():
        folds = np.log(0.5 * RATE * samples / RATE)
        found[channel] = Noise((1.0 - share**2) * rms**2 / (0.5 * RATE), (share * rms) ** 2 / folds, 0.0, samples)
    return found


def task_of(
    traces: list[Trace],
    share: float = 0.5,
    effects: tuple = (),
    fixed: dict[str, float] | None = None,
    truth: dict[str, float] | None = None,
    own: list[dict[str, float]] | None = None,
) -> Task:
    """Task that starts at the truth."""
    rig = RIGS["fibre_mass"]
    model = Model(rig, effects)
    noise = noise_of(share, len(traces[0].times))
    held = fixed or {}
    slots = [
        Slot(p.name, p.unit, Range.of(p), True, (held[p.name],) if p.name in held else ()) for p in model.parameters
    ]
    slots += [Slot(p.name, p.unit, Range.of(p), False) for p in rig.nuisances]
    layout = Layout(tuple(slots), tuple(trace.name for trace in traces))
    rms = {c: [NOISE[c]] * len(traces) for c in rig.channels}
    each = {
        name: [(row or {}).get(name, value) for row in own or [{}] * len(traces)] for name, value in NUISANCES.items()
    }
    start = layout.pack({p.name: p.typical for p in model.parameters} | TRUTH | (truth or {}) | each)
    samples = len(traces[0].times)
    return Task(
        problem=Problem(model, layout, stack(traces, rms)),
        traces=tuple(traces),
        start=start,
        spread={},
        horizons=np.full((1, 1, len(traces)), samples, dtype=np.int32),
        noise=noise,
        input_noise={},
        noise_given=(),
        units=UNITS,
    )


def fitted(task: Task) -> np.ndarray:
    """Plain least-squares values ``(n_free,)`` from the task's start."""
    problem = task.problem
    free = problem.layout.free(jnp.asarray(task.start))
    found = descend(problem, free, widths(problem, free), jnp.asarray(task.counts))
    return np.asarray(problem.layout.values(found.free))
