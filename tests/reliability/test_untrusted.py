"""What comes from files of others neither steers the terminal, nor runs, nor takes all memory."""

from __future__ import annotations

import ast
import csv
import warnings
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

import fibrefit as package
from fibrefit.cli import main, terminal
from fibrefit.cli.terminal import Terminal
from fibrefit.core.errors import StudyError, UsageError
from fibrefit.core.formatting import harmless
from fibrefit.plots.save import figure_file
from fibrefit.store.csv_text import csv_text
from fibrefit.study import load_study
from tests.cli.conftest import Run

EVIL = """from pathlib import Path
Path("ran").write_text("code of a stranger")
"""
RUNS = ("fit", "sample", "discover", "simulate", "sweep", "series", "distinguish", "confuse", "plan", "batch")


@pytest.fixture
def stranger(fibrefit: Run) -> Path:
    """A study that names code."""
    assert fibrefit("init", "study").code == 0
    file = Path("study/study.toml")
    file.write_text(file.read_text("utf-8").replace("effects = []", 'effects = ["evil.py:X"]'), "utf-8")
    Path("study/evil.py").write_text(EVIL)
    return file


@pytest.mark.parametrize("command", RUNS)
def test_code_a_study_names_is_not_run_unasked(fibrefit: Run, stranger: Path, command: str) -> None:
    done = fibrefit(command, str(stranger), "--out", "out")
    assert done.code == 2, done.err
    assert '"evil.py:X" is code that would be run: study/evil.py' in done.err
    assert "--trust" in done.err
    assert not Path("ran").exists()
    assert not Path("out").exists()


def test_code_a_study_names_is_run_when_it_is_trusted(fibrefit: Run, stranger: Path) -> None:
    done = fibrefit("simulate", str(stranger), "--out", "out", "--trust")
    assert Path("ran").exists()
    assert done.code == 4, "the file holds no X"


def test_code_that_is_named_on_the_command_line_is_trusted(fibrefit: Run, stranger: Path) -> None:
    assert fibrefit("discover", str(stranger), "--also", "evil.py:X", "--out", "out").code == 4
    assert Path("ran").exists()


@pytest.mark.parametrize(
    "words",
    [
        ("--also", "my_evil.py:X"),
        ("--also", "evil.py:XY"),
        ("--set", "name=evil.py:X"),
    ],
)
def test_a_name_that_only_holds_that_of_a_stranger_does_not_trust_it(
    fibrefit: Run, stranger: Path, words: tuple[str, str]
) -> None:
    done = fibrefit("discover", str(stranger), *words, "--out", "out")
    assert done.code == 2, done.err
    assert '"evil.py:X" is code that would be run' in done.err
    assert not Path("ran").exists()


@pytest.mark.parametrize(
    "override", ['model.effects=["evil.py:X"]', 'model.effects[0]="evil.py:X"', 'model={effects = ["evil.py:X"]}']
)
def test_code_that_an_override_names_is_trusted(fibrefit: Run, stranger: Path, override: str) -> None:
    assert fibrefit("simulate", str(stranger), "--set", override, "--out", "out").code == 4
    assert Path("ran").exists()


def test_looking_at_a_study_runs_nothing(fibrefit: Run, stranger: Path) -> None:
    assert fibrefit("inspect", str(stranger)).code == 0
    assert not Path("ran").exists()


def test_the_code_of_a_result_is_not_run_unasked(fibrefit: Run, stranger: Path) -> None:
    fibrefit("init", "own")
    done = fibrefit("predict", "study", "own", "--out", "out")
    assert (done.code, Path("ran").exists()) == (2, False), done.err


def test_a_law_that_has_changed_since_the_result_is_refused(stranger: Path, fibrefit: Run) -> None:
    study = load_study(stranger)
    Path("result").mkdir()
    text = study.resolved_toml(relative_to=Path("result"))
    assert "[model.laws]" in text
    Path("result/study.toml").write_text(text, "utf-8")
    assert load_study("result").model.laws.keys() == {"../study/evil.py"}
    Path("study/evil.py").write_text(EVIL + "# changed\n")
    with pytest.raises(StudyError, match=r"evil\.py has changed: its SHA-256 is"):
        load_study("result")


HOSTILE = "time [s],\x1b]0;pwned\x07\x1b[31mforce [N],position [mm]\n" + "".join(
    f"{i / 100},{i % 7},2.{i}\n" for i in range(40)
)


@pytest.mark.parametrize("words", [(), ("--json",), ("-v",)])
def test_escapes_of_a_file_do_not_reach_the_terminal(fibrefit: Run, words: tuple[str, ...]) -> None:
    Path("esc\x1b[31m.csv").write_text(HOSTILE)
    done = fibrefit("inspect", "esc\x1b[31m.csv", *words)
    said = done.out + done.err
    assert said
    assert not {sign for sign in said if not sign.isprintable()} - {"\n", "\t"}
    assert "pwned" in said, "the text is shown, its escapes are spelt out"


def test_escapes_of_a_study_do_not_reach_the_terminal(fibrefit: Run) -> None:
    fibrefit("init", "study")
    file = Path("study/study.toml")
    text = file.read_text("utf-8").replace('name = "', 'name = "\\u001b]0;pwned\\u0007\\u009b31m\\u202e', 1)
    file.write_text(text, "utf-8")
    for words in (("inspect", "study"), ("fit", "study", "--set", "rig.weight_mass=\x1b[31m")):
        said = "".join((lambda done: (done.out, done.err))(fibrefit(*words)))
        assert not {sign for sign in said if not sign.isprintable()} - {"\n", "\t"}, words


MARKS = "\u061c\u200e\u200f\u2028\u2029\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
"""Of line, of paragraph, and of the direction of writing."""


@given(st.text(st.one_of(st.characters(), st.sampled_from(MARKS), st.characters(max_codepoint=0xA0))))
def test_what_is_said_steers_nothing(text: str) -> None:
    said = harmless(text)
    assert not {c for c in said if ord(c) < 32 or 0x7F <= ord(c) < 0xA0} - {"\n", "\t"}
    assert not set(said) & set(MARKS)
    assert harmless(said) == said
    if text.isprintable():
        assert said == text


def test_there_is_one_way_to_the_terminal() -> None:
    """A command that wrote by itself would go round the filter."""
    for file in Path(terminal.__file__).parent.glob("*.py"):
        calls = [
            ast.unparse(node.func)
            for node in ast.walk(ast.parse(file.read_text("utf-8")))
            if isinstance(node, ast.Call)
        ]
        forbidden = {"click.echo", "click.secho", "print", "sys.stdout.write", "sys.stderr.write"} & set(calls)
        assert not forbidden or file.name == "terminal.py", f"{file.name}: {forbidden}"


def test_json_stays_whole(capsys: pytest.CaptureFixture[str]) -> None:
    import json

    Terminal(json=True).answer("", {"name": "\x7f\x1b\u202e"})
    out = capsys.readouterr().out
    assert json.loads(out) == {"name": "\x7f\x1b\u202e"}
    assert out.isascii()
    assert "\x7f" not in out


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
@pytest.mark.filterwarnings("error")
def test_names_in_a_picture_steer_nothing(kind: str) -> None:
    """The font lacks these signs; a library that quoted them in a warning wrote them to the terminal."""
    figure = Figure()
    axes, name = figure.subplots(), "drop \x1b]0;pwned\x07 \u202e $x^ 落下"
    axes.set_title(name)
    axes.set_yticks([0.0, 0.5], [name, f"another {name}"])
    drawn = figure_file(figure, kind)
    if kind == "svg":
        assert not {"\x1b", "\x07", "\u202e"} & set(drawn.decode("utf-8"))


def test_a_warning_steers_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """As of a library that quotes a name; `main` sees to it that warnings go the way of all else that is said."""

    def warn(args: Sequence[str]) -> int:
        warnings.warn_explicit("name \x1b]0;pwned\x07", UserWarning, "library.py", 1)
        return 0

    monkeypatch.setattr(main, "run", warn)
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        with pytest.raises(SystemExit):
            main.main()
    said = capsys.readouterr().err
    assert said == "UserWarning: name \\x1b]0;pwned\\x07 (library.py, line 1)\n"


def test_escapes_in_a_table_are_spelt_out() -> None:
    assert csv_text([["a\x1b[31m", "=\x9bx"]]) == "a\\x1b[31m,'=\\x9bx\n"


@given(st.lists(st.text(st.characters(exclude_categories=["Cs"])), min_size=1, max_size=4))
def test_no_cell_is_a_formula_and_none_is_lost(row: list[str]) -> None:
    (read,) = csv.reader([csv_text([row])]) if not set("".join(row)) & set("\r\n") else [None]
    if read is None:
        return
    for cell, found in zip(row, read, strict=True):
        assert found in (harmless(cell), f"'{harmless(cell)}")
        assert not found.startswith(("=", "@", "\t")), found


@pytest.mark.parametrize("cell", ["=1+1", "@SUM(A1)", "+cmd|' /C calc'!A0", "-2+3", "\t=1", "=cmd|'/C calc'!A0"])
def test_a_formula_is_neutral(cell: str) -> None:
    assert csv_text([[cell]]).strip('"\n').startswith("'")


@pytest.mark.parametrize("cell", ["-5.25", "+1e-3", "3", "-inf", "nan", "drop 1", ""])
def test_a_number_stays(cell: str) -> None:
    assert csv_text([[cell, "x"]]) == f"{cell},x\n"


DIGITS = "9" * 5001


BARE = (DIGITS, f"0x{'f' * 5001}", f"-{DIGITS}", f"1e{DIGITS}")
QUOTED = (f'"{DIGITS} kg"', '"1e300 kg"', '"1e-300 kg"', '"1e400 kg"')
OTHER_KEYS = ("rig.masses_per_fibre", "parameters.stiffness.initial", "name")


@pytest.mark.parametrize(
    ("key", "mass"),
    [
        *(("rig.weight_mass", mass) for mass in (*BARE, *QUOTED)),
        *((key, mass) for key in OTHER_KEYS for mass in (BARE[1], QUOTED[0], QUOTED[1])),
    ],
)
def test_numbers_that_are_none_are_refused(fibrefit: Run, mass: str, key: str) -> None:
    fibrefit("init", "study")
    file = Path("study/study.toml")
    said = fibrefit("inspect", "study", "--set", f"{key}={mass}")
    assert said.code in (2, 4) or key == "name", said.err
    assert len(said.err) < 12_000
    *tables, last = key.split(".")
    lines = file.read_text("utf-8")
    header = f"[{'.'.join(tables)}]\n" if tables else ""
    known = [line for line in lines.splitlines() if line.startswith(f"{last} =")]
    changed = (
        lines.replace(known[0], f"{last} = {mass}", 1)
        if known and header in lines
        else f"{lines}\n{header}{last} = {mass}\n"
    )
    file.write_text(changed, "utf-8")
    done = fibrefit("inspect", "study")
    assert done.code in (3, 4) or (key == "name" and mass.startswith('"')), (changed[-300:], done.err)


@pytest.mark.parametrize("words", ["fit none --starts 100000000", "batch none --starts 1000000", "fit none --starts 0"])
def test_starts_beyond_memory_are_refused(fibrefit: Run, words: str) -> None:
    done = fibrefit(*words.split())
    assert done.code == 2
    assert "'--starts': " in done.err


def test_starts_beyond_memory_are_refused_in_python() -> None:
    with pytest.raises(UsageError, match="starts: 100000000; expected 1 to"):
        package.fit(package.example("drop_series"), starts=100_000_000)
    with pytest.raises(UsageError, match="starts: 0; expected 1 to"):
        package.batch(package.example("drop_series"), starts=0)
