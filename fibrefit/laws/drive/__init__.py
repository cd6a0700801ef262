"""Laws of the drive."""
