"""A channel of the wrong sign is told before a fit, with its records; a channel that is right never is."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Sequence
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import fibrefit
from fibrefit.core.errors import DataError
from fibrefit.problem.diagnose import channels
from fibrefit.problem.diagnose.channels import GRAVITY, Sense, refuse_turned, senses_of, turned_channels
from fibrefit.problem.formulation import stated_numbers, trace_of
from fibrefit.rigs.catalogue import rig_of
from fibrefit.rigs.rig import Rig
from fibrefit.rigs.signals.trace import Trace
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records, task_of
from tests.independent.laws import DRIVE, DROP
from tests.independent.series import Recording
from tests.validation.cases import interval_cases
from tests.validation.designs import NOISES

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
OF_RIG = {DROP: ("force", "position"), DRIVE: ("force", "position", "drive")}
STATED = {one.name: one.typical for one in rig_of("pulley_drive").conditions}
STATED |= {"weight_mass": 3.0, "inclination": 0.5}
SAID = re.compile(r"Check the sign of the (.*?):")


def simulated(record: Recording) -> Trace:
    logged, rig = record.logged, rig_of(record.conditions.kind)
    conditions = {one.name: getattr(record.conditions, one.name, one.typical) for one in rig.conditions}
    inputs = {} if logged.drive is None else {"drive": np.column_stack([logged.drive] * 3)}
    return Trace(record.name, logged.times, {"force": logged.force, "position": logged.position}, inputs, conditions)


def turned(trace: Trace, roles: Collection[str]) -> Trace:
    """The record as it is read where these channels have the wrong sign."""
    sign = {name: -1.0 if name in roles else 1.0 for name in ("force", "position", "drive")}
    channels = {name: sign[name] * values for name, values in trace.channels.items()}
    return trace._replace(
        channels=channels, inputs={name: sign[name] * values for name, values in trace.inputs.items()}
    )


def part(trace: Trace, begin: float, end: float, noise: int | None = None) -> Trace:
    """A part of a record, in shares of its length; with 1 N and 0.05 mm of further noise of a seed."""
    places = slice(*(round(share * len(trace.times)) for share in (begin, end)))
    channels = {name: values[places] for name, values in trace.channels.items()}
    if noise is not None:
        draws = np.random.default_rng(noise).normal(size=(2, len(channels["force"])))
        loud = {"force": draws[0], "position": 5e-5 * draws[1]}
        channels = {name: values + loud[name] for name, values in channels.items()}
    inputs = {name: values[places] for name, values in trace.inputs.items()}
    return trace._replace(times=trace.times[places], channels=channels, inputs=inputs)


def said(traces: Sequence[Trace], rig: Rig) -> str:
    """Channels that a refusal names; empty where there is none."""
    try:
        refuse_turned(traces, rig)
    except DataError as error:
        found = SAID.search(str(error))
        assert found is not None
        return found[1]
    return ""


@pytest.fixture(scope="module", params=(DROP, DRIVE))
def records(request: pytest.FixtureRequest) -> tuple[Rig, list[Trace]]:
    """Clean records of a rig, five under each noise."""
    cases = [next(islice(interval_cases("signs", request.param, noise, 0.01), 1)) for noise in NOISES]
    return rig_of(request.param), [simulated(record) for case in cases for record in case.make().series.records]


@cache
def shipped(name: str) -> tuple[Rig, list[Trace]]:
    study = load_study(CONFIGS / name)
    rig = rig_of(study.kind)
    read = zip(read_records(study), study.records, strict=True)
    return rig, [trace_of(record, rig, stated_numbers(stated)) for record, stated in read]


def test_what_was_turned_is_named_and_nothing_else(records: tuple[Rig, list[Trace]]) -> None:
    rig, traces = records
    assert len(traces) >= 30
    channels = OF_RIG[rig.kind]
    for trace in traces:
        for number in range(len(channels) + 1):
            for roles in itertools.combinations(channels, number):
                named = said([turned(trace, roles)], rig)
                assert set(re.findall(r"\w+", named)) - {"and", "the"} == set(roles), (trace.name, roles)


@pytest.mark.parametrize("name", ["drop_series", "drive_series", "second_fibre", "lubricated_guide"])
def test_loud_late_and_cut_records_that_are_right_are_not_refused(name: str) -> None:
    """The negative control: any part of a record, half of them louder by 1 N and 0.05 mm."""
    rig, traces = shipped(name)
    random = np.random.default_rng(1)
    for trace in traces:
        for number in range(12):
            begin = random.uniform(0.0, 0.9)
            some = part(trace, begin, random.uniform(begin + 0.1, 1.0), number if number % 2 else None)
            assert not said([some], rig), (trace.name, number)


@pytest.mark.parametrize("name", ["drop_series", "drive_series", "second_fibre"])
@pytest.mark.parametrize(("begin", "end"), [(0.0, 1.0), (0.0, 0.6), (0.1, 1.0)], ids=["whole", "cut", "late"])
def test_a_wrong_sign_is_told_of_loud_late_and_cut_records(name: str, begin: float, end: float) -> None:
    rig, traces = shipped(name)
    for trace, role in itertools.product(traces, OF_RIG[rig.kind]):
        assert said([turned(part(trace, begin, end, noise=3), (role,))], rig) == role, trace.name


@pytest.mark.parametrize("share", [-1.3, -1.0, 0.5])
def test_an_offset_of_the_force_is_no_wrong_sign(records: tuple[Rig, list[Trace]], share: float) -> None:
    """A gauge that was set to nil under the weight, or reads less than nothing all the while it hangs there."""
    rig, traces = records
    named = []
    for trace in traces:
        assert rig.pulled is not None
        pull = rig.pulled(trace.conditions, trace.channels["position"])
        offset = share * pull.mass * abs(pull.gravity)
        off = trace._replace(channels={**trace.channels, "force": trace.channels["force"] + offset})
        assert not said([off], rig)
        named.append(said([turned(off, ("force",))], rig))
    # A slow drive hardly accelerates its weight: without the weight in the force, it shows too little.
    assert set(named) <= {"force", "force, or of the position", "force, or of the position and the drive", ""}
    assert sum(map(bool, named)) >= 0.7 * len(named)


def test_on_a_nearly_level_guide_gravity_tells_no_sign(records: tuple[Rig, list[Trace]]) -> None:
    """A gauge 2 N low would turn a pull of one newton round."""
    rig, (trace, *_) = records
    level = trace._replace(conditions={**trace.conditions, "inclination": np.radians(2.0)})
    assert GRAVITY not in senses_of(level, rig)
    assert GRAVITY in senses_of(trace, rig)


def test_a_drive_that_no_instant_shows_beside_its_weight_tells_no_sign() -> None:
    times = np.linspace(0.0, 2.0, 200)
    early, late = (np.where(there, np.sin(times), np.nan) for there in (times < 1.0, times > 1.0))
    trace = Trace("apart", times, {"force": early, "position": late}, {"drive": np.stack([times] * 3, axis=1)}, STATED)
    assert senses_of(trace, rig_of("pulley_drive"))["drive"].sign == 0


def test_without_gravity_both_ways_are_told() -> None:
    sure, unsure = Sense(-1.0, 0.01), Sense(0.1, 0.1)
    assert turned_channels({"gravity": unsure, "force": sure}) == (("force",), ("position",))
    assert turned_channels({"drive": sure}) == (("drive",), ("position",))
    assert turned_channels({"gravity": unsure, "force": Sense(1.0, 0.01), "drive": sure}) == (
        ("drive",),
        ("position", "force"),
    )
    assert turned_channels({"gravity": Sense(1.0, 0.01), "force": sure}) == (("force",),)


@pytest.mark.parametrize(("places", "where"), [
    ((0, 1, 2, 3, 4), "all 5 records"), ((2,), "trapezoid_450mms_60mm.csv"),
    ((0, 3), "trapezoid_60mms_60mm.csv and quasi_sine_250mms_50mm_added.csv"),
    ((0, 1, 2, 3), "trapezoid_60mms_60mm.csv, trapezoid_200mms_80mm_added.csv, trapezoid_450mms_60mm.csv and 1 more"),
])  # fmt: skip
def test_the_records_are_named(places: tuple[int, ...], where: str) -> None:
    rig, traces = shipped("drive_series")
    mixed = [turned(trace, ("drive",)) if i in places else trace for i, trace in enumerate(traces)]
    with pytest.raises(DataError) as told:
        refuse_turned(mixed, rig)
    assert told.value.where == where
    assert "the weight moves against the drive (-" in told.value.got
    assert ("under [channels]: drive" in told.value.do) == (len(places) == 5)


@pytest.mark.parametrize("everywhere", [True, False], ids=["all records", "one record"])
@pytest.mark.parametrize("role", OF_RIG[DRIVE])
def test_what_is_advised_makes_the_record_right(tmp_path: Path, role: str, everywhere: bool) -> None:
    """Whatever effects the model has, as none of them turns a channel round."""
    source = CONFIGS / "drive_series"
    heading = {"force": "force [N]", "position": "position [mm]", "drive": "drive [mm]"}[role]
    text = (source / "study.toml").read_text("utf-8").replace(
        "[channels]", '[model]\neffects = ["sensor.force_gain"]\n\n[channels]'
    )  # fmt: skip
    for number, file in enumerate(sorted(source.glob("*.csv"))):
        lines = file.read_text("utf-8").splitlines()
        column = lines[0].split(",").index(heading)
        if everywhere or number == 2:
            rows = [line.split(",") for line in lines[1:]]
            flipped = [[f"{-float(cell):.3f}" if i == column else cell for i, cell in enumerate(row)] for row in rows]
            lines[1:], odd = map(",".join, flipped), file.name
        (tmp_path / file.name).write_text("\n".join(lines) + "\n", "utf-8")
    (tmp_path / "study.toml").write_text(text, "utf-8")
    with pytest.raises(DataError, match=f"Check the sign of the {role}:") as told:
        task_of(load_study(tmp_path))
    assert told.value.where == ("all 5 records" if everywhere else odd)
    assert sum(one.verdict == "not ready" for one in fibrefit.inspect(tmp_path).seen) == (5 if everywhere else 1)
    advice = re.search(r": ((?:channels = )?.*\}) \(", told.value.do.rpartition("state it")[2])
    assert advice is not None
    stated = advice[1].replace('"..."', f'"{heading}"')
    old, new = (f'{role} = "{heading}"', stated) if everywhere else (f'file = "{odd}"', f'file = "{odd}"\n{stated}')
    (tmp_path / "study.toml").write_text(text.replace(old, new), "utf-8")
    right = zip(task_of(load_study(tmp_path)).traces, shipped("drive_series")[1], strict=True)
    for one, other in right:
        np.testing.assert_allclose(one.channels["force"], other.channels["force"], atol=1e-9)
        np.testing.assert_allclose(one.inputs["drive"], other.inputs["drive"], atol=1e-9)


def test_a_rig_that_does_not_say_what_pulls_is_not_examined() -> None:
    _, traces = shipped("drop_series")
    refuse_turned([turned(trace, ("force",)) for trace in traces], rig_of("guided_mass"))
    assert not senses_of(traces[0]._replace(channels={"force": traces[0].channels["force"]}), rig_of(DROP))
    assert channels.against_which({}) == ()
