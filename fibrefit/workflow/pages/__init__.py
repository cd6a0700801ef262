"""Saved results again, as one page and as figures; and what has to be saved for that."""
