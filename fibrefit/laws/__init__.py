"""Constitutive laws that may be added to a base model, one a file, and the catalogue of them."""
