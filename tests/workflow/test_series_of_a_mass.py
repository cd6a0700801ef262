"""A series of a mass on a guide: its friction has a speed, its mass has none, and both have units of their own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.declarations import Parameter
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.problem.estimate.evidence import MarginalLikelihood, laplace_evidence
from fibrefit.series.meta_analysis import BY_ORDER, Quantity, population
from fibrefit.series.speed_laws import BY_EFFECT
from fibrefit.series.speed_models import LawCurve, OwnValues, Verdict
from fibrefit.study.parameters import ParameterSetting
from fibrefit.workflow.together import files, words
from fibrefit.workflow.together.series import SeriesResult
from tests.problem import toys

NAMES = tuple("abcdef")
ORDER = Quantity(BY_ORDER, "-", np.arange(1.0, 7.0), np.zeros(6))
MOST = 18.0
"""Friction in N beyond which it is declared to be none: the mean of the records lies above."""
VALUES = np.column_stack([[60.0, 60.4, 59.7, 60.1, 60.3, 59.9], [18.0, 18.3, 17.9, 18.2, 18.1, 17.8]])


def told(silent: int | None = None) -> SeriesResult:
    """A series of six records; of the `silent` one nothing is known of its mass."""
    errors = np.full((6, 2), 0.1)
    if silent is not None:
        errors[silent, 0] = 0.0
    declared = {"mass": Parameter("mass", "kg", "", 1.0), "friction": Parameter("friction", "N", "", 1.0, upper=MOST)}
    model = SimpleNamespace(supermodel=SimpleNamespace(declared=declared))
    own = OwnValues(("mass", "friction"), VALUES, errors, np.zeros(2))
    pooled = {name: population(VALUES[:, j], errors[:, j]) for j, name in enumerate(own.names)}
    speeds = np.linspace(0.1, 0.2, 6)[:, None] * np.array([0.5, 1.0, 2.0])
    curve = LawCurve(BY_EFFECT["guide.friction_speed_exponent"], *np.ones((4, 3)))
    verdict = Verdict(
        answer="per_record",
        models=cast(Any, SimpleNamespace(constant=model, law=model)),
        left_out={},
        gaps={"per_record": 1.0, "constant": 2.0, "speed_law": 1.5},
        curves=(curve,),
        speeds={"friction": speeds},
        own=own,
        populations={name: one for name, one in pooled.items() if one is not None},
        alike=(),
    )
    found = SeriesResult(cast(Any, None), NAMES, verdict, 0, 0.0)
    found.__dict__["conditions"] = (ORDER,)
    return found


def test_a_parameter_without_a_speed_is_held_against_all_else() -> None:
    pairs = {(line.parameter, line.condition) for line in told().trends}
    assert pairs == {("mass", BY_ORDER), ("friction", BY_ORDER), ("friction", "speed")}


def test_units_are_those_that_the_model_declares() -> None:
    found = told()
    assert {one.name: one.unit for one in found.parameters} == {"mass": "kg", "friction": "N"}
    groups = files.series_groups(found.verdict, NAMES)
    assert [groups["records"][name].unit for name in ("mass", "mass_std_error", "friction")] == ["kg", "kg", "N"]
    assert groups["curve_friction"]["low"].unit == "N"
    records = files.record_summaries(found.verdict, NAMES, found.conditions)
    assert records["a"].parameters["mass"].unit == "kg"
    assert files.speed_curve_summary(found.verdict, found.verdict.curves[0]).unit == "N"
    found.verdict.models.own = SimpleNamespace(log=0.0)  # type: ignore[misc]
    for model in (found.verdict.models.constant, found.verdict.models.law):
        model.log = 0.0  # type: ignore[misc]
    assert "mass from 59.7 kg to 60.4 kg, friction from 17.8 N to 18.3 N" in words.answer_in_words(found.verdict)


def test_two_values_are_told_to_as_many_digits_as_tell_them_apart() -> None:
    assert words._from_to(14_712.0, 14_738.0, "N/m") == "from 14.71 kN/m to 14.74 kN/m"
    assert words._from_to(17.8, 18.3, "N") == "from 17.8 N to 18.3 N"
    assert words._from_to(2.0, 2.0, "N") == "from 2 N to 2 N"


def test_the_study_of_records_that_differ_begins_at_a_mass_in_kilograms() -> None:
    begins = begun()
    assert begins["mass"].initial.endswith(" kg")
    assert float(begins["mass"].initial.split()[0]) == pytest.approx(60.07, abs=0.01)


def test_a_value_beyond_its_range_begins_at_the_end_of_it() -> None:
    """A value at a bound may lie a rounding error beyond it, where a study must not begin."""
    assert begun()["friction"].initial == f"{MOST} N"


def begun() -> Any:
    """Parameters of the study that a series of records that differ leaves."""
    study = SimpleNamespace(
        parameters={},
        settings=lambda declared: {name: ParameterSetting(name, one.unit) for name, one in declared.items()},
        model_copy=lambda update: update["parameters"],
    )
    return files.winning_study(cast(Any, study), told().verdict)


def test_a_record_that_says_nothing_of_a_parameter_is_not_drawn_to_the_others() -> None:
    frame = told(silent=2)._tidy()
    rows = frame[frame["parameter"] == "mass"]
    assert np.isnan(rows["shrunk"].to_numpy()).tolist() == [name == "c" for name in NAMES]


def shared_of(scatter: float, lowest: float = 0.0) -> tuple[Any, MarginalLikelihood]:
    """Shared values of a model of eight records: their stiffness may differ, damping and a strength may not."""
    linear, of = toys.Linear.drawn(4, np.array([0.3, -0.2, 0.5]), scatter, 8, 3.0), toys.unknowns((0,), 8)
    evidence = laplace_evidence(of, toys.begun(of, records=8), linear.gram, tolerance=1e-9)
    declared = {name: Parameter(name, "-", "", 1.0) for name in toys.NAMES}
    slots = [SimpleNamespace(name=name, range=SimpleNamespace(lower=lowest, upper=np.inf)) for name in toys.NAMES]
    layout = SimpleNamespace(layout=SimpleNamespace(slots=slots))
    model = LaplaceFit((), cast(Any, SimpleNamespace(declared=declared, problem=layout)), evidence)
    return files.parameters_of(model), evidence


def test_an_interval_is_that_of_a_population_only_where_records_differ() -> None:
    alike, _ = shared_of(0.0)
    assert {one.interval_kind for one in alike.values()} == {"normal"}
    differing, evidence = shared_of(0.05)
    kinds = {name: one.interval_kind for name, one in differing.items()}
    assert kinds == {"stiffness": "population", "damping": "normal", "strength": "normal"}
    # As in a fit it is the mixture over all standard deviations between records, with tails wider than a normal one's.
    low, high = (evidence.mode.unknowns.value(np.array([z, 0.0, 0.0]))[0] for z in evidence.interval_95(0))
    assert differing["stiffness"].interval_95 == pytest.approx((low, high))


def test_an_interval_ends_where_the_range_of_a_value_does() -> None:
    ends = [shared_of(0.05, lowest)[0]["stiffness"].interval_95[0] for lowest in (0.0, 27.0)]
    assert ends[0] < 27.0 == ends[1]
