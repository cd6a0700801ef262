"""The phases of a rig's motion: their names, and which of them mean what."""

from __future__ import annotations

PHASES = (
    "held",
    "slack",
    "taut, loading",
    "taut, unloading",
    "at rest",
    "moving forwards",
    "moving back",
    "sticking",
)
HELD, SLACK, LOADING, UNLOADING, REST, FORWARDS, BACK, STICKING = range(len(PHASES))
TAUT = (LOADING, UNLOADING, REST, STICKING)
"""Phases in which a fibre carries load, on a rig that has one."""
