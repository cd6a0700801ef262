"""Saved results again: as one page, and as figures."""
