"""What each column is, and what is damaged in it."""
