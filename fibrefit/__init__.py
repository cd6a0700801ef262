"""Identify mechanical models of fibres, cables and their rigs from measured records."""

from fibrefit.core.environment import configure_jax as _configure_jax

# JAX reads these settings once; every module of the package is imported after this line.
_configure_jax()
