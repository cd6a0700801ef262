"""What the model lacks: where it parts from the measurement, which effect accounts for it, or that none does."""
