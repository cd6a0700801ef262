"""Results for people: the text of the terminal."""
