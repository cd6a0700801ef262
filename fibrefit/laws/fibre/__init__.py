"""Laws of the fibre."""
