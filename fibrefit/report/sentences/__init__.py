"""What checks found, in sentences: numerics tell numbers and identifiers."""
