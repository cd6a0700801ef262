"""Findings made by hand from measured records: what a search would have ended with, without any search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from fibrefit.core.declarations import HELD, LOADING, SLACK, UNLOADING, Statement
from fibrefit.discovery.engine.supermodel import supermodel_of
from fibrefit.discovery.model.finding import Finding, TracedRound
from fibrefit.fitting.result import Advice, Estimate, Identification, PlainEstimate, Starts, Why
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.law import Effect
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.task import Task
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.discovery import Candidate, FreeCurve, GapPlace, HeldOut, Round, Unexplained
from fibrefit.study.summaries.results import ChannelGap, ParameterSummary

RELEASE = 0.12
BASE = {"stiffness": 2.2e4, "damping": 20.0, "friction": 3.0, "position_zero": 1.5e-4, "release": RELEASE}
VISCOUS = CATALOGUE["guide.viscous_friction"]
GAP = "the gap is noise"
WHERE = (
    GapPlace(record="drop_20mm_45deg.csv", channel="position", phase="slack", from_s=0.19, to_s=0.62, share=0.31),
    GapPlace(record="drop_10mm_90deg.csv", channel="force", phase="taut, loading", from_s=0.35, to_s=0.41, share=0.22),
)


def identified(
    task: Task, effects: tuple[type[Effect], ...] = (), wrong: float = 0.0, fatal: bool = False
) -> Identification:
    """What a fit that is `wrong` times the noise beside the records would have ended with."""
    problem = supermodel_of(task, effects).problem
    layout, data = problem.layout, problem.observations
    channels = problem.model.rig.channels
    typical = {p.name: p.typical for p in problem.model.parameters}
    estimates = tuple(
        _estimate(slot.name, slot.unit, None if r is None else layout.records[r], (typical | BASE)[slot.name])
        for slot, r in layout.entries
    )
    count, times = np.asarray(data.experiment.count), np.asarray(data.experiment.times)
    inside = np.arange(times.shape[1]) < count[:, None]
    rng = np.random.default_rng(5)
    noise = {c: 1.0 / float(np.asarray(data.weight[c]).max()) for c in channels}
    wave = np.sin(40.0 * times)
    residuals = np.stack([inside * (rng.standard_normal(times.shape) + wrong * wave) for _ in channels], axis=1)
    measured = {c: np.asarray(data.measured[c]) for c in channels}
    readings = {c: measured[c] + noise[c] * residuals[:, i] for i, c in enumerate(channels)}
    speed = np.gradient(measured["position"], axis=1) / 5e-4
    stretch = measured["force"] / BASE["stiffness"]
    phase = np.where(measured["force"] > 5.0, np.where(speed > 0.0, LOADING, UNLOADING), SLACK)
    motion = Motion(
        np.where(times < RELEASE, HELD, phase),
        {
            "position": measured["position"],
            "speed": speed,
            "tension": measured["force"],
            "stretch": stretch,
            "stretch rate": np.gradient(stretch, axis=1) / 5e-4,
        },
        np.zeros(len(count), dtype=bool),
        readings,
    )
    ratio = float(np.hypot(1.0, wrong / np.sqrt(2.0)))
    gap = {c: ChannelGap.against_noise(noise[c], ratio * noise[c], task.units[c]) for c in channels}
    values = np.array([estimate.found.value for estimate in estimates])
    names = tuple(slot.name for slot, r in layout.entries if r is None)
    ends = np.tile(values[: len(names)], (4, 1))
    passed = ratio < 1.1 and not fatal
    return Identification(
        problem=problem,
        values=values,
        covariance=np.diag((0.01 * values) ** 2),
        method="newey_west",
        error_inflation=2.0,
        estimates=estimates,
        gap=gap,
        expected_gap=1.0,
        record_gaps=dict.fromkeys(layout.records, gap),
        noise=task.noise,
        readings=readings,
        residuals=residuals,
        motion=motion,
        starts=Starts(names, ends, ends, np.tile(values, (4, 1)), np.ones(4), np.ones(4, int), np.zeros(4, int)),
        checks=(
            Check(
                name=GAP,
                passed=passed,
                statistic=ratio,
                threshold=1.1,
                fatal=fatal,
                identifier="residual_size",
                quantity="residual size",
            ),
        ),
        advice=() if passed else (Advice("search"), Advice("rest")),
        seconds=1.0,
        estimator="ordinary least squares",
        why=Why("in_a_search"),
        plain=PlainEstimate(values, 0.01 * values, np.asarray(problem.layout.local(values)), False),
    )


def _estimate(name: str, unit: str, record: str | None, value: float) -> Estimate:
    error = 0.01 * abs(value)
    low, high = value - 2 * error, value + 2 * error
    told = ParameterSummary(value=value, std_error=error, interval_95=(low, high), unit=unit)
    return Estimate(name, record, told)


def differing(sd: float) -> Any:
    """A fit whose records differ by so much in their stiffness, and in nothing else."""
    unknowns = SimpleNamespace(names=("stiffness", "damping"), scattering=[0, 1])
    grid = np.array([[0.0, 0.0], [2.0 * sd, 0.0]])
    evidence = SimpleNamespace(weight=np.full(2, 0.5), grid=grid, mode=SimpleNamespace(unknowns=unknowns))
    return SimpleNamespace(evidence=evidence)


def candidate(effect: str, gap: float, error: float = 0.1) -> Candidate:
    """One that was tried; infinite errors where the records see nothing."""
    values = {
        f"{name}.{p.name}": ParameterSummary(value=p.typical, std_error=error, unit=p.unit)
        for name in effect.split(" + ")
        for p in CATALOGUE[name].parameters
    }
    return Candidate(effect=effect, gap_after=gap, evidence=1000.0 * (4.0 - gap), parameters=values)


def curve(says: str, gap: float, unit: str = "m", acts: bool = False) -> FreeCurve:
    """A detent, or a stop, that was found without a name."""
    knots = np.linspace(-0.02, 0.01, 40)
    heights = 2e3 * np.maximum(knots - 5e-3, 0.0) if acts else np.sin(900.0 * knots)
    seconds = np.where(knots > -0.015, 0.2, 0.0)
    errors = np.where(seconds > 0.0, 0.1, np.inf)
    end = (float(knots[32]), float(knots[-1])) if acts else None
    return FreeCurve(
        variable="position",
        says=says,
        unit=unit,
        knots=tuple(knots.tolist()),
        heights=tuple(heights.tolist()),
        std_errors=tuple(errors.tolist()),
        seconds=tuple(seconds.tolist()),
        acts=end,
        gap_after=gap,
        cost=3e3 * gap**2,
    )


CURVES = (
    curve("a friction in the guide that depends on the position of the weight", 1.01, acts=True),
    curve("a force on the weight that depends on its position", 1.31),
    curve("an error of the displacement gauge that depends on the position", 2.2).model_copy(
        update={"height_unit": "m"}
    ),
    curve("a friction in the guide that depends on the speed of the weight", 3.2, "m/s"),
)


def named(task: Task) -> Finding:
    """One effect was missing, and another could stand in for it."""
    ranking = (
        candidate(VISCOUS.name, 1.0),
        candidate("guide.quadratic_drag", 1.3),
        *(
            candidate(name, 3.4, np.inf)
            for name in ("fibre.hysteresis", "sensor.force_delay", "guide.stribeck_friction")
        ),
        *(candidate(f"fibre.hardening + {name}", 3.5) for name in ("guide.asymmetric_friction", "sensor.force_gain")),
    )
    lies = {"channel": "position", "phase": "slack", "share": 0.31, "ways": (), "band": None}
    grown = {
        "effects": VISCOUS.name,
        "gaps": (3.6, 1.0),
        "gain": 2000.0,
        "threshold": 4.0,
        "chance": 1e-9,
        "changes": (),
    }
    return Finding(
        verdict="named",
        reason=(Statement("noise_left", {"between_records": False}),),
        added=(VISCOUS,),
        steps=(
            TracedRound(
                Round(added=VISCOUS.name, gap_before=3.6, gap_after=1.0, where=WHERE, ranking=ranking),
                statements=(Statement("place", lies), Statement("added", grown)),
            ),
        ),
        cannot_tell_apart=((VISCOUS.name, "guide.quadratic_drag"),),
        unexplained=Unexplained(gap=1.0),
        before=identified(task, wrong=5.0),
        after=identified(task, (VISCOUS,)),
        held_out=(
            HeldOut(record="drop_10mm_90deg.csv", gap_before=6.8, gap_after=1.02),
            HeldOut(record="drop_20mm_45deg.csv", gap_before=7.0, gap_after=1.31),
        ),
        ranking=ranking,
        seconds=130.0,
    )


def unexplained(task: Task) -> Finding:
    """Nothing in the catalogue helped."""
    before = identified(task, wrong=5.0)
    looks = {
        "curve": "a friction in the guide that depends on the position of the weight", "variable": "position",
        "unit": "m", "height_unit": "N", "heights": (-0.5, 2.4), "range": (0.0, 0.01), "beyond": None, "below": None,
        "turns": 0, "share": 0.9,
    }  # fmt: skip
    return replace(
        named(task), verdict="unexplained", reason=(Statement("no_effect"),), added=(), steps=(), cannot_tell_apart=(),
        unexplained=Unexplained(gap=3.6, where=WHERE, curves=CURVES), looks_like=Statement("curve_left", looks),
        before=before, after=before, held_out=(),
    )  # fmt: skip


def nothing_missing(task: Task) -> Finding:
    """The first model was right."""
    before = identified(task)
    reason = (Statement("noise_left", {"between_records": False}),)
    left = Unexplained(gap=1.0)
    return replace(
        unexplained(task), verdict="nothing_missing", reason=reason, unexplained=left, looks_like=None,
        before=before, after=before,
    )  # fmt: skip


def not_trusted(task: Task) -> Finding:
    """The first fit failed, so that nothing was searched for."""
    before = identified(task, wrong=5.0, fatal=True)
    left = Unexplained(gap=3.6)
    return replace(
        unexplained(task),
        verdict="not_trusted",
        reason=(),
        unexplained=left,
        looks_like=None,
        broken=before.checks,
        ranking=(),
        before=before,
        after=before,
    )


FINDINGS = {"named": named, "unexplained": unexplained, "nothing_missing": nothing_missing, "not_trusted": not_trusted}


def with_estimates(finding: Finding, said: Mapping[str, tuple[float, float]]) -> Finding:
    """A finding whose effect has these values and standard errors, by the names of its parameters."""
    estimates = tuple(
        estimate._replace(
            found=estimate.found.model_copy(update=dict(zip(("value", "std_error"), values, strict=True)))
        )
        if (values := said.get(estimate.name.rpartition(".")[2])) is not None
        else estimate
        for estimate in finding.after.estimates
    )
    return replace(finding, after=replace(finding.after, estimates=estimates))
