"""Property tests meet the same examples at every run: a test that fails must fail for whoever looks at it."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("same", derandomize=True)
settings.load_profile("same")
