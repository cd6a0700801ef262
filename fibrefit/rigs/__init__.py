"""Geometry and equations of motion of the rigs; the laws they are given stay their own affair."""
