"""Laws of the pulley."""
