"""``fibrefit confuse``: the earlier name of ``fibrefit distinguish``."""

from __future__ import annotations

from fibrefit.cli.distinguish import command

__all__ = ["command"]
