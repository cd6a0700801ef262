"""``predict``: values that were found, on records they were not found from."""
