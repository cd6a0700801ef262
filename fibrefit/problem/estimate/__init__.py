"""Estimates from whitened residuals: generalised least squares, the Hausman test."""
