"""A whole fit of five records, beside those of other tools."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from fibrefit.problem.task import Task
from tests.benchmarks import ours, rival_diffrax, rivals
from tests.benchmarks.problem import Fit, drop_task, fit_of, in_our_order
from tests.benchmarks.table import Table
from tests.benchmarks.timing import Contender, Stopwatch, Times, spoken

SAME_COST = 9.0
"""Excess over our cost, in units of the noise: an answer closer than this lies within the smallest of error bars."""


def excess(task: Task, values: np.ndarray, ours_: np.ndarray) -> float:
    """Cost of an answer above that of ours."""
    there, here = (float(np.sum(np.asarray(task.problem.residuals(v)) ** 2)) for v in (values, ours_))
    return there - here


def table(watch: Stopwatch, slow: bool = True) -> Table:
    """All contenders, each with how far its answer is from ours; `slow` ones too."""
    task = drop_task()
    fit = fit_of(task)
    answer = ours.fit(task)
    contenders = {
        "ours, warm": Contender(lambda: ours.fit(task), 9),
        "SciPy": Contender(lambda: rivals.fit_scipy(fit), 3),
    }
    answers = {"SciPy": rivals.fit_scipy(fit)}
    contenders["SciPy, sparse"] = Contender(lambda: rivals.fit_scipy(fit, sparse=True), 3)
    answers["SciPy, sparse"] = rivals.fit_scipy(fit, sparse=True)
    if slow:
        contenders["lmfit"] = Contender(lambda: rivals.fit_lmfit(fit), 3)
        answers["lmfit"] = rivals.fit_lmfit(fit)
        with_diffrax = rival_diffrax.fitter(fit)
        answers["diffrax"] = with_diffrax()
        contenders["diffrax"] = Contender(with_diffrax, 1)
    away = {name: excess(task, in_our_order(task, values), answer) for name, values in answers.items()}
    if abs(away["SciPy"]) > SAME_COST:
        raise AssertionError(f"SciPy ends elsewhere: its cost is {away['SciPy']:.3g} above ours")
    times = watch.interleaved(contenders, warm=False)
    rows = _rows(times, away)
    rows += _public(watch, times["SciPy"])
    return Table(
        "A fit of five records", _note(fit), ("", "time", "ours is faster by", "goal", "cost above ours"), rows
    )


def _note(fit: Fit) -> str:
    samples = sum(record.times.size for record in fit.records)
    return (
        f"The drop series that ships with the project: {len(fit.records)} records, {samples} samples of force and "
        f"of position, {fit.start.size} parameters (three shared, zero and release of each record), all from the start "
        "the data suggest. The last column tells whether it is the same answer: the sum of squared residuals over "
        f"their noise, above that of ours; below {SAME_COST:g} the answers differ by less than their errors."
    )


def _rows(times: dict[str, Times], away: dict[str, float]) -> list[tuple[str, ...]]:
    what = {
        "ours, warm": ("ours: descent over growing horizons", ""),
        "SciPy": ("(a) solve_ivp (LSODA, events), least_squares, finite differences", "25, then 60"),
        "SciPy, sparse": ("(a) told which parameters touch which record", ""),
        "lmfit": ("(b) lmfit on odeint, friction regularised", ""),
        "diffrax": ("(c) diffrax (Kvaerno3), forward mode, friction regularised", ""),
    }
    rows = []
    for name, taken in times.items():
        label, goal = what[name]
        faster = f"{taken.median / times['ours, warm'].median:.0f}" if name in away else ""
        rows.append((label, spoken(taken.median), faster, goal, f"{away[name]:.2g}" if name in away else "0"))
    return rows


def _public(watch: Stopwatch, scipy: Times) -> list[tuple[str, ...]]:
    """From a prompt; and all that a person asks for: 32 starts, error bars, checks, files."""
    whole = ours.whole_fit(32)
    whole()
    with_import = [sys.executable, "-c", "import scipy.integrate, scipy.optimize"]
    prompt_of_scipy = scipy.median + watch.once(lambda: subprocess.run(with_import, check=True))
    with tempfile.TemporaryDirectory() as folder:
        alone, prompt = ours.alone(Path(folder)), ours.command_line(Path(folder))
        first = ("ours, from a prompt, nothing compiled yet", watch.once(alone), prompt_of_scipy)
        again = min(watch.once(alone) for _ in range(3))
        rows = [first, ("ours, from a prompt again", again, prompt_of_scipy)]
        rows.append(("`fibrefit.fit`, 32 starts, errors and checks, warm", watch.once(whole), scipy.median))
        fresh = ours.command_line(Path(folder) / "fresh")
        rows.append(("`fibrefit fit` from a prompt, nothing compiled yet", watch.once(fresh), prompt_of_scipy))
        prompt()
        rows.append(("`fibrefit fit` from a prompt again", watch.once(prompt), prompt_of_scipy))
    return [("(a) from a prompt, SciPy imported", spoken(prompt_of_scipy), "", "", "")] + [
        (label, spoken(time), f"{theirs / time:.2g}", "1" if "ours" in label else "", "")
        for label, time, theirs in rows
    ]
