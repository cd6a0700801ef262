"""Measured inputs: smoothing, errors in variables, weights of the linearisation."""
