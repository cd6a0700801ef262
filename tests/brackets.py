"""A threshold is what it is: a verdict that turns between two numbers on either side of it, and would not were it twice
or half as large."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import pytest


@dataclass(frozen=True)
class Bracket:
    """A threshold, the module that compares with it, and the verdict on a number.

    Parameters
    ----------
    name : str
    module : module
    passes : callable
        Verdict on a number.
    inside, outside : float
        Numbers that pass and that do not, nearer to the threshold than a factor of two.
    """

    name: str
    module: ModuleType
    passes: Callable[[float], bool]
    inside: float
    outside: float

    def holds(self) -> bool:
        """Whether the verdict turns between the two."""
        return bool(self.passes(self.inside)) and not self.passes(self.outside)

    def test(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Assert that it turns there, and no longer with twice or half the threshold."""
        assert self.holds(), self.name
        known = getattr(self.module, self.name)
        # Half of an even number of things is one too: what counts by it goes on doing so.
        for changed in (2 * known, known // 2 if isinstance(known, int) and known % 2 == 0 else known / 2):
            with monkeypatch.context() as patched:
                patched.setattr(self.module, self.name, changed)
                assert not self.holds(), f"{self.name} = {changed:g} would go unnoticed"


def thresholds(module: ModuleType) -> set[str]:
    """Names of all numbers of a file of thresholds."""
    return {name for name, value in vars(module).items() if isinstance(value, int | float) and name.isupper()}
