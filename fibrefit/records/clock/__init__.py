"""When each sample was taken."""
