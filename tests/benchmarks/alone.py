"""``python -m tests.benchmarks.alone``: one fit of the drop series in a process of its own, from reading to values."""

from __future__ import annotations

from tests.benchmarks.ours import fit
from tests.benchmarks.problem import drop_task

if __name__ == "__main__":
    print(*fit(drop_task()))
