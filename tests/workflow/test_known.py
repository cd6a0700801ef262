"""What a prediction takes from a result: a value of every parameter, and none that belongs to single records."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.fitting.error_bars import _held
from fibrefit.study import Study, load_study
from fibrefit.study.summaries.part import Variable
from fibrefit.study.summaries.results import (
    BetweenRecordsSummary,
    ChannelGap,
    Gap,
    ParameterSummary,
    PosteriorParameter,
    PosteriorSummary,
)
from fibrefit.workflow.prediction.known import Known, known_of
from fibrefit.workflow.prediction.predict import _with_values, predict_study
from tests.fitting import made
from tests.laboratories import made as laboratory
from tests.study.test_summaries import FIT

DECAY = """[rig]
kind = "guided_mass"
driven_by = "{driven_by}"
[channels]
position = "X [m]"
[model]
effects = ["guide.spring", "guide.viscous_friction"]
[[records]]
file = "decay.csv"
"""
OF_CART = {
    "mass": "mass",
    "friction": "friction",
    "guide.spring.spring_stiffness": "stiffness",
    "guide.spring.spring_zero": "zero",
    "guide.viscous_friction.viscous_coefficient": "viscous",
}


NOISE = made.NOISE
UNITS = {"stiffness": "N/m", "damping": "N s/m", "force": "N", "position": "m"}


def of_posterior(value: float, unit: str) -> PosteriorParameter:
    return PosteriorParameter(mean=value, sd=0.01 * value, median=value, interval=(value, value), unit=unit)


def posterior(**records: dict[str, PosteriorParameter]) -> PosteriorSummary:
    """Of a series in which the stiffness is shared."""
    return PosteriorSummary(
        status="ok",
        study="made",
        parameters={"stiffness": of_posterior(2e4, "N/m"), "noise.force": of_posterior(0.4, "N")},
        records={f"{name}.csv": found for name, found in records.items()},
        interval_kind="equal_tailed",
        interval_probability=0.95,
        likelihood="white",
        ensembles=4,
        walkers=8,
        draws=8,
        checks=(),
    )


DRAWS = {"posterior": {"stiffness": Variable(np.array([[1.9e4, 2.1e4], [2.0e4, 2.0e4]]), ("chain", "draw"), "N/m")}}
EACH = posterior(
    drop_5mm={"damping": of_posterior(24.0, "N s/m"), "release": of_posterior(0.12, "s")},
    drop_10mm={"damping": of_posterior(26.0, "N s/m"), "release": of_posterior(0.13, "s")},
)


def holding(folder: Path) -> Study:
    """The friction is held, and each record has a damping of its own."""
    return made.study(folder, more='[parameters.friction]\nfixed = "4 N"\n[parameters.damping]\nshared = false')


def test_a_posterior_has_what_was_held_and_the_mean_of_what_each_record_has(tmp_path: Path) -> None:
    study = holding(tmp_path)
    known = known_of(EACH, DRAWS, study, "posterior")
    assert {name: (one.value, one.free) for name, one in known.parameters.items()} == {
        "stiffness": (2e4, True),
        "damping": (25.0, True),
        "friction": (4.0, False),
    }
    assert known.names == ("stiffness", "damping")
    # A third record differs from the mean of two by Student's law with one degree of freedom.
    np.testing.assert_allclose(
        np.diag(known.covariance), [2e6 / 3.0, 2.0 * 1.5 * (t.ppf(0.975, 1) / 1.959964) ** 2], rtol=1e-6
    )
    assert known.differences["damping"].freedom == 1.0
    assert "stiffness" not in known.differences
    tables = _with_values(study, known).parameters
    assert {name: (table.initial, table.fixed) for name, table in tables.items()} == {
        "stiffness": ("20000.0 N/m", False),
        "damping": ("25.0 N s/m", False),
        "friction": ("4.0 N", True),
    }


@pytest.mark.parametrize(
    ("told", "relative"), [({"sd": 0.0, "rms": 0.03}, 0.03), ({"sd": 0.01, "rms": 0.02}, 0.02), ({"sd": 0.01}, 0.01)]
)
def test_a_new_record_differs_as_its_records_leave_open(
    tmp_path: Path, told: dict[str, float], relative: float
) -> None:
    """Also where the median says that they agree; of a result of before there is nothing but that."""
    between = BetweenRecordsSummary(interval_95=(0.0, 0.072), agree=0.55, **told)
    differing = EACH.model_copy(update={"between_records": {"stiffness": between}})
    known = known_of(differing, DRAWS, holding(tmp_path), "posterior")
    variance = (relative * 2e4) ** 2
    assert known.covariance[0, 0] == pytest.approx(2e6 / 3.0 + variance)
    assert known.differences["stiffness"].variance == pytest.approx(variance)
    assert np.isinf(known.differences["stiffness"].freedom)


def test_the_values_of_a_single_record_are_as_uncertain_as_it_says(tmp_path: Path) -> None:
    """It shares nothing with others: all that is known is how well its own values are."""
    own = {"stiffness": of_posterior(2e4, "N/m"), "damping": of_posterior(24.0, "N s/m")}
    alone = posterior(drop_5mm=own)
    alone = alone.model_copy(update={"parameters": {"noise.force": alone.parameters["noise.force"]}})
    more = "".join(f"[parameters.{name}]\nshared = false\n" for name in own)
    study = made.study(tmp_path, made.LIFTS[:1], more=f'{more}[parameters.friction]\nfixed = "4 N"')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        known = known_of(alone, DRAWS, study, "posterior")
    assert known.names == tuple(own)
    np.testing.assert_allclose(np.diag(known.covariance), [200.0**2, 0.24**2])


def constant_found(folder: Path) -> Study:
    """The weight is known within an uncertainty."""
    return load_study(made.study(folder, made.LIFTS[:1]).source, ['rig.weight_mass="3.1 +/- 0.05 kg"'])


def constant_known(study: Study, found: dict[str, float]) -> Iterator[Known]:
    """What is known of values that were found by a fit, and by a posterior."""
    units = {"stiffness": "N/m", "damping": "N s/m", "friction": "N", "weight_mass": "kg"}
    fitted = FIT.model_copy(
        update={
            "parameters": {n: ParameterSummary(value=v, std_error=1e-3 * v, unit=units[n]) for n, v in found.items()}
            | {"lift": ParameterSummary(value=5e-3, unit="m"), "release": ParameterSummary(value=0.12, unit="s")}
        }
    )
    covariance = np.diag([(1e-3 * value) ** 2 for value in found.values()])
    estimate = {
        "parameter": Variable(np.array(list(found), dtype=object), ("parameter",)),
        "covariance": Variable(covariance, ("parameter", "parameter_2")),
    }
    yield known_of(fitted, {"estimate": estimate}, study, "the fit")
    shared = {name: of_posterior(value, units[name]) for name, value in found.items()}
    drawn = EACH.model_copy(update={"parameters": shared, "records": {}})
    draws = {name: Variable(value * np.array([[0.99, 1.01]]), ("chain", "draw")) for name, value in found.items()}
    yield known_of(drawn, {"posterior": draws}, study, "the posterior")


FOUND = {**made.TRUTH, "weight_mass": made.MASS}


def test_a_constant_of_the_rig_that_was_found_is_known(tmp_path: Path) -> None:
    """Of a fit as of a posterior; each record has a lift and a release of its own, which are not."""
    study = constant_found(tmp_path)
    for one in constant_known(study, FOUND):
        assert {name: told.value for name, told in one.parameters.items()} == FOUND
        assert one.names == tuple(FOUND)
        assert _with_values(study, one).parameters["weight_mass"].initial == f"{made.MASS} kg"


@pytest.mark.slow
def test_a_constant_of_the_rig_that_was_found_is_predicted_with(tmp_path: Path) -> None:
    study = constant_found(tmp_path)
    made.write(tmp_path, made.records(made.LIFTS[:1]))
    predicted = predict_study(next(constant_known(study, FOUND)), study)
    assert predicted.summary().parameters["weight_mass"].value == made.MASS
    assert predicted.parts["values"].max() > 0.0


def test_a_posterior_says_what_its_model_left(tmp_path: Path) -> None:
    """One of before does not."""
    gap = Gap(**{c: ChannelGap.against_noise(n, 1.5 * n, UNITS[c]) for c, n in NOISE.items()})
    study = holding(tmp_path)
    assert known_of(EACH, DRAWS, study, "posterior").gaps == {}
    gaps = known_of(EACH.model_copy(update={"gap": gap}), DRAWS, study, "posterior").gaps
    assert {channel: one.rms for channel, one in gaps.items()} == {c: pytest.approx(1.5 * n) for c, n in NOISE.items()}


@pytest.mark.slow
@pytest.mark.parametrize(("told", "verdict"), [(True, "holds"), (False, "does_not_hold")])
def test_what_a_model_lacked_in_a_posterior_may_be_missing_in_new_records(
    tmp_path: Path, told: bool, verdict: str
) -> None:
    """As of a fit: in motion both leave 1.5 times the noise at rest. A posterior of before does not say so."""
    study = made.study(tmp_path, made.LIFTS[:1], more='[parameters.friction]\nfixed = "4 N"')
    (quiet,) = made.records(made.LIFTS[:1])
    random, moving = np.random.default_rng(3), (quiet.time > 0.14) & (quiet.time < 0.34)
    louder = np.sqrt((1.5**2 - 1.0) / np.mean(moving))
    more = {name: noise * louder * random.standard_normal(len(moving)) for name, noise in NOISE.items()}
    channels = {name: reading + np.where(moving, more[name], 0.0) for name, reading in quiet.channels.items()}
    made.write(tmp_path, [made.replace(quiet, **channels)])
    values = {name: made.TRUTH[name] for name in ("stiffness", "damping")}
    found = posterior().model_copy(
        update={
            "parameters": {name: of_posterior(value, UNITS[name]) for name, value in values.items()},
            "gap": Gap(**{c: ChannelGap.against_noise(n, 1.5 * n, UNITS[c]) for c, n in NOISE.items()})
            if told
            else Gap(),
        }
    )
    draws = {name: Variable(value * np.array([[0.9999, 1.0001]]), ("chain", "draw")) for name, value in values.items()}
    summary = predict_study(known_of(found, {"posterior": draws}, study, "the posterior"), study).summary()
    assert summary.verdict == verdict
    for channel, noise in NOISE.items():
        assert summary.channels[channel].fit_rms == (pytest.approx(1.5 * noise) if told else None)


def test_a_result_that_lacks_a_value_or_failed_is_refused(tmp_path: Path) -> None:
    study = holding(tmp_path)
    with pytest.raises(UsageError, match="no value of damping; expected one of every"):
        known_of(posterior(), DRAWS, study, "posterior")
    more = EACH.model_copy(update={"parameters": {**EACH.parameters, "depth": of_posterior(1.0, "m")}})
    draws = {"posterior": {**DRAWS["posterior"], "depth": DRAWS["posterior"]["stiffness"]}}
    with pytest.raises(UsageError, match="a value of what the model does not have: depth; expected"):
        known_of(more, draws, study, "posterior")
    for summary in (EACH, FIT):
        failed = summary.model_copy(update={"status": "failed"})
        with pytest.raises(UsageError, match="a result that failed its checks"):
            known_of(failed, DRAWS, study, "one")


def test_what_the_only_record_states_for_itself_is_its_own(tmp_path: Path) -> None:
    first = made.records()[:1]
    stated = made.task(
        tmp_path, first, lifts=(5e-3,), own=('release = "0.1234 s"',), more='[parameters.friction]\nfixed = "4 N"'
    )
    assert {(one.name, one.record) for one in _held(stated.problem)} == {
        ("friction", None),
        ("release", "drop_5mm.csv"),
    }
    # Results that were written otherwise are read all the same.
    told = FIT.model_copy(
        update={
            "parameters": {
                name: ParameterSummary(value=value, unit=unit)
                for name, value, unit in (
                    ("stiffness", 2e4, "N/m"), ("damping", 25.0, "N s/m"), ("friction", 4.0, "N"),
                    ("release", 0.1234, "s"),
                )
            }
        }
    )  # fmt: skip
    estimate = {
        "parameter": Variable(np.array(["stiffness"], dtype=object), ("parameter",)),
        "covariance": Variable(np.array([[1.0]]), ("parameter", "parameter_2")),
    }
    known = known_of(told, {"estimate": estimate}, made.study(tmp_path / "other"), "one")
    assert set(known.parameters) == {"stiffness", "damping", "friction"}


def nothing_known(study: Study, **parameters: ParameterSummary) -> Known:
    return Known("the fit", study, parameters, (), np.zeros((0, 0)), {}, frozenset())


@pytest.mark.parametrize(
    "effect", ["guide.friction_change@2", "fibre.knot_slip@1", "fibre.knot_slip@1-2", "guide.friction_trend"]
)
def test_effects_that_go_by_the_place_of_a_record_are_refused(tmp_path: Path, effect: str) -> None:
    study = made.study(tmp_path, more=f'[model]\neffects = ["{effect}"]')
    said = f'the effect "{effect}", which goes by the place of a record in its series'
    with pytest.raises(StudyError, match=said) as refused:
        predict_study(nothing_known(study), study)
    assert refused.value.do == "Fit without it; or, for an effect of single records, fit the others."


def test_another_variant_of_a_rig_is_refused(tmp_path: Path) -> None:
    (tmp_path / "decay.csv").touch()
    free, driven = (load_study(laboratory.study(tmp_path, DECAY.format(driven_by=by))) for by in ("nothing", "force"))
    with pytest.raises(
        StudyError, match='a guided_mass; expected a guided_mass with driven_by = "nothing", as the fit'
    ) as refused:
        predict_study(nothing_known(free), driven)
    assert "a rig that is measured and driven alike, or fit such a study" in refused.value.do
    usual = made.study(tmp_path)
    with pytest.raises(StudyError, match="Predict records of the same kind of rig"):
        predict_study(nothing_known(usual), driven)
    force = load_study(usual.source, ['rig.measured="force"'])
    with pytest.raises(StudyError, match='a fibre_mass with measured = "force"; expected a fibre_mass, as the fit'):
        predict_study(nothing_known(usual), force)


@pytest.mark.slow
def test_a_free_decay_is_predicted_by_values_that_were_found(tmp_path: Path) -> None:
    """Of a mass that the result had to find, or was told: the records that are predicted need not tell it."""
    rows = laboratory.cart(2.0, 200.0, lambda t: 0.0, (0.06, 0.0))
    laboratory.write(tmp_path / "decay.csv", "time [s],X [m]", rows[:, [0, 2]], "%.5f")
    study = load_study(laboratory.study(tmp_path, DECAY.format(driven_by="nothing")))
    units = {"mass": "kg", "friction": "N", "guide.spring.spring_zero": "m"}
    units |= {"guide.spring.spring_stiffness": "N/m", "guide.viscous_friction.viscous_coefficient": "N s/m"}
    found = {name: ParameterSummary(value=laboratory.CART[of], unit=units[name]) for name, of in OF_CART.items()}
    found["force_offset"] = ParameterSummary(value=0.0, unit="N", free=False)
    covariance = np.array([[1e-6]])
    known = Known("the fit", study, found, ("mass",), covariance, {}, frozenset())
    predicted = predict_study(known, study)
    told = predicted.summary().channels["position"]
    assert told.explained is not None
    assert told.explained > 0.999
    assert predicted.parts["values"].max() > 0.0
    assert {name for name, table in predicted.study.parameters.items() if table.fixed} == {"force_offset"}
