"""Priors and the log posterior density."""
