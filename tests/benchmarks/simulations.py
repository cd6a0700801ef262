"""One run and one Jacobian, alone and in a batch, beside the hand-written loop."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tests.benchmarks import ours
from tests.benchmarks.limit import Drop, sensitive_batch, simulate, simulate_batch, simulate_sensitive
from tests.benchmarks.table import Table, against
from tests.benchmarks.timing import Contender, Stopwatch

SAMPLES = 8000
LANES = 64
CASES = {"in motion throughout": (2e4, 2.0, 0.2), "at rest after half a second": (2e4, 25.0, 4.0)}
AT_REST = "What follows costs both next to nothing but the room for the results."

SAME = 1e-6
"""Of the root mean square: both take the same Runge-Kutta steps and locate switches to rounding."""


class Limit:
    """The hand-written loop with room for its results.

    Parameters
    ----------
    lanes : (n_lane, 5) values in the order of `ours.NAMES`
    """

    def __init__(self, lanes: np.ndarray, n_time: int) -> None:
        k, b, friction, release, _ = lanes.T
        same = np.ones(len(lanes))
        weight = ours.MASS * ours.GRAVITY
        self.runs = np.column_stack([k, b, friction, same * ours.MASS, same * weight, same * ours.LIFT, release])
        self.first = Drop(*self.runs[0])
        self.force, self.position = np.empty((2, len(lanes), n_time))
        self.force_slopes, self.position_slopes = np.empty((2, len(lanes), n_time, len(ours.NAMES)))

    def run(self) -> None:
        simulate(self.first, ours.STEP, self.force[0], self.position[0])

    def jacobian(self) -> None:
        slopes = (self.force_slopes[0], self.position_slopes[0])
        simulate_sensitive(self.first, ours.STEP, self.force[0], self.position[0], *slopes)

    def run_all(self) -> None:
        simulate_batch(self.runs, ours.STEP, self.force, self.position)

    def jacobian_all(self) -> None:
        slopes = (self.force_slopes, self.position_slopes)
        sensitive_batch(self.runs, ours.STEP, self.force, self.position, *slopes)


def check(point: np.ndarray, n_time: int = SAMPLES) -> None:
    """That our readings and slopes are those of the hand-written loop.

    Raises
    ------
    AssertionError
        With the channel and by how much it is off.
    """
    limit = Limit(point[None], n_time)
    limit.jacobian()
    mine = ours.programs(n_time)
    _same(mine["run"](point), {"force": limit.force[0], "position": limit.position[0]})
    slopes = {"force": limit.force_slopes[0], "position": limit.position_slopes[0]}
    _same(mine["jacobian"](point), slopes)


def _same(mine: Mapping, theirs: Mapping) -> None:
    for channel, expected in theirs.items():
        away = np.sqrt(np.mean((np.asarray(mine[channel]) - expected) ** 2, axis=0))
        size = np.sqrt(np.mean(expected**2, axis=0))
        if not np.all(away <= SAME * size):
            raise AssertionError(f"{channel}: off by {away}, its size is {size}")


def tables(watch: Stopwatch) -> list[Table]:
    """One for each case."""
    return [_table(watch, case, np.asarray(ours.start(base))) for case, base in CASES.items()]


def _table(watch: Stopwatch, case: str, point: np.ndarray) -> Table:
    check(point)
    lanes = np.tile(point, (LANES, 1)) * np.linspace(0.9, 1.1, LANES)[:, None]
    limit, mine = Limit(lanes, SAMPLES), ours.programs(SAMPLES)
    alone = Limit(point[None], SAMPLES)
    contenders = {
        "run": Contender(ours.done(mine["run"], point)),
        "run limit": Contender(alone.run),
        "jacobian": Contender(ours.done(mine["jacobian"], point)),
        "jacobian limit": Contender(alone.jacobian),
        "runs limit": Contender(limit.run_all, 7, LANES),
        "jacobians limit": Contender(limit.jacobian_all, 7, LANES),
    }
    for name in ("run, vmap", "run, in turn", "jacobian, vmap", "jacobian, in turn"):
        contenders[name] = Contender(ours.done(mine[name], lanes), 7, LANES)
    t = watch.interleaved(contenders)
    rows = [
        against("one run", t["run"], t["run limit"], "15"),
        against("a run of 64 (vmap)", t["run, vmap"], t["runs limit"], "4"),
        against("a run of 64 (lax.map)", t["run, in turn"], t["runs limit"], "4"),
        against("one Jacobian", t["jacobian"], t["jacobian limit"], "8"),
        against("a Jacobian of 64 (vmap)", t["jacobian, vmap"], t["jacobians limit"], "8, then 3"),
        against("a Jacobian of 64 (lax.map)", t["jacobian, in turn"], t["jacobians limit"], "8, then 3"),
    ]
    note = (
        f"Fibre-mass rig, base model, {SAMPLES} samples at 2 kHz, {case}; Jacobians for 5 parameters. Under vmap and "
        "`lax.map` records are simulated one after the other; `lax.map` also arranges the results record by record."
    )
    if "rest" in case:
        note += f" {AT_REST}"
    return Table(f"Simulation, {case}", note, ("", "ours", "hand-written (numba)", "ratio", "goal"), rows)
