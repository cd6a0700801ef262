"""What this project does, in the forms that are timed."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from tests.benchmarks.problem import STUDY  # first: it settles how JAX is set up

# isort: split
import jax
import jax.numpy as jnp

from fibrefit.fitting.search.solve import descend, widths
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Experiment, Model

NAMES = ("stiffness", "damping", "friction", "release", "position_zero")
"""In the order of the hand-written sensitivities."""
EFFECTS = (
    "guide.viscous_friction",
    "guide.stribeck_friction",
    "guide.load_dependent_friction",
    "guide.quadratic_drag",
    "fibre.hardening",
    "fibre.rate_dependent_damping",
)
"""Seven parameters more: twelve in all."""
MASS, LIFT, INCLINATION, STEP, GRAVITY = 3.096, 0.012, math.pi / 2, 5e-4, 9.81

Channels = dict[str, jax.Array]


def respond(n_time: int, effects: tuple[str, ...] = ()) -> Callable[[jax.Array], Channels]:
    """Readings of a drop as a function of its parameters, `NAMES` and then those of the effects."""
    model = Model(RIGS["fibre_mass"], tuple(CATALOGUE[name] for name in effects))
    held = {"weight_mass": MASS, "added_mass": 0.0, "inclination": INCLINATION, "lift": LIFT}
    experiment = Experiment(
        jnp.arange(n_time) * STEP, jnp.int32(n_time), {name: jnp.float64(value) for name, value in held.items()}, {}
    )
    names = NAMES + tuple(parameter.name for parameter in model.parameters[3:])

    def channels(values: jax.Array) -> Channels:
        return model.respond(dict(zip(names, values, strict=True)), experiment).channels

    return channels


def start(base: tuple[float, float, float], effects: tuple[str, ...] = ()) -> jax.Array:
    """Parameters for `respond`; effects at a twentieth of their typical size."""
    model = Model(RIGS["fibre_mass"], tuple(CATALOGUE[name] for name in effects))
    more = [p.typical if p.log else p.null + 0.05 * (p.typical - p.null) for p in model.parameters[3:]]
    return jnp.array([*base, 0.01, 0.0, *more])


@cache
def programs(n_time: int, effects: tuple[str, ...] = ()) -> dict[str, Callable]:
    """Compiled forms: one run, one Jacobian, and batches of either."""
    one = respond(n_time, effects)
    slopes = jax.jacfwd(one)

    def in_turn(function: Callable) -> Callable:
        return lambda rows: jax.lax.map(function, rows)

    return {
        "run": jax.jit(one),
        "jacobian": jax.jit(slopes),
        "run, vmap": jax.jit(jax.vmap(one)),
        "jacobian, vmap": jax.jit(jax.vmap(slopes)),
        "run, in turn": jax.jit(in_turn(one)),
        "jacobian, in turn": jax.jit(in_turn(slopes)),
    }


def done(function: Callable, *given: object) -> Callable[[], object]:
    """Call that waits for its result."""
    return lambda: jax.block_until_ready(function(*given))


def fit(task: Task) -> np.ndarray:
    """Fit from the start that the data suggest: scale of the steps, then descent over growing horizons."""
    problem = task.problem
    free = problem.layout.free(task.start)
    found = descend(problem, free, widths(problem, free), task.counts)
    return problem.layout.values(np.asarray(found.free))


def whole_fit(starts: int) -> Callable[[], object]:
    """The public way: reading, 32 starts, error bars and checks."""
    import fibrefit

    study = fibrefit.load_study(STUDY)
    return lambda: fibrefit.fit(study, starts=starts)


def command_line(cache_folder: Path) -> Callable[[], object]:
    """`fibrefit fit` from a cold prompt with the compile cache in a folder."""

    def run() -> None:
        with tempfile.TemporaryDirectory() as out:
            _in_a_process(["fibrefit", "fit", str(STUDY), "--out", f"{out}/fit"], cache_folder, (0, 5))

    return run


def alone(cache_folder: Path) -> Callable[[], object]:
    """One fit from one start in a process of its own."""
    return lambda: _in_a_process(["tests.benchmarks.alone"], cache_folder, (0,))


def _in_a_process(command: list[str], cache_folder: Path, expected: tuple[int, ...]) -> None:
    environment = {**os.environ, "FIBREFIT_CACHE": str(cache_folder)}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    whole = [sys.executable, "-m", *command]
    done = subprocess.run(whole, env=environment, capture_output=True, cwd=STUDY.parents[2], check=False)
    if done.returncode not in expected:
        raise RuntimeError(done.stderr.decode())
