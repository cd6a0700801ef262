"""Rigs that swing about a pivot."""
