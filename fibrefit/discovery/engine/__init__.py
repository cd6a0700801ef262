"""Candidates, the supermodel that holds them, their refits and what decides."""
