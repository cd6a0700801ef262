"""What the model lacks: where it parts from the measurement, which effect accounts for it, and when to say none does."""
