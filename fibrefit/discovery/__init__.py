"""What the model lacks: where it departs from the measurement, which effect accounts for it, or that none does."""
