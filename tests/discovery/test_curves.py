"""Free curves, and what is told from their shape."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.declarations import Statement
from fibrefit.discovery.curves import curves
from fibrefit.discovery.curves.free_form import FittedCurve, curve_facts, shape_errors
from fibrefit.discovery.curves.probes import FINE_KNOTS, KNOTS, PROBES, FrictionOfPosition, TensionOfRate
from fibrefit.laws.catalogue import suits
from fibrefit.laws.law import SensorLaw
from fibrefit.report.sentences.discovery import discovery_sentence
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.rig import Rig


def each(rig: Rig) -> list[Rig]:
    """A rig and all its variants."""
    return [rig, *(one for variant in rig.variants.values() for one in each(variant))]


PLACES = np.linspace(-0.02, 0.01, FINE_KNOTS)


def fitted_curve(heights: np.ndarray) -> FittedCurve:
    none = cast(Any, None)
    return FittedCurve(FrictionOfPosition, PLACES, heights, np.ones(len(heights)), none, 10.0, 10.0, none, none)


def said_of(heights: np.ndarray) -> str:
    return discovery_sentence(Statement("curve_gains", curve_facts(fitted_curve(heights)) | {"gain": 10.0}))


@pytest.mark.parametrize("probe", PROBES)
def test_a_curve_passes_through_its_heights_and_is_level_beyond(probe: type) -> None:
    heights = np.random.default_rng(1).normal(size=probe.knots)
    curve = probe(0.0, 2.0, *heights)
    knots = np.linspace(0.0, 2.0, probe.knots)
    middles = 0.5 * (knots[1:] + knots[:-1])
    np.testing.assert_allclose([curve.at(x) for x in knots], heights, atol=1e-12)
    np.testing.assert_allclose([curve.at(x) for x in middles], 0.5 * (heights[1:] + heights[:-1]), atol=1e-12)
    assert (curve.at(-1.0), curve.at(3.0)) == (heights[0], heights[-1])


@pytest.mark.parametrize(
    "rig", [pytest.param(one, id=f"{kind}-{i}") for kind, rig in RIGS.items() for i, one in enumerate(each(rig))]
)
def test_a_curve_of_readings_suits_only_rigs_that_have_them(rig: Rig) -> None:
    channels = {channel: jnp.linspace(-1.0, 1.0, 5) for channel in rig.channels}
    for probe in (probe for probe in PROBES if suits(probe, rig) and issubclass(probe, SensorLaw)):
        changed = probe(-1.0, 1.0, *np.ones(probe.knots)).measure(channels, jnp.arange(5.0))
        assert set(changed) == set(channels)
        assert any(
            np.ptp(changed[name] - channels[name]) < 1e-12 < changed[name][0] - channels[name][0] for name in channels
        )


def test_knots_over_the_position_are_finer() -> None:
    assert FrictionOfPosition.knots == FINE_KNOTS > TensionOfRate.knots == KNOTS
    assert FrictionOfPosition.strength == ("low",)
    assert len(FrictionOfPosition.parameters) == 2 + FINE_KNOTS


@pytest.mark.parametrize("periods", [2.0, 4.0])
def test_a_wave_is_counted_by_its_turns_whatever_its_level(periods: float) -> None:
    wave = np.sin(2.0 * np.pi * periods * np.linspace(0.0, 1.0, FINE_KNOTS))
    ripple = 0.05 * (-1.0) ** np.arange(FINE_KNOTS)
    assert f"rising and falling {round(2 * periods)} times over 30 mm" in said_of(7.0 + wave + ripple)


def test_a_stop_is_told_by_where_it_begins() -> None:
    stop = np.maximum(PLACES - 0.005, 0.0) * 1e3
    says = said_of(stop)
    assert "beyond a position of 5" in says
    assert "rising and falling" not in says


def test_a_curve_is_drawn_with_the_gap_that_it_leaves_of_the_readings_it_was_drawn_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of records that count up to the first bounce: a final fit of whole ones has more samples."""
    stays = {"position": (np.linspace(-0.02, 0.01, 100), np.full(100, 5e-4))}
    monkeypatch.setattr(curves, "in_motion", lambda found: stays)
    seen: Any = SimpleNamespace(
        supermodel=SimpleNamespace(samples=np.array([100.0, 60.0])), fit=SimpleNamespace(cost=640.0)
    )
    (drawn,) = curves.drawn([replace(fitted_curve(np.sin(PLACES * 1e3)), hypothesis=seen)], cast(Any, None))
    assert (drawn.gap_after, drawn.cost) == (2.0, 640.0)
    assert sum(drawn.seconds) == pytest.approx(0.05)


def test_errors_of_a_shape_leave_out_a_level_that_is_not_known() -> None:
    """Heights known to a tenth beside each other, with a level that might be anything."""
    random = np.random.default_rng(3)
    errors = np.array([0.1, 0.2, 0.1, 0.3, 0.1, 0.1])
    spread = np.diag(errors**2)
    found = shape_errors(spread + 100.0)
    assert np.all(found > 0.05)
    assert np.all(found < 0.5)
    # Against draws: heights less their mean, weighed by what is known of each.
    drawn = random.standard_normal((20_000, 6)) * errors
    weights = 1.0 / errors**2
    level = drawn @ weights / weights.sum()
    np.testing.assert_allclose(shape_errors(spread), (drawn - level[:, None]).std(axis=0), rtol=0.05)
    # The negative control: the errors of the heights themselves are those of their level.
    assert np.sqrt(np.diag(spread + 100.0)).min() > 9.0
