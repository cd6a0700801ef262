"""The frame of all commands: help, exit codes, misspelt words, faults, interruptions."""

from __future__ import annotations

import errno
import gc
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fibrefit.cli import results
from fibrefit.cli.main import AGAIN, AT_FIRST, COMMANDS, look_for_garbage_late, with_files
from fibrefit.cli.terminal import first_missing
from fibrefit.core.errors import DataError, StudyError, UsageError, as_one
from fibrefit.store.directory import ResultDirectory
from tests.cli.conftest import Run

#: Most that ``--help`` may take, in times of a bare interpreter: it takes 6, and NumPy alone would add 12.
HELP_TIME = 15.0


@pytest.mark.skipif(os.name == "nt", reason="the processor time of other processes is not told there")
def test_help_is_quick() -> None:
    import resource

    def timed(*words: str) -> float:
        """Processor time, which on a free machine is all the time there is, and which busy neighbours leave alone."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    bare, helped = (min(timed(*words) for _ in range(3)) for words in (("-c", ""), ("-m", "fibrefit", "--help")))
    assert helped < HELP_TIME * bare


def test_garbage_is_looked_for_late_once_and_then_as_often_as_ever() -> None:
    gc.collect(0)  # what other tests have put off is over
    usual, before = gc.get_threshold(), list(gc.callbacks)
    try:
        look_for_garbage_late()
        assert gc.get_threshold()[0] == AT_FIRST > 4 * AGAIN
        gc.collect(0)
        assert gc.get_threshold()[0] == AGAIN
        assert gc.callbacks == before
    finally:
        gc.set_threshold(*usual)


def test_help_imports_nothing_heavy() -> None:
    code = "import sys; from fibrefit.cli.main import run; run(['--help']); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not {"jax", "numpy", "pandas", "pydantic", "matplotlib", "pint", "rich", "h5py"} & set(done.stderr.split())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(fibrefit: Run, command: str) -> None:
    assert command in fibrefit("--help").out
    done = fibrefit(command, "--help")
    assert done.code == 0
    for option in ("--json", "--quiet", "--verbose"):
        assert option in done.out


def test_confuse_is_the_earlier_name_of_distinguish(fibrefit: Run) -> None:
    old, new = (fibrefit(name, "--help").out for name in ("confuse", "distinguish"))
    assert old.replace("fibrefit confuse", "fibrefit distinguish") == new
    assert "distinguish" in new


def test_the_version(fibrefit: Run) -> None:
    done = fibrefit("--version")
    assert done.code == 0
    assert re.fullmatch(r"fibrefit \d+\.\d+\.\d+\n", done.out)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("shwo", "x"), 'No command "shwo". Did you mean "show"?'),
        (("zzz",), f'No command "zzz". There are {", ".join(COMMANDS)}.'),
        (("show", "--jsn", "x"), "Did you mean '--json'?"),
        (("--vresion",), "--version"),
        (("show",), "Missing argument"),
        (("show", "a", "b"), "unexpected extra argument"),
        ((), "Usage: fibrefit"),
    ],
)
def test_what_cannot_be_carried_out_exits_with_2(fibrefit: Run, words: tuple[str, ...], says: str) -> None:
    done = fibrefit(*words)
    assert done.code == 2
    assert says in done.err
    assert not done.out


def failing(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def raises(*args: object, **options: object) -> None:
        raise error

    monkeypatch.setattr(results.show_command, "callback", raises)


@pytest.mark.parametrize(("error", "code"), [(UsageError, 2), (DataError, 3), (StudyError, 4)])
def test_a_mistake_is_explained_without_a_traceback(
    fibrefit: Run, monkeypatch: pytest.MonkeyPatch, error: type[Exception], code: int
) -> None:
    failing(monkeypatch, error("a.csv", "no time", "a column", "Name it."))
    done = fibrefit("show", "x")
    assert (done.code, done.out) == (code, "")
    assert done.err == "error: a.csv: no time; expected a column. Name it.\n"
    document = fibrefit("show", "x", "--json").document
    assert document["exit_code"] == code
    assert document["error"]["where"] == "a.csv"
    assert document["error"]["do"] == "Name it."


def test_too_little_memory_is_no_fault_of_the_program(fibrefit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, MemoryError())
    done = fibrefit("show", "x")
    assert done.code == 2
    assert done.err.startswith(
        "error: memory: is not enough, or limited to less than this takes; expected some gigabytes."
    )


@pytest.mark.parametrize("verbose", [False, True])
def test_a_fault_of_the_program_is_one_line_and_a_log(
    fibrefit: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, verbose: bool
) -> None:
    failing(monkeypatch, ZeroDivisionError("oh\nno"))
    done = fibrefit("show", "x", *(["-v"] if verbose else []))
    assert done.code == 1
    assert done.err.startswith("fault in the program: ZeroDivisionError: oh The traceback is in ")
    assert ("Traceback" in done.err) is verbose
    (log,) = (tmp_path / "cache" / "logs").iterdir()
    assert str(log) in done.err
    text = log.read_text()
    assert "Traceback" in text
    assert "fibrefit show x" in text
    assert "numpy" in text


def test_a_fault_whose_log_cannot_be_written_shows_the_traceback(
    fibrefit: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    failing(monkeypatch, ZeroDivisionError("oh"))
    (tmp_path / "cache").write_text("in the way")
    done = fibrefit("show", "x")
    assert done.code == 1
    assert "Traceback" in done.err


def test_a_fault_in_a_folder_that_is_gone_is_told_all_the_same(
    fibrefit: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    failing(monkeypatch, ZeroDivisionError("oh"))
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    done = fibrefit("show", "x")
    assert done.code == 1
    assert done.err.startswith("fault in the program: ZeroDivisionError: oh\n")


def test_what_may_not_be_used_is_told_without_a_traceback(fibrefit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, PermissionError(errno.EACCES, "Permission denied", "locked/page.html"))
    done = fibrefit("show", "x")
    assert done.code == 2
    assert done.err.strip() == (
        "error: locked/page.html: Permission denied; expected a file or folder that you may use. "
        "Look at its permissions."
    )


def test_an_interruption_exits_with_130(fibrefit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, KeyboardInterrupt())
    done = fibrefit("show", "x")
    assert done.code == 130
    assert done.err.strip() == "Interrupted. Nothing was written."


def test_an_interruption_says_what_is_kept(fibrefit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*args: object, **options: object) -> None:
        with ResultDirectory(Path("out"), keep=True) as result:
            (result.path / "chain.h5").write_text("half")
            raise KeyboardInterrupt

    monkeypatch.setattr(results.show_command, "callback", interrupted)
    done = fibrefit("show", "x", "--json")
    assert done.code == 130
    assert "kept in out.partial; --resume goes on" in done.err
    assert done.document["exit_code"] == 130
    assert Path("out.partial/chain.h5").exists()


def test_a_terminal_that_lacks_letters_does_not_stop_it(tmp_path: Path) -> None:
    env = {**os.environ, "PYTHONIOENCODING": "cp1252"}
    done = subprocess.run(
        [sys.executable, "-m", "fibrefit", "show", "ρ-čárka"], cwd=tmp_path, env=env, capture_output=True, check=False
    )
    assert done.returncode == 3
    assert b"error: ?-?\xe1rka: no such file" in done.stderr


@pytest.mark.skipif(os.name == "nt", reason="pipes break otherwise there")
def test_a_reader_that_stops_reading_does_no_harm() -> None:
    code = "import os, sys; os.close(0); from fibrefit.cli.main import main; sys.argv[1:] = ['--help']; main()"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    process.wait()
    assert b"Traceback" not in errors


@pytest.mark.parametrize(
    "words", [("fit", "nosuch.csv"), ("discover", "no/such"), ("fit", "nosuch.csv", "--rig", "fibre_mass")]
)
def test_a_path_that_leads_nowhere_is_told_first(fibrefit: Run, words: tuple[str, ...]) -> None:
    done = fibrefit(*words)
    assert done.code == 2
    assert done.err.strip() == (
        f"error: {words[1]}: no such file or folder; expected a study, or records. Check the path."
    )


LONG = "a" * 300
"""More letters than the name of a file has anywhere."""


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("show", LONG), 3, "expected a result with its summary.json"),
        (("fit", f"{LONG}.csv", "--rig", "fibre_mass"), 2, "no such file or folder; expected a study, or records"),
        (("fit", f"{LONG}.toml"), 4, "expected a study file"),
        (("fit", "demo", "--out", LONG), 2, "cannot be written: File name too long; expected a folder to write to"),
        (("fit", "demo", "--out", "b" * 249), 2, "cannot be written: File name too long"),
        (("init", LONG), 2, "expected a folder to write to"),
        (("batch", LONG, "--out", "out"), 2, "is longer than the names of files may be"),
        (("report", "demo", "--out", LONG), 2, "is longer than the names of files may be"),
    ],
)
@pytest.mark.skipif(os.name == "nt", reason="names are longer there")
def test_a_name_that_no_file_can_have_is_a_mistake_of_the_command_line(
    fibrefit: Run, words: tuple[str, ...], code: int, says: str
) -> None:
    assert fibrefit("init", "demo").code == 0
    done = fibrefit(*words)
    assert "fault in the program" not in done.err
    assert (done.code, done.out) == (code, "")
    assert says in done.err


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="nothing is out of reach there")
def test_what_lies_out_of_reach_is_no_fault_of_the_program(fibrefit: Run) -> None:
    Path("shut").mkdir(mode=0o000)
    assert fibrefit("show", "shut").code == 3
    assert fibrefit("fit", "shut/a.csv", "--rig", "fibre_mass").code == 2
    Path("s.toml").write_text('schema = "fibrefit/study/1"\nname = "x"\n[rig]\nkind = "fibre_mass"\n')
    records, rig = 'records=[{file = "shut/a.csv"}]', ("rig.weight_mass=3 kg", "rig.inclination=90 deg")
    done = fibrefit("fit", "s.toml", *(word for said in (records, *rig) for word in ("--set", said)))
    assert done.code == 4
    assert "cannot be reached" in done.err


def test_a_folder_that_cannot_be_made_is_missing() -> None:
    assert first_missing(Path(LONG, "figures")) == Path(LONG)


def test_the_figures_that_a_run_draws_are_told_as_they_are(fibrefit: Run) -> None:
    assert "none. [default: png, of a fit its overview alone]" in " ".join(fibrefit("fit", "--help").out.split())


def test_patterns_name_files_where_the_shell_leaves_them_to_the_program(fibrefit: Run) -> None:
    for name in ("drop_2.csv", "drop_1.csv", "a[1].csv", "a1.csv"):
        Path(name).touch()
    words = ["fit", "drop_*.csv", "a[1].csv", "none_*.csv", "--set", 'files.columns=["time [s]"]']
    assert with_files(words) == ["fit", "drop_1.csv", "drop_2.csv", *words[2:]]


def test_a_missing_file_of_a_command_line_suggests_its_neighbour(fibrefit: Run) -> None:
    Path("Fall 20mm.csv").touch()
    for words in (("fit", "Fall 20m.csv", "--rig", "fibre_mass"), ("batch", "Fall 20m.csv")):
        done = fibrefit(*words)
        assert (done.code, done.err) == (
            2,
            "error: Fall 20m.csv: no such file or folder; expected a study, or records. "
            'Did you mean "Fall 20mm.csv"?\n',
        )


def test_every_mistake_of_several_is_told_to_programs_too(fibrefit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    errors = [StudyError("s.toml", f"mistake {i}") for i in range(3)]
    failing(monkeypatch, as_one(errors, "s.toml"))
    done = fibrefit("show", "x")
    assert done.err == "error: s.toml: mistake 0.\ns.toml: mistake 1.\ns.toml: mistake 2.\n"
    error = fibrefit("show", "x", "--json").document["error"]
    assert [each["got"] for each in (error, *error["further"])] == [f"mistake {i}" for i in range(3)]


def test_it_is_the_traceback_that_more_words_are_for(fibrefit: Run) -> None:
    assert "Show the traceback of a fault." in " ".join(fibrefit("show", "--help").out.split())
