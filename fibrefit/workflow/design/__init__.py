"""What records can show, and which to take next."""
