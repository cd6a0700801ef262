"""Curves over speed: their shape, and that a fit finds them again."""

from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.fitting.identify import identify
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.functions_of_speed import MEDIUM, REFERENCE, SLOW, TOP, monotone, power
from tests.fitting import made

SPEEDS = jnp.linspace(0.0, 0.6, 2401)
SHARES = [(0.4, 0.4), (0.0, 0.5), (1.0, 1.0), (0.9, 0.05), (0.5, 0.0)]
#: Between neighbouring speeds a curve with slopes of at most some tens cannot move by more.
STEADY = 0.02
#: A few standard errors where two drops determine a curve of three numbers.
FOUND = 0.15


@pytest.mark.parametrize(("slow", "medium"), SHARES)
def test_a_monotone_curve_rises_through_its_knots(slow: float, medium: float) -> None:
    curve = jax.vmap(lambda v: monotone(v, jnp.asarray(slow), jnp.asarray(medium)))
    values = np.asarray(curve(SPEEDS))
    assert values[0] == 0.0
    assert (np.diff(values) >= -1e-14).all()
    assert np.abs(np.diff(values)).max() < STEADY
    knots = np.asarray(curve(jnp.array([SLOW, MEDIUM, TOP, 1.0])))
    np.testing.assert_allclose(knots, [slow * medium, medium, 1.0, 1.0], atol=1e-12)


@pytest.mark.parametrize(("slow", "medium"), SHARES)
def test_a_monotone_curve_has_slopes_everywhere(slow: float, medium: float) -> None:
    for speed in (0.0, SLOW, 0.07, MEDIUM, TOP, 0.9):
        slopes = jax.grad(monotone, (0, 1, 2))(*map(jnp.asarray, (speed, slow, medium)))
        assert all(np.isfinite(slope) for slope in slopes)


@pytest.mark.parametrize("exponent", [0.2, 0.7, 1.0, 2.0])
def test_a_power_law_is_nil_at_rest_and_one_at_its_reference(exponent: float) -> None:
    p = jnp.asarray(exponent)
    assert power(jnp.zeros(()), p) == 0.0
    assert power(jnp.asarray(REFERENCE), p) == pytest.approx(1.0)
    fast = power(jnp.asarray(1.0), p) / power(jnp.asarray(0.5), p)
    assert fast == pytest.approx(2.0**exponent, rel=0.1)
    assert np.isfinite(jax.grad(power, (0, 1))(jnp.zeros(()), p)).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("fibre.damping_power_law", {"change": 0.8, "exponent": 0.6}),
        ("guide.friction_power_law", {"change": 0.9, "exponent": 1.0}),
        ("fibre.damping_speed_curve", {"change": 1.5, "slow_share": 0.3, "medium_share": 0.4}),
    ],
)
def test_a_fit_finds_the_curve_again(tmp_path: Path, name: str, values: dict[str, float]) -> None:
    effect = CATALOGUE[name]
    true = {f"{name}.{key}".replace(".", "__"): value for key, value in values.items()}
    records = made.records(effects=(effect,), **true)
    found = identify(made.task(tmp_path, records, (effect,)), 4)
    law, known = (
        effect(**{p.name: jnp.asarray(v[p.name]) for p in effect.parameters})
        for v in ({p.name: found.parameters[f"{name}.{p.name}"].value for p in effect.parameters}, values)
    )
    base = "friction" if name.startswith("guide") else "damping"
    scale = found.parameters[base].value
    for speed in (0.05, 0.1, 0.2, 0.4):
        v = jnp.asarray(speed)
        if base == "friction":
            one, other = (
                level + law_.friction(jnp.asarray(level), jnp.ones(()), v, v)
                for level, law_ in ((scale, law), (made.TRUTH[base], known))
            )
        else:
            one, other = scale * law.damping_factor(v, v), made.TRUTH[base] * known.damping_factor(v, v)
        assert float(one) == pytest.approx(float(other), rel=FOUND), f"at {speed} m/s"
