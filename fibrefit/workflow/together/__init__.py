"""``series``: what the records of a study say together, as the files of a result."""
