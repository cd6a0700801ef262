"""Where there is no home, no room for caches, no display, another language; and memory that stays flat."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from fibrefit.cli.interruption import asked_to_stop
from fibrefit.cli.terminal import Terminal
from fibrefit.core import environment
from fibrefit.core.programs.bound import bound_programs

BARE = {"PATH": os.environ["PATH"], "LANG": "C", "LC_ALL": "C", "PYTHONPATH": os.pathsep.join(sys.path)}


def bare(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """The command in an environment that holds next to nothing: no home, no display, the language C."""
    return subprocess.run(
        [sys.executable, "-m", "fibrefit", *words],
        cwd=folder, env=BARE | variables, capture_output=True, text=True, errors="replace", check=False, timeout=300,
    )  # fmt: skip


def test_a_user_without_a_home_has_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert environment.cache_directory({}).name == "fibrefit"


def test_the_language_c_and_names_with_blanks_and_accents(tmp_path: Path) -> None:
    folder = tmp_path / "naïve füße\nzwei"
    folder.mkdir()
    assert bare(folder, "init", "my study é").returncode == 0
    done = bare(folder, "inspect", "my study é", "--out", "out é", FIBREFIT_CACHE="/proc/none")
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert (folder / "out é" / "inspection.json").exists()


def test_ignored_interruptions_stay_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with asked_to_stop(Terminal()) as stop:
            assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
            os.kill(os.getpid(), signal.SIGINT)
            assert not stop()
    finally:
        signal.signal(signal.SIGINT, before)


def test_compiled_programs_are_not_kept_for_ever() -> None:
    import jax
    from jax.extend.backend import get_backend

    kept = []
    for size in range(1, 7):
        kept.append(jax.jit(lambda x, size=size: x * size))
        kept[-1](float(size))
    before = len(get_backend().live_executables())
    assert before >= 6
    assert not bound_programs(before)
    assert bound_programs(before - 1)
    assert len(get_backend().live_executables()) < before - 5
    assert kept[2](2.0) == 6.0, "and each is compiled again where it is wanted"
