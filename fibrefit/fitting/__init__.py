"""Least squares: the estimate, how sure it is, and whether to believe it."""
