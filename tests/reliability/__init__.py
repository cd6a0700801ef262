"""What must not be lost and what must not come in, done for real."""
