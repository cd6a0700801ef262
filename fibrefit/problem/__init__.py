"""What is read from the data: which numbers are free, what the noise is, and how far a model is from a measurement."""
