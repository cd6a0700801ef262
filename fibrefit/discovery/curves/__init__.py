"""What a missing effect looks like when it has no name."""
