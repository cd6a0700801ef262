"""What was understood of files: how each is read, what it says, and a study made of it."""
