"""Every number that decides whether a motion is one that a law can be held against, with its meaning."""

from __future__ import annotations

MOVES = 0.05
"""Share of the largest speed from which a weight slides."""
MOSTLY_SLIDES = 0.8
"""Share of a stretch in which a weight slides: where it is held, friction is anything up to its level."""
FEWEST_STRETCHES = 6
"""Stretches of a record that tell how surely they agree: more than there are sizes."""
STANDS = 0.02
"""Share of the largest speed below which a mass is taken to stand: friction is then anything up to its level."""
FEWEST_MOVING = 32
"""Samples in motion that a record must hold whose motion leads a model."""
