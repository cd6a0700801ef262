"""Laws of the sensors."""
