"""Which effects records could show and tell apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.study import Study, load_study
from fibrefit.workflow.confuse import confuse_study
from tests.workflow import axis

TRIED = ("guide.viscous_friction", "guide.quadratic_drag", "sensor.force_delay")


def test_frictions_are_more_alike_than_a_friction_and_a_delay(study: Study) -> None:
    found = confuse_study(study, only=TRIED)
    assert [one.effect for one in found.confusion.directions] == list(TRIED)
    assert found.confusion.invisible == ()
    cosine = found.confusion.cosine
    np.testing.assert_allclose(cosine, cosine.T)
    assert cosine[0, 1] > 0.5 > cosine[0, 2]
    # The records hold a viscous friction that the model lacks.
    assert "drowns weak effects" in found.report().replace("\n", " ")


@pytest.mark.parametrize(("ripple", "louder"), [(0.0, False), (1.5, True)])
def test_effects_of_the_model_are_not_listed_and_what_is_left_hides_weak_ones(
    tmp_path: Path, ripple: float, louder: bool
) -> None:
    slanted = "guide.asymmetric_viscous_friction"
    study = load_study(axis.write(tmp_path, ("guide.viscous_friction",), ripple=ripple))
    found = confuse_study(study, only=(slanted, "guide.quadratic_drag"))
    assert [one.effect for one in found.confusion.directions] == [slanted, "guide.quadratic_drag"]
    assert bool(found.told()["remarks"]) == louder
    weakest = found.confusion.directions[0].detectable
    assert weakest > 0.02 if louder else weakest < 0.005
