"""Versions, cache directories and the settings JAX reads when it is imported."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fibrefit.core import environment


def test_versions_name_python_and_every_package() -> None:
    found = environment.versions()
    assert found["python"] == ".".join(map(str, sys.version_info[:3]))
    assert set(environment.PACKAGES) < set(found)
    assert found["numpy"] != "not installed"


def test_the_users_own_cache_directory_wins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIBREFIT_CACHE", "/a")
    monkeypatch.setenv("XDG_CACHE_HOME", "/b")
    assert environment.cache_directory() == Path("/a")


@pytest.mark.skipif(sys.platform == "win32", reason="XDG directories are not used on Windows")
def test_the_xdg_directory_comes_next(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FIBREFIT_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/b")
    assert environment.cache_directory() == Path("/b/fibrefit")


def test_flags_of_the_user_win() -> None:
    merged = environment.merge_xla_flags(["--one=1", "--two=2"], "--two=7 --three")
    assert merged == "--two=7 --three --one=1"


def test_merging_flags_twice_changes_nothing() -> None:
    once = environment.merge_xla_flags(["--one=1"], "")
    assert environment.merge_xla_flags(["--one=1"], once) == once


SCRIPT = """
{first}
from fibrefit.core.environment import configure_jax
configure_jax()
import jax, jax.numpy as jnp
print(jax.jit(jnp.sin)(jnp.ones(3)).dtype, jax.default_backend(), jax.config.jax_compilation_cache_dir)
"""


@pytest.mark.parametrize("first", ["", "import jax"], ids=["before", "after"])
def test_precision_device_and_cache_hold_whenever_jax_was_imported(tmp_path: Path, first: str) -> None:
    env = {k: v for k, v in os.environ.items() if not k.startswith(("JAX_", "XLA_"))} | {
        "FIBREFIT_CACHE": str(tmp_path)
    }
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(first=first)], env=env, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["float64", "cpu", str(tmp_path / "jax")]
    assert list((tmp_path / "jax").iterdir()), "the compiled program was not kept"


def test_a_cache_that_cannot_be_made_is_no_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    for name in ("JAX_COMPILATION_CACHE_DIR", "JAX_ENABLE_X64", "JAX_PLATFORMS"):
        # Set and deleted through monkeypatch, so that it puts back what configure_jax changes.
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    monkeypatch.setenv("FIBREFIT_CACHE", str(in_the_way))
    monkeypatch.delitem(sys.modules, "jax", raising=False)
    environment.configure_jax()
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ
