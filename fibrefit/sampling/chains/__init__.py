"""Ensembles of walkers, and their checkpoints."""
