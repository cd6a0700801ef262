"""What is said of a user's own law: the cheap refusals at once, the whole contract where it is asked for."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from fibrefit.core.errors import StudyError
from fibrefit.laws.catalogue import CATALOGUE, all_wrong, find_effect
from fibrefit.laws.contract import violations
from fibrefit.laws.law import Effect
from fibrefit.laws.ports import PORTS
from fibrefit.laws.template import class_name, template
from fibrefit.rigs.catalogue import RIGS

CONDITIONS = {condition.name: 1.0 for rig in RIGS.values() for condition in rig.conditions}
HEAD = """
from typing import ClassVar
import jax
import jax.numpy as jnp
from fibrefit.laws.law import DriveLaw, Effect, FibreLaw, GuideLaw, SensorLaw, quantity

"""
DOC = """    '''A drag.

    Law
    ---
    ``c v^3``.
    '''
"""
GOOD = f"""
class Mine(GuideLaw):
{DOC}
    name: ClassVar[str] = "guide.mine"
    c: jax.Array = quantity("N s^3/m^3", "a coefficient", 1.0, lower=0.0)

    def force(self, position, velocity):
        return self.c * velocity**3
"""
FIELD = "    c: jax"
ANSWER = "self.c * velocity**3"

AT_ONCE = [
    ("def force", "def forse", r'forse: no hook of the port guide.*Did you mean "force"\?'),
    ('"N s^3/m^3"', '"quux"', 'parameter c: unknown unit "quux"'),
    ('"N s^3/m^3"', '"kN"', 'unit "kN" is not SI'),
    ('"guide.mine"', '"bearing.mine"', 'unknown port "bearing"'),
    ('"guide.mine"', '"gide.mine"', 'Did you mean "guide"'),
    ("class Mine(GuideLaw)", "class Mine(Effect)", "a law of no port"),
    (FIELD, f"    d: jax.Array\n{FIELD}", "field d: not declared as a parameter"),
    (FIELD, f"    d = quantity('N', 'no annotation', 1.0)\n{FIELD}", "d.*annotation"),
    (FIELD, f"    rigs = frozenset()\n{FIELD}", "rigs: means nothing in a law.*acts_on"),
    (FIELD, f"    stif = True\n{FIELD}", 'stif: means nothing in a law.*"stiff"'),
    (FIELD, f"    strength = ('d',)\n{FIELD}", 'no parameter "d"'),
    (FIELD, f"    worn = True\n{FIELD}", "worn: means nothing in a law.*history = "),
    (
        FIELD,
        f"    history = ('pat',)\n{FIELD}",
        """history: 'pat'; expected a tuple of 'path', 'rest', 'cycles'.*"path""",
    ),
    (FIELD, f"    history = 'rest'\n{FIELD}", "history: 'rest'; expected a tuple of"),
    (
        f'class Mine(GuideLaw):\n{DOC}\n    name: ClassVar[str] = "guide.mine"',
        f'class Mine(SensorLaw):\n{DOC}\n    timed = True\n    name: ClassVar[str] = "sensor.mine"',
        "timed: True; expected a law that takes part in the motion; not one of a sensor.*`times` in measure",
    ),
]
AT_ONCE += [
    ("1.0, lower", "1.0, null=1.0, lower", "parameter c: typical 1 is its null; expected another value"),
    (FIELD, f"    excludes = 'guide.x'\n{FIELD}", "excludes: 'guide.x'; expected a tuple of names. Write excludes = "),
    (FIELD, f"    needs = 'guide.x'\n{FIELD}", "needs: 'guide.x'; expected a tuple of names"),
    (FIELD, f"    acts_on = 'guide'\n{FIELD}", "acts_on: 'guide'; expected a set of Capability"),
    ('"a coefficient", 1.0', '1.0, "a coefficient"', "parameter c, typical: 'a coefficient'; expected a number"),
]
NOT_COMPILED = [
    (ANSWER, "self.c if velocity > 0 else 0.0", "fails with TracerBool.*jnp.where"),
    (ANSWER, "None", "answers NoneType; expected one number"),
    ("position, velocity)", "velocity)", "fails with TypeError"),
    (
        "    def force",
        "    def __init__(self):\n        pass\n\n    def force",
        "cannot be made: TypeError.*; expected a class without __init__ of its own",
    ),
]
ONLY_WHEN_ASKED = [
    (ANSWER, f"{ANSWER} + 5.0", "force: does not vanish at its null: position or stretch"),
    (ANSWER, "self.c * jnp.sqrt(jnp.abs(velocity))", "gradient not finite at its typical value.*0 m/s"),
    (ANSWER, f"{ANSWER} / velocity", "value not finite"),
    (ANSWER, "0.0 * velocity", "changes nothing at its typical value; expected.*100 mm"),
    (DOC, "", "no docstring"),
    ("    Law\n    ---\n", "", "no section Law"),
    ("1.0, lower=0.0", "-1.0, lower=0.0", "typical -1"),
    ("1.0, lower", "1.0, null=-1.0, lower", "null -1 is out of its range"),
    ('"a coefficient"', '""', "no words for it"),
    ("1.0, lower", "1.0, log=True, lower", "searched by its logarithm from 0; expected a positive lower limit"),
    (
        f"def force(self, position, velocity):\n        return {ANSWER}",
        "def compliance(self): return self.c",
        "compliance: never called, as creeps is not set; expected creeps in the class",
    ),
]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(folder: Path, old: str, new: str) -> str:
    assert old in GOOD
    (folder / "mine.py").write_text(HEAD + GOOD.replace(old, new), encoding="utf-8")
    return "mine.py:Mine"


@pytest.mark.parametrize(
    ("old", "new", "says"), AT_ONCE + NOT_COMPILED, ids=[says for *_, says in AT_ONCE + NOT_COMPILED]
)
def test_what_no_model_can_hold_is_refused_at_once(tmp_path: Path, old: str, new: str, says: str) -> None:
    with pytest.raises(StudyError) as refused:
        find_effect(written(tmp_path, old, new), tmp_path)
    assert re.search(says, str(refused.value))


@pytest.mark.parametrize(
    ("old", "new", "says"), ONLY_WHEN_ASKED + NOT_COMPILED, ids=[says for *_, says in ONLY_WHEN_ASKED + NOT_COMPILED]
)
def test_the_contract_says_what_is_broken(tmp_path: Path, old: str, new: str, says: str) -> None:
    name = written(tmp_path, old, new)
    wrong = [str(error) for error in all_wrong(name, CONDITIONS)]
    assert len(wrong) == 1 or "null" in says, wrong
    assert any(re.search(says, line) for line in wrong), wrong
    if (old, new, says) in ONLY_WHEN_ASKED:
        find_effect(name, tmp_path)


def test_a_file_that_ends_the_process_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("import sys\nsys.exit()\n", encoding="utf-8")
    with pytest.raises(StudyError, match=r"mine.py fails with SystemExit.*Run the file by itself"):
        find_effect("mine.py:Mine", tmp_path)


def test_a_file_that_was_changed_within_a_second_is_the_one_that_runs(tmp_path: Path) -> None:
    """Python's own byte code is as old as whole seconds tell, and as long as the text."""
    name = written(tmp_path, "1.0, lower", "1.0, lower")
    path = tmp_path / "mine.py"
    before = find_effect(name, tmp_path)
    stamp = path.stat().st_mtime
    path.write_text(path.read_text(encoding="utf-8").replace("1.0, lower", "2.0, lower"), encoding="utf-8")
    os.utime(path, (stamp, stamp))
    assert [law.parameters[0].typical for law in (before, find_effect(name, tmp_path))] == [1.0, 2.0]


def test_a_law_that_keeps_the_contract(tmp_path: Path) -> None:
    assert all_wrong(written(tmp_path, "A drag", "My drag"), CONDITIONS) == ()


def test_a_law_that_acts_far_out_alone(tmp_path: Path) -> None:
    stop = (ANSWER, "self.c * jnp.maximum(position - 0.03, 0.0)")
    assert all_wrong(written(tmp_path, *stop), CONDITIONS) == ()


def test_several_faults_are_all_said(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(HEAD + GOOD.replace("force(", "forse(").replace("N s^3/m^3", "quux"))
    wrong = " ".join(str(error) for error in all_wrong("mine.py:Mine", CONDITIONS))
    assert "forse" in wrong
    assert "quux" in wrong
    assert "changes nothing" not in wrong


@pytest.mark.skipif(os.name == "nt", reason="no file is called so there")
def test_a_file_whose_name_goes_on_behind_its_ending_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.py:old").write_text(HEAD + GOOD, encoding="utf-8")
    with pytest.raises(StudyError, match="mine.py:old is not a Python file; expected a file ending in .py"):
        find_effect("mine.py:old:Mine", tmp_path)


def test_a_taken_name_and_what_is_no_effect(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(HEAD + GOOD.replace("guide.mine", "guide.quadratic_drag") + "number = 3\n")
    assert "is taken" in str(all_wrong("mine.py:Mine", CONDITIONS)[0])
    assert "3 is no effect" in str(all_wrong("mine.py:number", CONDITIONS)[0])


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=list(CATALOGUE))
def test_the_catalogue_keeps_it(effect: type[Effect]) -> None:
    # The mass of the fibre has no hook: the rigs put its points into the equations of motion.
    expected = ["changes nothing"] if effect.name == "fibre.mass" else []
    found = [str(error) for error in violations(effect, CONDITIONS)]
    assert len(found) == len(expected), found
    assert all(words in line for words, line in zip(expected, found, strict=True))


@pytest.mark.parametrize("port", PORTS)
def test_a_template_can_be_used_as_it_is(tmp_path: Path, port: str) -> None:
    (tmp_path / "mine.py").write_text(template(f"{port}.my_law"), encoding="utf-8")
    name = f"mine.py:{class_name('my_law')}"
    assert all_wrong(name, CONDITIONS) == ()
    assert find_effect(name, tmp_path).name == f"{port}.my_law"
    # Of the length that a law in the catalogue may have.
    assert max(map(len, template(f"{port}.my_law").splitlines())) <= 120


@pytest.mark.parametrize("port", PORTS)
def test_a_template_explains_every_hook(port: str) -> None:
    source = template(f"{port}.my_law")
    for name in public_methods(PORTS[port]):
        assert re.search(rf"def {name}\((\n    #     )?self", source)


def test_the_page_on_extending_shows_a_law_that_keeps_the_contract(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "extending.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", page, re.DOTALL)
    assert code is not None
    (tmp_path / "end_stop.py").write_text(code[1], encoding="utf-8")
    assert all_wrong("end_stop.py:EndStop", CONDITIONS) == ()
    for kind in PORTS.values():
        for name in (kind.__name__, *public_methods(kind)):
            assert f"`{name}`" in page, name


def public_methods(kind: type[Effect]) -> list[str]:
    return [name for name, value in vars(kind).items() if callable(value) and not name.startswith("_")]


def test_what_a_law_of_a_gauge_makes_of_a_record_is_left_to_its_record(tmp_path: Path) -> None:
    """It may read the channels of any rig, and filter over more samples than the contract asks it for."""
    body = """
class Mine(SensorLaw):
    name: ClassVar[str] = "sensor.mine"
    c: jax.Array = quantity("-", "a share", 0.1)

    def measure(self, channels, times):
        return {**channels, "angle": jnp.convolve(channels["angle"], jnp.ones(5) / 5.0, "same") * self.c}
"""
    (tmp_path / "mine.py").write_text(HEAD + body, encoding="utf-8")
    assert find_effect("mine.py:Mine", tmp_path).name == "sensor.mine"
