"""Corner plots: titles with median and interval, contours, the fit, and no panel that is empty."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.plots.corner import Drawn, corner_figure
from fibrefit.plots.style import caption_of


@pytest.fixture(scope="module")
def drawn() -> list[Drawn]:
    rng = np.random.default_rng(0)
    stiffness = 1e4 + 20.0 * rng.normal(size=4000)
    damping = 9.0 - 0.004 * (stiffness - 1e4) + 0.03 * rng.normal(size=4000)
    return [Drawn("stiffness", "N/m", stiffness, 1e4), Drawn("guide.viscous_friction.damping", "N s/m", damping)]


def test_it_tells_median_interval_and_correlation(drawn: list[Drawn]) -> None:
    figure = corner_figure(drawn, 0.95)
    figure.canvas.draw()
    assert len(figure.axes) == 3
    low, high = np.quantile(drawn[0].values / 1e3, [0.025, 0.975])
    middle = np.median(drawn[0].values) / 1e3
    assert figure.axes[0].get_title() == f"{middle:.3f}\n{low:.3f} to {high:.3f}"
    assert figure.axes[1].get_xlabel() == "stiffness / (kN/m)"
    assert figure.axes[1].get_ylabel() == "damping / (N s/m)"
    correlation = np.corrcoef(drawn[0].values, drawn[1].values)[0, 1]
    assert f"{correlation:.2f}".replace("-", "\N{MINUS SIGN}") in caption_of(figure)
    assert "damping and stiffness are correlated most" in caption_of(figure)


def test_draws_that_are_all_alike_can_be_drawn(drawn: list[Drawn]) -> None:
    still = Drawn("friction", "N", np.full(4000, 2.0))
    corner_figure([drawn[0], still], 0.95).canvas.draw()
    assert caption_of(corner_figure([drawn[0]], 0.9)).startswith("Posterior of the stiffness")
