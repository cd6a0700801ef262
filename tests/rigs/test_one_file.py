"""A rig of one file and one line in the list of kinds: read, fitted, and all that every rig keeps."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fibrefit.core.declarations import KINDS
from fibrefit.core.errors import StudyError
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load, load_study, study_from_files
from fibrefit.study.draft import FileReading, study_text
from fibrefit.study.rigs import RIG_KEYS, declared_keys, study_of, study_type
from fibrefit.workflow.fit import fit_study
from tests.rigs import cubic_spring
from tests.simulation.drops import OF_RIG, given, usual

MASS, STIFFNESS, CUBIC, DAMPING = 0.8, 120.0, 3e4, 0.15
NOISE = 2e-5
STUDY = 'schema = "fibrefit/study/1"\nname = "spring"\n[rig]\nkind = "cubic_spring"\n{said}'


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a file in the folder of rigs and a line in the list of kinds do."""
    monkeypatch.setitem(sys.modules, "fibrefit.rigs.cubic_spring", cubic_spring)
    monkeypatch.setattr(load, "KINDS", (*KINDS, "cubic_spring"))
    monkeypatch.setitem(RIGS, "cubic_spring", cubic_spring.CUBIC_SPRING)


def swing(folder: Path, said: str = f'mass = "{MASS} kg"\n') -> Path:
    times = np.arange(0.0, 4.0, 0.005)

    def rate(_: float, now: Any) -> list[float]:
        return [now[1], -(STIFFNESS * now[0] + CUBIC * now[0] ** 3 + DAMPING * now[1]) / MASS]

    solved = solve_ivp(rate, (0.0, 4.0), [0.06, 0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    read = solved.y[0] + np.random.default_rng(1).normal(0.0, NOISE, len(times))
    np.savetxt(
        folder / "swing.csv", np.column_stack([times, 1e3 * read]), "%.6f", ",", header="t [s],x [mm]", comments=""
    )
    text = STUDY.format(said=said) + '[channels]\nposition = "x [mm]"\n[[records]]\nfile = "swing.csv"\n'
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return folder / "study.toml"


@pytest.mark.usefixtures("registered")
def test_what_was_put_into_it_is_found_again(tmp_path: Path) -> None:
    fit = fit_study(load_study(swing(tmp_path)), starts=2)
    for name, truth in (("stiffness", STIFFNESS), ("cubic", CUBIC), ("damping", DAMPING)):
        found = fit.parameters[name]
        assert found.value == pytest.approx(truth, abs=max(4.0 * found.std_error, 1e-3 * truth)), name


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("", r"no mass.*it here or under \[rig\]"),
        ('mass = "800 mm"\n', "mass"),
        ('mass = "0 kg"\n', "a value above 0 kg"),
        ('mas = "0.8 kg"\n', "unknown key.*mass"),
    ],
)
def test_what_its_study_must_say_is_asked_for(tmp_path: Path, said: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        load_study(swing(tmp_path, said))


@pytest.mark.usefixtures("registered")
def test_its_study_survives_being_written(tmp_path: Path) -> None:
    study = load_study(swing(tmp_path))
    (tmp_path / "again.toml").write_text(study.resolved_toml(tmp_path), encoding="utf-8")
    assert load_study(tmp_path / "again.toml").records[0].mass == MASS
    assert study_from_files([tmp_path / "swing.csv"], "cubic_spring", ["rig.mass=0.8 kg"]).records[0].mass == MASS


@pytest.mark.parametrize(
    ("roles", "kind"),
    [
        ((), "fibre_mass"),
        (("force", "position"), "fibre_mass"),
        (("force", "position", "drive"), "pulley_drive"),
        (("angle",), "pendulum"),
        (("angle", "force_1", "force_2", "drive"), "inverted_pendulum"),
    ],
)
def test_bare_files_are_taken_for_the_rig_whose_channels_they_hold(roles: tuple[str, ...], kind: str) -> None:
    files = [FileReading(Path("x.csv"), dict.fromkeys(roles, "x"))]
    assert f'kind = "{kind}"' in study_text(files, None, (), Path()).text


#: Conditions that no study states: they are changed by effects alone.
NEVER_STATED = {"pulley_drive": {"near_share"}}


def keys(study: Any) -> set[str]:
    return set(study.model_fields["records"].annotation.__args__[0].model_fields)


@pytest.mark.parametrize("kind", RIG_KEYS)
def test_a_study_that_says_more_than_its_rig_says_what_that_declares(kind: str) -> None:
    own, derived = study_type(kind), study_of(kind, declared_keys(RIGS[kind]))
    assert own.base_parameters == derived.base_parameters
    assert keys(derived) - keys(own) == NEVER_STATED.get(kind, set())
    for part in ("channels", "noise"):
        assert set(dict(derived.model_fields[part].default)) <= set(dict(own.model_fields[part].default))


def shapes(kind: str, ask: Callable[[Any, Any, Any, dict[str, Any]], Any]) -> Any:
    """What a rig answers of its first instant, without computing it."""
    rig, record = RIGS[kind], usual(kind)
    inputs = {name: (signal.values[0], signal.slopes[0]) for name, signal in record.inputs.items()}
    inputs |= {"anchor": inputs["force"]} if rig.anchor else {}

    def first(values: Any) -> Any:
        system = rig.build(values, record.conditions, (), "clamped")
        start = rig.start(system, values, record.conditions, inputs)
        return ask(system, start.state, start.mode, inputs)

    return jax.eval_shape(first, given(OF_RIG[kind]))


@pytest.mark.parametrize("kind", RIGS)
def test_every_rig_keeps_what_is_asked_of_one(kind: str) -> None:
    rig = RIGS[kind]
    assert rig.kind == kind
    assert set(shapes(kind, rig.observe)) == set(rig.channels)
    state = shapes(kind, lambda system, state, mode, inputs: state)
    turns = hasattr(state, "angle")
    assert hasattr(state, "rate" if turns else "velocity")
    assert turns or hasattr(state, "position")
    mode, margins = (
        shapes(kind, ask)
        for ask in (lambda s, x, mode, i: mode, lambda system, state, mode, inputs: system.margins(state, mode, inputs))
    )
    assert jax.tree.structure(mode) == jax.tree.structure(margins)
    assert Model(rig, ()).parameters
