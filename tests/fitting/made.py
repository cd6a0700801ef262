"""Drop series that are made: the model's own motion, a logger's noise, and whatever goes wrong on the way."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.fitting.checks import check
from fibrefit.fitting.residuals import phases, spectrum, states
from fibrefit.problem.diagnose.motion import ResidualSet
from fibrefit.problem.formulation import formulate
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Experiment, Model
from fibrefit.study import Study, load_study
from fibrefit.study.summaries.check import Check

RATE = 2000.0
SAMPLES = 1000
TRUTH = {"stiffness": 2e4, "damping": 25.0, "friction": 4.0}
NUISANCES = {"position_zero": 1.3e-4, "release": 0.1234}
NOISE = {"force": 0.4, "position": 2e-5}
GRAIN = {"force": 0.02, "position": 5e-6}
MASS = 3.096
LIFTS = (5e-3, 1e-2)
STARTS = 8
"""One chunk of the search: whatever is identified in two such drops shares its compiled programs."""


@dataclass(frozen=True)
class Made:
    """A record as a reader would return it."""

    name: str
    time: np.ndarray
    channels: Mapping[str, np.ndarray]
    rate: float = RATE
    uniform: bool = True
    valid: Mapping[str, np.ndarray] = field(default_factory=dict)


def replace(one: Made, **channels: np.ndarray) -> Made:
    """The record with some channels put in the place of its own."""
    return dataclasses.replace(one, channels={**one.channels, **channels})


def pink(size: int, random: np.random.Generator) -> np.ndarray:
    """Noise with a power that falls as 1/f, of variance one, cut from a longer one so that its ends do not meet."""
    frequency = np.fft.rfftfreq(2 * size)[1:]
    power = 1.0 / frequency / np.sum(1.0 / frequency)
    wave = random.standard_normal((2, len(power)))
    spectrum = np.concatenate([[0.0], np.sqrt(0.25 * power) * (wave[0] + 1j * wave[1])])
    return (np.fft.irfft(spectrum, 2 * size) * 2.0 * size)[:size]


def coloured(size: int, share: float, random: np.random.Generator) -> np.ndarray:
    """Noise of variance one; `share` of its amplitude is pink, the rest of its power white."""
    return share * pink(size, random) + math.sqrt(1.0 - share**2) * random.standard_normal(size)


@functools.cache
def _respond(effects: tuple, tension_law: str) -> Any:
    model = Model(RIGS["fibre_mass"], effects, tension_law)
    return jax.jit(lambda values, experiment: model.respond(values, experiment).channels)


def record(
    name: str,
    lift: float,
    *,
    seed: int = 0,
    inclination: float = math.pi / 2,
    samples: int = SAMPLES,
    share: float = 0.0,
    loud: float = 1.0,
    effects: tuple = (),
    **values: float,
) -> Made:
    """One drop. `loud` scales the noise, dots of names are written ``__``."""
    random = np.random.default_rng(seed)
    known = TRUTH | NUISANCES | {key.replace("__", "."): value for key, value in values.items()}
    conditions = {"weight_mass": MASS, "added_mass": 0.0, "inclination": inclination, "lift": lift}
    times = np.arange(samples) / RATE
    experiment = Experiment(
        jnp.asarray(times), jnp.int32(samples), {k: jnp.asarray(float(v)) for k, v in conditions.items()}, {}
    )
    clean = _respond(effects, "clamped")({k: jnp.asarray(float(v)) for k, v in known.items()}, experiment)
    channels = {}
    for channel, reading in clean.items():
        noisy = np.asarray(reading) + loud * NOISE[channel] * coloured(samples, share, random)
        channels[channel] = GRAIN[channel] * np.round(noisy / GRAIN[channel])
    return Made(name, times, channels)


def records(lifts: Sequence[float] = LIFTS, seed: int = 0, **options: Any) -> list[Made]:
    """Drops from several lifts."""
    return [record(f"drop_{1e3 * lift:g}mm.csv", lift, seed=1000 * seed + i, **options) for i, lift in enumerate(lifts)]


def study(folder: Path, lifts: Sequence[float | None] = LIFTS, more: str = "", own: Sequence[str] = ()) -> Study:
    """Study of such drops: `more` is TOML to append, `own` a line for each record; a lift of None is not told."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [
        'schema = "fibrefit/study/1"',
        'name = "made"',
        "[rig]",
        'kind = "fibre_mass"',
        f'weight_mass = "{MASS} kg"',
    ]
    lines += ['inclination = "90 deg"', "[channels]", 'time = "time [s]"', 'force = "force [N]"']
    lines += ['position = "position [mm]"', more]
    for i, lift in enumerate(lifts):
        named = LIFTS[i] if lift is None else lift
        lines += ["[[records]]", f'file = "drop_{1e3 * named:g}mm.csv"']
        (folder / f"drop_{1e3 * named:g}mm.csv").touch()
        lines += [] if lift is None else [f'lift = "{1e3 * lift:g} mm"']
        lines += [own[i]] if own else []
    (folder / "study.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return load_study(folder / "study.toml")


def task(folder: Path, made: Sequence[Made] | None = None, effects: tuple = (), **options: Any) -> Task:
    """Task of a study of such drops."""
    given = study(folder, **options)
    return formulate(given, records() if made is None else made, Model(RIGS["fibre_mass"], effects))


def write(folder: Path, made: Sequence[Made]) -> None:
    """The records as CSV files, an empty cell where nothing was measured."""
    for one in made:
        columns = [one.time, one.channels["force"], 1e3 * one.channels["position"]]
        rows = ["time [s],force [N],position [mm]"]
        for t, force, position in zip(*columns, strict=True):
            cells = ["" if np.isnan(force) else f"{force:.2f}", "" if np.isnan(position) else f"{position:.3f}"]
            rows.append(",".join([f"{t:.4f}", *cells]))
        (folder / one.name).write_text("\n".join(rows) + "\n", encoding="utf-8")


def structure_checks(residual_set: ResidualSet) -> tuple[Check, ...]:
    """Checks of spectrum, phases and states, in this order."""
    return (
        check("residual_spectrum", spectrum(residual_set)),
        check("residual_phase", phases(residual_set)),
        check("residual_state", states(residual_set)),
    )
