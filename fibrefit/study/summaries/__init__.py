"""What programs read of a result: one schema a kind."""
