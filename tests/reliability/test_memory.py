"""Memory of a worker that goes through one item after the other."""

from __future__ import annotations

from pathlib import Path

import psutil
import pytest

from fibrefit.core import programs

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
CYCLES, SETTLED = 6, 2
MOST_GROWTH = 10.0
"""MB a cycle of three items, beyond the first ones: 1 was seen, and 25 where what is forgotten is not given back."""


@pytest.mark.slow
@pytest.mark.parametrize("forgets", [True, False])
def test_a_worker_stays_flat(forgets: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether programs are forgotten between items, as they are once there are many, or kept, as they are while few."""
    from fibrefit.workflow.batches.item import identified
    from fibrefit.workflow.batches.jobs import jobs_of, origins_of

    jobs = jobs_of(origins_of([str(SERIES)], None, ()), "record", 1, 0)[:3]
    memory = []
    for _ in range(CYCLES):
        for job in jobs:
            identified(job)
            if forgets:
                monkeypatch.setattr(programs, "MOST_PROGRAMS", 0)
                assert programs.bound_programs()
        memory.append(psutil.Process().memory_info().rss / 1e6)
    growth = (memory[-1] - memory[SETTLED - 1]) / (CYCLES - SETTLED)
    how = "forgotten after each" if forgets else "kept"
    print(f"\nprograms {how}: {', '.join(f'{size:.0f}' for size in memory)} MB, {growth:.1f} MB a cycle")
    assert growth < MOST_GROWTH
