"""From records to the missing effect and back, with nothing stubbed; the data come from another simulator."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from pathlib import Path

import pytest

from fibrefit.study import load_study
from fibrefit.workflow.discovery.discover import Discovery, discover_study
from tests.cli.conftest import Run, fibrefit  # noqa: F401
from tests.discovery.conftest import DATA

TRIED = ("guide.viscous_friction", "sensor.force_delay")
WORDS = tuple(word for name in TRIED for word in ("--only", name))
HIDDEN = {"guide.viscous_friction.viscous_coefficient": 2.5, "stiffness": 2.2e4, "damping": 20.0, "friction": 3.0}
SURE = 4.0
"""Standard errors by which four values may together be wrong: once in four thousand."""
SAME = 0.1
"""Standard errors by which two searches may end apart: the solver stops there."""


def test_a_hidden_friction_is_named_added_and_found_again(
    fibrefit: Run,  # noqa: F811
) -> None:
    found = fibrefit("discover", str(DATA / "viscous"), *WORDS, "--out", "out", "--json").document
    assert (found["verdict"], found["added"]) == ("named", ["guide.viscous_friction"])
    for name, truth in HIDDEN.items():
        estimate = found["parameters"][name]
        assert abs(estimate["value"] - truth) < SURE * estimate["std_error"], name
    assert found["before"]["gap"]["total"] > 3.0
    assert found["gap"]["total"] < 1.1
    assert all(held["gap_after"] < 1.15 < held["gap_before"] for held in found["held_out"])
    assert [candidate["effect"] for candidate in found["rounds"][0]["ranking"]] == list(TRIED)

    again = fibrefit("fit", "out/study.toml", "--starts", "2", "--out", "refit", "--json").document
    assert again["effects"] == ["guide.viscous_friction"]
    for name in HIDDEN:
        apart = abs(again["parameters"][name]["value"] - found["parameters"][name]["value"])
        assert apart < SAME * found["parameters"][name]["std_error"], name

    shown = fibrefit("discover", str(DATA / "viscous"), *WORDS, "--out", "out")
    assert "The same search was made before" in shown.err
    assert shown.out == fibrefit("show", "out").out

    # The negative control: nothing is hidden, and nothing is found.
    clean = fibrefit("discover", str(DATA / "plain"), *WORDS, "--out", "plain", "--json").document
    assert (clean["verdict"], clean["added"], clean["rounds"]) == ("nothing_missing", [], [])
    assert load_study("plain/study.toml").model.effects == ()


@pytest.mark.slow
def test_a_person_chooses(
    fibrefit: Run,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("guide.viscous_friction\n"))
    chosen = fibrefit("discover", str(DATA / "viscous"), *WORDS, "--out", "chosen", "--json", "--interactive")
    assert chosen.document["added"] == ["guide.viscous_friction"]
    assert chosen.document["provenance"]["settings"]["interactive"] == "yes"


@pytest.fixture(scope="module")
def rough() -> Discovery:
    """A friction that depends on the position, which no effect of the catalogue does."""
    return discover_study(load_study(DATA / "rough"), only=TRIED)


@pytest.mark.slow
def test_what_is_outside_the_catalogue_is_not_named(rough: Discovery) -> None:
    assert rough.verdict == "unexplained"
    assert rough.added == ()
    left = rough.summary().unexplained
    assert "friction" in left.looks_like
    best = left.curves[0]
    assert left.looks_like.startswith(best.says)
    assert all(error is not None and error > 0.0 for error in best.std_errors)
    assert "curve" in rough.plot()
    assert "What is missing, as a curve" in rough.report()
    assert "Let the whole catalogue be tried" in " ".join(rough.summary().advice)


@pytest.mark.slow
def test_a_person_answers_through_a_pipe(tmp_path: Path) -> None:
    words = (
        sys.executable,
        "-m",
        "fibrefit",
        "discover",
        str(DATA / "viscous"),
        *WORDS,
        "--out",
        "out",
        "--interactive",
    )
    done = subprocess.run(
        [*words, "--json"], input="7\n1\n", capture_output=True, text=True, cwd=tmp_path, check=True
    )  # fmt: skip
    assert json.loads(done.stdout)["added"] == ["guide.viscous_friction"]
    assert '"7" is none of them.' in done.stderr
    assert "... trying each effect, round 1" in done.stderr
