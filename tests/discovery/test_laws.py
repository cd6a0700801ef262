"""Laws for free curves: forms are told from one another, and written as effects that keep the contract."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.discovery.curves.probes import COURSES, PROBES
from fibrefit.discovery.engine.priors import _line
from fibrefit.discovery.laws import two_variables
from fibrefit.discovery.laws.forms import FORMS, FittedForm, Form, Quadratic, forms_of
from fibrefit.discovery.laws.places import PLACES, SECOND, SECOND_VARIABLES, SecondVariable, second_variables
from fibrefit.discovery.laws.relaxation import nearest_curve, places_along
from fibrefit.discovery.laws.source import composed, effect_of_law, heights_of, start_of_law
from fibrefit.laws.contract import violations
from fibrefit.problem.statement.layout import Range
from fibrefit.rigs.catalogue import RIGS

LOW, HIGH = 0.02, 0.11
KNOTS = np.linspace(LOW, HIGH, 40)
NOISE = 0.02
RATE = next(probe for probe in PROBES if probe.variable == "stretch rate")
TRUE: dict[str, tuple[float, ...]] = {
    "linear": (30.0,),
    "knee_above": (40.0, 0.07),
    "knee_below": (60.0, 0.05),
    "power": (2.0, 2.6),
    "saturating": (3.0, 0.01),
    "exponential": (2.0, 0.02),
    "peak": (2.0, 0.02),
    "bump": (1.5, 0.06, 0.006),
    "sine": (1.0, 0.017, 0.8),
    "step": (1.2, 0.065),
}
CONDITIONS = {condition.name: 1.0 for rig in RIGS.values() for condition in rig.conditions}
BY_NAME = {form.name: form for form in FORMS}


def height(form: Form, values: tuple[float, ...]) -> np.ndarray:
    """The curve nearest to a form, by the effect that is written of it."""
    law = composed(PROBES[1], FittedForm(form, values, 0.0), KNOTS)
    return nearest_curve(KNOTS) @ heights_of(law, places_along(KNOTS), values)


def held(knots: np.ndarray, heights: np.ndarray, error: float, taken_up: int) -> Quadratic:
    """Heights at knots known to an error, but for a polynomial that base parameters take up."""
    free = np.vander((knots - knots[0]) / (knots[-1] - knots[0]), taken_up + 1)
    seen = np.linalg.svd(free)[0][:, taken_up + 1 :].T / error
    return Quadratic(knots, places_along(knots), seen @ nearest_curve(knots), seen @ heights)


def test_there_is_a_case_for_every_form() -> None:
    assert set(TRUE) == set(BY_NAME)


@pytest.mark.parametrize("name", TRUE)
def test_a_form_is_found_by_its_curve(name: str) -> None:
    """Level and noise on top: the values come back, and no other form does better."""
    random = np.random.default_rng(3)
    heights = height(BY_NAME[name], TRUE[name]) + 0.7 + NOISE * random.standard_normal(len(KNOTS))
    found = forms_of(held(KNOTS, heights, NOISE, 0))
    assert found[0].form.name == name
    assert found[0].values == pytest.approx(TRUE[name], rel=0.15)


@pytest.mark.parametrize(
    ("name", "values"), [("saturating", (20.0, 0.05)), ("peak", (12.0, 0.1)), ("power", (9.0, 2.0))]
)
def test_a_form_of_a_variable_with_two_signs_begins_at_zero_and_is_odd(name: str, values: tuple[float, ...]) -> None:
    """A tension that saturates with the rate of stretch does so both ways."""
    rates = np.linspace(-0.4, 0.4, 10)
    law = composed(RATE, FittedForm(BY_NAME[name], values, 0.0), rates)
    heights = nearest_curve(rates) @ heights_of(law, places_along(rates), values)
    np.testing.assert_allclose(heights, -heights[::-1], atol=1e-12)
    found = forms_of(held(rates, heights + 0.3, 1e-3, 1), signed=True)
    assert found[0].form.name == name
    assert found[0].values == pytest.approx(values, rel=0.05)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize(("probe", "low", "high"), [(0, 0.02, 0.11), (0, -0.03, 0.05), (5, -0.4, 0.4)])
def test_the_equation_that_is_told_is_the_law(form: Form, probe: int, low: float, high: float) -> None:
    """With the numbers of its parameters by their symbols, and nothing else to look up."""
    knots = np.linspace(low, high, 12)
    span = high - low
    by_kind = {
        "height": 1.5,
        "slope": 3.0,
        "steep": 3.0,
        "place": low + 0.4 * span,
        "length": 0.2 * span,
        "number": 2.0,
        "turn": 0.7,
    }
    values = [by_kind[term.kind] for term in form.quantities]
    law = composed(PROBES[probe], FittedForm(form, tuple(values), 0.0), knots)
    said = re.sub(r"(\d|\bpi|\b[a-z]|\)) (?=[a-z(|\d])", r"\1 * ", law.expression.replace("^", " ** "))
    said = re.sub(r"\|x\|", "abs(x)", said).replace("pi", "np.pi").replace("max(", "np.maximum(")
    functions = {"np": np, "exp": np.exp, "sin": np.sin, "tanh": np.tanh, "sign": np.sign, "abs": np.abs}
    symbols = {term.symbol: value for term, value in zip(form.quantities, values, strict=True)}
    told = eval(said, functions | symbols | {"x": knots})
    np.testing.assert_allclose(
        np.asarray(effect_of_law(law)(*values)._at(knots)),  # type: ignore[attr-defined]
        told * np.ones(12), rtol=1e-3, atol=2e-3,
    )  # fmt: skip
    assert law.expression in law.source


def test_a_law_is_numbered_where_there_is_one_of_its_name() -> None:
    """As where a search goes on from a study that holds one."""
    form = FittedForm(BY_NAME["sine"], TRUE["sine"], 0.0)
    first = composed(PROBES[0], form, KNOTS)
    second = composed(PROBES[0], form, KNOTS, {first.name})
    assert (second.name, second.title, second.file) == (f"{first.name}_2", f"{first.title}2", f"{first.file[:-3]}_2.py")
    assert composed(PROBES[0], form, KNOTS, {first.name, second.name}).name == f"{first.name}_3"
    assert effect_of_law(second).name == second.name


def test_noise_has_no_form() -> None:
    """The negative control: of pure noise no form says more than its numbers cost."""
    random, gained = np.random.default_rng(4), []
    for _ in range(20):
        heights = random.standard_normal(len(KNOTS))
        nothing = float(np.sum((heights - heights.mean()) ** 2))
        gained.append(nothing - forms_of(held(KNOTS, heights, 1.0, 0))[0].score)
    assert np.median(gained) < 5.0


def test_what_base_parameters_take_up_is_no_law() -> None:
    """A line that they take up costs nothing: no form says more of it than nothing does."""
    curve = np.exp(-(((KNOTS - 0.06) / 0.006) ** 2) / 2.0)
    beneath = forms_of(held(KNOTS, curve + 300.0 * KNOTS - 7.0, NOISE, 1))
    assert beneath[0].form.name == "bump"
    assert beneath[0].values == pytest.approx((1.0, 0.06, 0.006), rel=0.05)


def test_no_period_is_shorter_than_two_knots() -> None:
    """Of such a one the knots see a slow wave or none (Nyquist): any amplitude would do."""
    few = np.linspace(LOW, HIGH, 9)
    heights = 0.5 * np.cos(np.pi * np.arange(9)) * np.linspace(0.2, 1.0, 9)
    found = {one.form.name: one.values for one in forms_of(held(few, heights, NOISE, 1))}
    assert found["sine"][1] >= 2.0 * (few[1] - few[0]) * (1.0 - 1e-9)
    assert abs(found["sine"][0]) < 2.0


def test_every_probe_has_a_place() -> None:
    assert set(PLACES) == {probe.name for probe in (*PROBES, *COURSES)}


@pytest.mark.parametrize("probe", [*PROBES, *COURSES], ids=lambda probe: probe.name)
@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_what_is_written_is_an_effect(probe: type, form: Form) -> None:
    law = composed(probe, FittedForm(form, TRUE[form.name], 0.0), KNOTS)
    effect = effect_of_law(law)
    assert effect.name == law.name
    assert effect.__doc__
    names = [f"{law.name}.{parameter.name}" for parameter in effect.parameters]
    assert list(start_of_law(law)) == names
    assert effect.strength == (effect.parameters[0].name,)
    # The places the contract looks at may lie where a law with a knee does not act.
    assert not [error for error in violations(effect, CONDITIONS) if "changes nothing" not in str(error)]
    assert effect_of_law(law) is effect


def test_a_law_that_cannot_be_carried_out_says_the_same_each_time() -> None:
    law = composed(PROBES[0], FittedForm(FORMS[0], TRUE[FORMS[0].name], 0.0), KNOTS)
    broken = law._replace(source="amplitude = 1 / 0\n")
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            effect_of_law(broken)


CHANGING = [(probe, second) for probe in (*PROBES, *COURSES) for second in second_variables(probe)]


@pytest.mark.parametrize(("probe", "second"), CHANGING, ids=lambda of: getattr(of, "name", None) or of.variable)
def test_a_law_of_two_variables_is_an_effect_and_without_the_second_one_it_is_that_of_the_first(
    probe: type, second: SecondVariable
) -> None:
    fitted = FittedForm(BY_NAME["peak"], TRUE["peak"], 0.0)
    plain, law = composed(probe, fitted, KNOTS), composed(probe, fitted, KNOTS, (), second, 2.0)
    effect = effect_of_law(law)
    assert start_of_law(law) == {f"{law.name}.{name}": value for name, value in zip(
        ("amplitude", "scale", SECOND.name), (*TRUE["peak"], 0.0), strict=True
    )}  # fmt: skip
    assert effect.strength == ("amplitude",)
    changes = {parameter.name: parameter for parameter in effect.parameters}[SECOND.name]
    assert (changes.typical, changes.spread) == (0.5, 1.0)
    assert law.expression == f"({plain.expression}) (1 + d y)"
    assert f"y the {second.variable} in {second.unit}" in " ".join((effect.__doc__ or "").split())
    assert not [error for error in violations(effect, CONDITIONS) if "changes nothing" not in str(error)]


def test_an_error_of_a_gauge_changes_with_the_time_in_a_record() -> None:
    gauges = [(probe, second) for probe, second in CHANGING if PLACES[probe.name].port == "sensor"]
    timed = [(probe, second) for probe, second in gauges if second.variable == "time"]
    assert len(timed) == len({probe for probe, _ in gauges})
    channels = {"force": jnp.full(3, 4.0), "position": jnp.full(3, 0.05)}
    times = jnp.array([2.0, 2.5, 3.0])
    for probe, second in timed:
        law = composed(probe, FittedForm(BY_NAME["peak"], TRUE["peak"], 0.0), KNOTS, (), second, 2.0)
        values = {name.rpartition(".")[2]: value for name, value in start_of_law(law).items()}
        steady = effect_of_law(law)(**values).measure(channels, times)
        growing = effect_of_law(law)(**values | {SECOND.name: 0.5}).measure(channels, times)
        (role,) = [role for role in channels if not np.allclose(steady[role], channels[role])]
        ratio = (growing[role] - channels[role]) / (steady[role] - channels[role])
        np.testing.assert_allclose(ratio, [1.0, 1.25, 1.5], rtol=1e-9)


def test_every_second_variable_is_known_somewhere() -> None:
    assert {second.variable for _, second in CHANGING} == {one.variable for one in SECOND_VARIABLES}
    for probe, second in CHANGING:
        assert second.variable != probe.variable  # type: ignore[attr-defined]


@pytest.mark.parametrize("shift", [0.0, -0.5, 7.0])
def test_where_the_zero_of_its_variable_lies_makes_no_place_of_a_law_less_likely(shift: float) -> None:
    probe, form = PROBES[0], next(form for form in FORMS if form.name == "knee_above")
    span = KNOTS[-1] - KNOTS[0]
    knots = KNOTS - KNOTS[0] + shift * span
    law = composed(probe, FittedForm(form, TRUE[form.name], 0.0), knots)
    place = next(one for one in effect_of_law(law).parameters if one.name == "knee")
    _, middle, scale, *_ = _line(
        place, cast(Any, SimpleNamespace(name="guide.law.knee", range=Range.of(place))), None, []
    )
    assert middle == pytest.approx(knots[0] + span / 2.0)
    assert scale == pytest.approx(span / 2.0)


def test_a_second_variable_is_looked_for_in_the_best_law_of_each_of_the_best_curves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Laws of one curve come among those of others: the worst of them says nothing of its place."""
    asked = list[str]()

    def composed(probe: Any, form: str, *of: Any) -> Any:
        asked.append(form)
        return SimpleNamespace(second=None)

    curves: Any = [SimpleNamespace(probe=probe, knots=None) for probe in "ABC"]
    monkeypatch.setattr(two_variables, "_spans", lambda *of: {"speed": 1.0})
    monkeypatch.setattr(two_variables, "second_variables", lambda probe: [SimpleNamespace(variable="speed")])
    monkeypatch.setattr(two_variables, "composed", composed)
    monkeypatch.setattr(two_variables, "fit_all", lambda jobs, tell: [None] * len(jobs))
    names = ("A1", "B1", "B2", "C1", "C2", "A2")
    ranked: Any = [
        (SimpleNamespace(log=100.0 - i), SimpleNamespace(probe=name[0], fitted=name)) for i, name in enumerate(names)
    ]
    model = SimpleNamespace(effects=())
    task = SimpleNamespace(problem=SimpleNamespace(model=model))
    search: Any = SimpleNamespace(tell=lambda *of: None, task=task)
    parent: Any = SimpleNamespace(effects=())
    found = two_variables.with_second_variables(search, cast(Any, None), parent, ranked, curves)
    assert asked == ["A1", "B1"]
    assert found == ranked
