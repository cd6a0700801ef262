"""Noise: its spectrum, its choice, and the whitening that follows from it."""
