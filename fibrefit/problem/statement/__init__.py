"""The problem: layout of its numbers, observations, residuals."""
