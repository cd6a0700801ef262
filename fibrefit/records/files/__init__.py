"""One file a format: bytes to columns."""
