"""Figures: measured against simulated, the search, the uncertainty of the values."""
