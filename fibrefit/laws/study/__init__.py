"""Errors in what a study states of its rig and records."""
