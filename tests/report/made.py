"""Results to be looked at in a browser: a search that added two effects to a model of two records, and a batch."""

from __future__ import annotations

import numpy as np

from fibrefit.report.page import Illustration, Result
from fibrefit.study.summaries import discovery as d
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries import series
from fibrefit.study.summaries.part import Variable
from tests.study.test_summaries import CANDIDATE, CHECK, FIT, GAP, PROVENANCE

COUNT, RATE = 6000, 2000.0
RECORDS = ("drop_5mm.csv", "drop_20mm.csv")
NOISE = {"force": 0.41, "position": 2e-5}
TIMES = np.arange(COUNT) / RATE
GRID = ("record", "sample")
PLACE = d.GapPlace(record=RECORDS[1], channel="force", from_s=1.0, to_s=1.1, phase="taut, loading", share=0.4)

LESSER = CANDIDATE.model_copy(update={"effect": "fibre.hardening", "evidence": 40.0, "gap_after": 2.5})
NO_GAIN = CANDIDATE.model_copy(update={"effect": "drive.play", "evidence": -3.0, "gap_after": 3.1})
"""It is counted, and cannot be switched on."""


def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, speed and phase of both records."""
    position = np.stack([size * np.exp(-TIMES) * np.cos(20.0 * TIMES) for size in (5e-3, 2e-2)])
    speed = np.gradient(position, 1.0 / RATE, axis=1)
    phase = np.where(position > 0.0, np.where(speed > 0.0, 2, 3), 1)
    phase[:, :200], phase[:, -1000:] = 0, 4
    return position, speed, phase


def search() -> Result:
    """A search of two rounds with all that its page draws."""
    rng = np.random.default_rng(3)
    position, speed, phase = motion()
    tension = 1e4 * np.maximum(position, 0.0)
    clean = {"force": tension, "position": position}
    observed = {name: values + NOISE[name] * rng.normal(size=values.shape) for name, values in clean.items()}
    observed["force"][0, 3000:3010] = np.nan
    wrong = {name: values + 3.0 * NOISE[name] * np.sin(5.0 * TIMES) for name, values in clean.items()}
    name = {"record": Variable(np.array(RECORDS, dtype=object), ("record",))}
    time = {"time": Variable(np.stack([TIMES, TIMES]), GRID, "s")}
    units = {"force": "N", "position": "m"}

    def group(values: dict[str, np.ndarray]) -> dict[str, Variable]:
        return {**name, **time, **{key: Variable(one, GRID, units[key]) for key, one in values.items()}}

    def left(values: dict[str, np.ndarray], share: float) -> np.ndarray:
        parts = [(clean[c] + share * (values[c] - clean[c]) - observed[c]) / NOISE[c] for c in units]
        return np.nan_to_num(np.stack(parts, axis=1))

    taut = position > 0.0
    states = {
        "position": (position, "m"), "speed": (speed, "m/s"), "tension": (tension, "N"),
        "stretch": (np.where(taut, position, 0.0), "m"), "stretch_rate": (np.where(taut, speed, 0.0), "m/s"),
    }  # fmt: skip
    rounds = {
        **name,
        "channel": Variable(np.array(list(units), dtype=object), ("channel",)),
        "noise": Variable(
            np.stack([np.full(TIMES.shape, NOISE[c]) for c in units])[None].repeat(2, axis=0),
            ("record", "channel", "sample"),
        ),
        "round": Variable(np.array([1, 2]), ("round",)),
        "left": Variable(np.stack([left(wrong, 1.0), left(wrong, 0.4)]), ("round", "record", "channel", "sample")),
        "tried_in": Variable(np.array([1, 1]), ("tried",)),
        "effect": Variable(np.array([LESSER.effect, NO_GAIN.effect], dtype=object), ("tried",)),
        "left_with": Variable(np.stack([left(wrong, 0.8), left(wrong, 1.0)]), ("tried", "record", "channel", "sample")),
    }
    groups = {
        "observed_data": group(observed),
        "predictions": group(clean),
        "predictions_before": group(wrong),
        "motion": {
            **name,
            "phase": Variable(phase, GRID),
            **{key: Variable(one, GRID, unit) for key, (one, unit) in states.items()},
        },
        "constant_data": {
            **name,
            "samples": Variable(np.array([COUNT, COUNT]), ("record",)),
            "lift": Variable(np.array([0.005, 0.02]), ("record",), "m"),
        },
        "rounds": rounds,
    }
    return Result("results/search", _search(), [Illustration("overview", "What is seen.", _png())], groups)


def _search() -> d.DiscoverySummary:
    gap = s.Gap.model_validate(
        {name: {"rms": size, "unit": "N", "noise": size, "ratio": 1.0} for name, size in NOISE.items()} | {"total": 1.0}
    )
    rounds = tuple(
        d.Round(
            added=added,
            gap_before=before,
            gap_after=after,
            where=(PLACE,),
            ranking=(CANDIDATE, LESSER, NO_GAIN),
            sentence=f"With {added} the gap falls.",
        )
        for added, before, after in (("guide.viscous_friction", 3.1, 1.6), ("pulley.inertia", 1.6, 1.0))
    )
    shared = {name: getattr(FIT, name) for name in s.FitResultSummary.model_fields}
    return d.DiscoverySummary(
        **shared | {"records": {name: s.RecordSummary(gap=gap) for name in RECORDS}, "gap": gap},
        verdict="named",
        reason="What is left is noise.",
        added=tuple(str(one.added) for one in rounds),
        rounds=rounds,
        unexplained=d.Unexplained(gap=1.0),
        before=d.Before(status="suspect", parameters=FIT.parameters, gap=GAP, records=dict.fromkeys(RECORDS, GAP)),
    )


def batch(number: int = 200) -> Result:
    """Identifications: every tenth is suspect, four are not explained, the last could not be carried out."""
    rng = np.random.default_rng(4)
    items = {}
    for i in range(1, number):
        stiffness = s.ParameterSummary(
            value=1e4 + 50.0 * rng.normal(), std_error=40.0, interval_95=(9e3, 1.1e4), unit="N/m"
        )
        status = "suspect" if i % 10 == 0 else "ok"
        gap = 1.5 if i % 10 == 0 else float(rng.uniform(0.9, 1.1))
        items[f"run_{i}"] = series.BatchItem(
            status=status, parameters={"stiffness": stiffness}, gap=gap, result=f"items/run_{i}",
            lacks=("residual size",) if i % 50 == 1 else (), conditions={"lift [m]": 0.005 * (1 + (i - 1) % 4)},
        )  # fmt: skip
    last = {"lift [m]": 0.005 * (1 + (number - 1) % 4)}
    items[f"run_{number}"] = series.BatchItem(error="run.csv: no column for the force.", conditions=last)
    summary = series.BatchSummary(status="suspect", name="many", items=items, checks=(CHECK,), provenance=PROVENANCE)
    return Result("results/many", summary, link="many")


def _png() -> bytes:
    from tests.report.test_page import PNG

    return PNG
