"""What every result offers in Python, and results read again from disk."""
