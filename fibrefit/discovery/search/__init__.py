"""Forward selection: set-up, rounds, cross-validation."""
