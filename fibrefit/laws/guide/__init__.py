"""Laws of the guide."""
