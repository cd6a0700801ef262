"""Where there is no home, no room for caches, no display, another language; as a job of a queue; with other threads."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from fibrefit.cli.terminal import Terminal, stop_requested
from fibrefit.core import environment, programs

ROOT = Path(__file__).resolve().parents[2]
SERIES = ROOT / "configs" / "drop_series"
ODD = "naïve füße\nzwei"
"""A name with a blank, letters beyond ASCII and the end of a line."""
BARE = {"PATH": os.environ["PATH"], "LANG": "C", "LC_ALL": "C", "PYTHONPATH": os.pathsep.join(sys.path)}
NOBODY = ("unshare", "--user", "--map-user=12345", "--map-group=12345")
"""A user whom the system does not know, who has no home, and to whom permissions apply."""
LONGEST = 600.0


def bare(folder: Path, *words: str, prefix: tuple[str, ...] = (), **variables: str) -> subprocess.CompletedProcess[str]:
    """The command in an environment that holds next to nothing: no home, no display, the language C."""
    return subprocess.run(
        [*prefix, sys.executable, "-m", "fibrefit", *words], cwd=folder, env=BARE | variables,
        capture_output=True, text=True, errors="replace", check=False, timeout=LONGEST,
    )  # fmt: skip


def clean(done: subprocess.CompletedProcess[str], code: int = 0) -> None:
    """It ended as it should, and nothing on stderr is about the environment."""
    assert done.returncode == code, done.stderr
    assert not {"Traceback", "Warning", "warning", "Error"} & set(done.stderr.replace(":", " ").split()), done.stderr


def told(out: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """All a result holds, but for when and how long it was made."""
    summary = json.loads((out / "summary.json").read_text())
    summary.pop("provenance")
    arrays: dict[str, np.ndarray] = {}

    def keep(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("provenance"):
            arrays[name] = item[()]

    with h5py.File(out / "result.h5") as file:
        file.visititems(keep)
    return summary, arrays


def test_a_user_without_a_home_has_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    for name in ("FIBREFIT_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    folder = environment.cache_directory()
    assert folder.name == f"fibrefit-{os.getuid()}"
    assert folder.parent == Path(tempfile.gettempdir()), "nobody else can put a folder of theirs in its place there"
    monkeypatch.setattr(Path, "expanduser", lambda path: homeless())
    monkeypatch.setenv("FIBREFIT_CACHE", "~/x")
    assert environment.cache_directory() == folder


@pytest.mark.parametrize(
    "whose",
    ["ours", "among temporary files", "written by all", "written by all above", "of another", "of another above"],
)
def test_programs_are_taken_from_a_folder_of_our_own_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whose: str
) -> None:
    """They are code that is run; a folder among temporary files can have been made by anybody."""
    monkeypatch.setenv("FIBREFIT_CACHE", str(tmp_path / "cache"))
    folder = environment.own_folder("programs")
    assert folder == tmp_path / "cache" / "programs"
    assert (folder.stat().st_mode | folder.parent.stat().st_mode) & 0o077 == 0
    if whose == "among temporary files":
        folder.parent.chmod(0o1777)
    elif whose.startswith("written"):
        (folder.parent if whose.endswith("above") else folder).chmod(0o777)
    elif whose.startswith("of another"):
        if os.getuid():
            pytest.skip("only root can give a folder away")
        os.chown(folder.parent if whose.endswith("above") else folder, 12345, -1)
    assert (environment.own_folder("programs") == folder) == (whose in ("ours", "among temporary files"))


STREAMS = {"stdin": "<&-", "stdout": ">&-", "stderr": "2>&-"}


ONE_OR_ALL = [("stdin",), ("stdout",), ("stderr",), tuple(STREAMS)]
CLOSED = [(closed, words) for words in ("--help", "fit none --json") for closed in ONE_OR_ALL]


@pytest.mark.parametrize(
    ("closed", "words"),
    [*CLOSED, (("stdout",), "inspect series"), (tuple(STREAMS), "inspect series --json")],
    ids=lambda one: one if isinstance(one, str) else " ".join(one),
)
def test_streams_that_were_closed_before_the_start(
    tmp_path: Path, series: Path, closed: tuple[str, ...], words: str
) -> None:
    """As by a scheduler: the next file that is opened would get their numbers, and what is said would go there."""
    script = f"exec '{sys.executable}' -m fibrefit {words} {' '.join(STREAMS[name] for name in closed)}"
    done = subprocess.run(["sh", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr, done.stderr
    assert "Exception ignored" not in done.stderr, done.stderr
    assert done.returncode in ((2,) if "stdout" in closed or "none" in words else (0,)), done.stderr
    if closed == ("stdout",) and "none" not in words:
        assert "cannot be written" in done.stderr


def test_a_working_folder_that_is_gone_is_told(tmp_path: Path, series: Path) -> None:
    script = (
        f"mkdir gone && cd gone && rmdir ../gone && exec '{sys.executable}' -m fibrefit simulate '{series}' --out out"
    )
    done = subprocess.run(["sh", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "the working folder: has been removed" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_language_c_and_names_with_blanks_and_accents(tmp_path: Path) -> None:
    folder = tmp_path / ODD
    folder.mkdir()
    assert bare(folder, "init", "my study é").returncode == 0
    done = bare(folder, "inspect", "my study é", "--out", "out é", FIBREFIT_CACHE="/proc/none")
    clean(done)
    assert (folder / "out é" / "inspection.json").exists()


@pytest.fixture
def nobody() -> tuple[str, ...]:
    if (
        shutil.which("unshare") is None
        or subprocess.run([*NOBODY, "true"], check=False, capture_output=True).returncode
    ):
        pytest.skip("the system lets nobody make a user")
    return NOBODY


@pytest.fixture
def series(tmp_path: Path) -> Path:
    return Path(shutil.copytree(SERIES, tmp_path / "series"))


FIT = ("fit", "series", "--starts", "4", "--out", "out")
HEADLESS = (
    {},
    {"MPLBACKEND": "TkAgg"},
    {"MPLBACKEND": "module://none.such"},
    {"DISPLAY": ":77", "MPLBACKEND": "qtagg"},
)


@pytest.mark.slow
@pytest.mark.parametrize("variables", HEADLESS, ids=str)
def test_without_a_display(tmp_path: Path, series: Path, variables: dict[str, str]) -> None:
    clean(bare(tmp_path, *FIT, **variables))
    assert list((tmp_path / "out" / "figures").rglob("*.png"))


@pytest.mark.slow
@pytest.mark.parametrize("language", ["C", "POSIX", "de_DE.ISO-8859-1", "none_NONE.utf8", "tr_TR.UTF-8"])
def test_whatever_the_language(tmp_path: Path, series: Path, language: str) -> None:
    clean(bare(tmp_path, *FIT, "--figures", "none", LANG=language, LC_ALL=language, PYTHONUTF8="0"))


@pytest.mark.slow
def test_without_a_home_and_with_caches_that_cannot_be_written(
    tmp_path: Path, series: Path, nobody: tuple[str, ...]
) -> None:
    """Nothing to read from, nothing to write to: neither our caches nor those of libraries."""
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o555)
    assert subprocess.run([*nobody, "touch", str(closed / "x")], check=False, capture_output=True).returncode != 0
    for number, variables in enumerate(({}, {"FIBREFIT_CACHE": str(closed), "HOME": str(closed)}, {"TMPDIR": "/none"})):
        out = f"out {number}"
        clean(bare(tmp_path, *FIT[:-1], out, prefix=nobody, **variables))
        assert list((tmp_path / out / "figures").rglob("*.png"))
    assert not list(closed.iterdir())


@pytest.mark.slow
def test_an_installation_that_cannot_be_written(tmp_path: Path, series: Path, nobody: tuple[str, ...]) -> None:
    site = tmp_path / "site"
    shutil.copytree(ROOT / "fibrefit", site / "fibrefit", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "configs", site / "configs")
    before = {path: path.stat().st_mtime_ns for path in site.rglob("*")}
    for path in (site, *before):
        path.chmod(0o555 if path.is_dir() else 0o444)
    path = os.pathsep.join([str(site), *(entry for entry in sys.path if entry != str(ROOT))])
    try:
        denied = subprocess.run([*nobody, "touch", str(site / "x")], check=False, capture_output=True)
        assert denied.returncode != 0
        done = bare(tmp_path, *FIT, prefix=nobody, PYTHONPATH=path, FIBREFIT_CACHE=str(tmp_path / "cache"))
        clean(done)
        shown = bare(tmp_path, "init", "study", prefix=nobody, PYTHONPATH=path)
        clean(shown)
        assert {path: path.stat().st_mtime_ns for path in site.rglob("*")} == before
    finally:
        for folder in (site, *(path for path in before if path.is_dir())):
            folder.chmod(0o755)


@pytest.mark.slow
def test_names_with_blanks_accents_and_ends_of_lines(tmp_path: Path) -> None:
    folder = tmp_path / ODD
    shutil.copytree(SERIES, folder / ODD)
    record = "drop_10mm_90deg.csv"
    (folder / ODD / record).rename(folder / ODD / "fall é, 10 mm.csv")
    study = folder / ODD / "study.toml"
    study.write_text(study.read_text("utf-8").replace(record, "fall é, 10 mm.csv"), "utf-8")
    clean(bare(folder, "fit", ODD, "--starts", "2", "--out", f"out {ODD}"))
    clean(bare(folder, "batch", ODD, "--starts", "2", "--jobs", "2", "--out", f"batch {ODD}"))
    # Of records that were fitted nothing is predicted, and the command says so by its code.
    clean(bare(folder, "predict", f"out {ODD}", ODD, "--out", f"predicted {ODD}"), code=5)
    assert (folder / f"predicted {ODD}" / "summary.json").exists()
    clean(bare(folder, "report", f"out {ODD}", f"batch {ODD}", "--out", f"page {ODD}.html"))
    assert "fall é, 10 mm" in (folder / f"out {ODD}" / "summary.json").read_text("utf-8")


THREADS = """
import os, sys
number = int(sys.argv.pop(1))
os.cpu_count = lambda: number
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:number])
from fibrefit.cli.main import main
main()
"""
NUMBERS = ("NPROC", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("fit",),
        ("sample", "--max-steps", "60", "--ess", "1e9", "--ensembles", "4"),
        ("discover", "--only", "guide.viscous_friction", "--only", "fibre.hardening"),
    ],
    ids=lambda words: words[0],
)
def test_one_thread_and_eight_give_the_same_bits(tmp_path: Path, series: Path, words: tuple[str, ...]) -> None:
    for number in (1, 8):
        counts = dict.fromkeys(NUMBERS, str(number))
        command = [sys.executable, "-c", THREADS, str(number), words[0], "series", *words[1:]]
        done = subprocess.run(
            [*command, "--figures", "none", "--out", f"out{number}"], cwd=tmp_path, env=os.environ | counts,
            capture_output=True, text=True, check=False, timeout=LONGEST,
        )  # fmt: skip
        assert done.returncode in (0, 5), done.stderr
    (one, arrays), (eight, its_arrays) = told(tmp_path / "out1"), told(tmp_path / "out8")
    assert eight == one
    assert its_arrays.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(its_arrays[name], array, name)


def test_ignored_interruptions_stay_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with stop_requested(Terminal()) as stop:
            assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
            os.kill(os.getpid(), signal.SIGINT)
            assert not stop()
    finally:
        signal.signal(signal.SIGINT, before)


def _heard() -> None:
    """Signals count again: this test may itself run behind a job script that ignores them."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def under_fire(folder: Path, script: str, out: Path) -> int:
    """Exit code of a shell script of which all processes get SIGINT and SIGHUP once it computes, again and again."""
    process = subprocess.Popen(
        ["sh", "-c", script], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        preexec_fn=_heard,
    )  # fmt: skip
    lock = out.with_name(f".{out.name}.lock")
    began = time.monotonic()
    while not lock.exists() and process.poll() is None:
        assert time.monotonic() - began < LONGEST
        time.sleep(0.02)
    while process.poll() is None and time.monotonic() - began < LONGEST:
        for number in (signal.SIGINT, signal.SIGHUP):
            os.killpg(process.pid, number)
        time.sleep(0.3)
    return process.wait(timeout=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("words", ["fit series --starts 2", "batch series --starts 2 --jobs 2"])
def test_a_job_that_ignores_signals_goes_on(tmp_path: Path, series: Path, words: str) -> None:
    """As under nohup, or behind a job script's `trap`; without that the same signals end it."""
    command = f"'{sys.executable}' -m fibrefit {words} --figures none --out"
    assert under_fire(tmp_path, f"trap '' INT HUP; {command} out", tmp_path / "out") == 0
    assert (tmp_path / "out" / "summary.json").exists()
    assert under_fire(tmp_path, f"exec {command} ended", tmp_path / "ended") != 0
    assert not (tmp_path / "ended" / "summary.json").exists()


def test_compiled_programs_are_not_kept_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    import jax
    from jax.extend.backend import get_backend

    kept = []
    for size in range(1, 7):
        kept.append(jax.jit(lambda x, size=size: x * size))
        kept[-1](float(size))
    before = len(get_backend().live_executables())
    assert before >= 6
    monkeypatch.setattr(programs, "MOST_PROGRAMS", before)
    assert not programs.bound_programs()
    monkeypatch.setattr(programs, "MOST_PROGRAMS", before - 1)
    assert programs.bound_programs()
    assert len(get_backend().live_executables()) < before - 5
    assert kept[2](2.0) == 6.0, "and each is compiled again where it is wanted"
