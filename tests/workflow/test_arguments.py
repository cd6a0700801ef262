"""Arguments of the functions a program calls: what no command line lets through is refused before any work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fibrefit
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import LARGEST_SEED
from fibrefit.workflow.design.plan import Aim

SERIES = fibrefit.example("drop_series")
WRONG: dict[str, tuple[Callable[[Path], Any], str]] = {
    "each": (
        lambda out: fibrefit.batch(SERIES, out, each="studies"),  # type: ignore[arg-type]
        'each: "studies"; expected one of record, study. Did you mean "study"?',
    ),
    "shard beyond": (
        lambda out: fibrefit.batch(SERIES, out, shard=(5, 3)),
        "--shard 5/3: not a part of a whole; expected i/n with i from 1 to n. For example --shard 3/20.",
    ),
    "shard from nought": (
        lambda out: fibrefit.batch(SERIES, out, shard=(0, 3)),
        "--shard 0/3: not a part of a whole; expected i/n with i from 1 to n. For example --shard 3/20.",
    ),
    "noise": (
        lambda out: fibrefit.sample(SERIES, noise="colored"),
        'noise: "colored"; expected one of fit, auto, white, autoregressive, coloured. Did you mean "coloured"?',
    ),
    "purpose": (
        lambda out: Aim(purpose="error"),  # type: ignore[arg-type]
        'purpose: "error"; expected one of errors, rivals, power. Did you mean "errors"?',
    ),
    "batch of nothing": (
        lambda out: fibrefit.batch([], out),
        "series: nothing; expected a study, or records. If a pattern was to name them, nothing matches it.",
    ),
    "batch of no records": (
        lambda out: fibrefit.batch([], out, rig="fibre_mass"),
        "series: nothing; expected a study, or records. If a pattern was to name them, nothing matches it.",
    ),
    "batch of no match": (
        lambda out: fibrefit.batch(SERIES.glob("*.no"), out),
        "series: nothing; expected a study, or records. If a pattern was to name them, nothing matches it.",
    ),
    "inspection of nothing": (
        lambda out: fibrefit.inspect([]),
        "files: nothing; expected a study, or records. If a pattern was to name them, nothing matches it.",
    ),
    "inspection of no match": (
        lambda out: fibrefit.inspect(SERIES.glob("*.no")),
        "files: nothing; expected a study, or records. If a pattern was to name them, nothing matches it.",
    ),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_an_argument_that_makes_no_sense_is_refused_before_any_work(wrong: str, tmp_path: Path) -> None:
    call, message = WRONG[wrong]
    with pytest.raises(UsageError) as refused:
        call(tmp_path / "out")
    assert str(refused.value) == message
    assert not list(tmp_path.iterdir()), "nothing is made"


@pytest.mark.parametrize("seed", [-1, LARGEST_SEED + 1])
@pytest.mark.parametrize(
    "command", [fibrefit.fit, fibrefit.discover, fibrefit.series_of, fibrefit.batch, fibrefit.sample]
)
def test_a_seed_that_no_result_can_keep_is_refused_by_every_command(command: Callable[..., Any], seed: int) -> None:
    with pytest.raises(UsageError) as refused:
        command(SERIES, seed=seed)
    assert str(refused.value) == f"seed: {seed}; expected 0 to {LARGEST_SEED}."


def test_files_may_come_from_a_pattern() -> None:
    seen = fibrefit.inspect(SERIES.glob("drop_5mm*.csv"))
    assert [one.verdict for one in seen.seen] == ["understood"]
