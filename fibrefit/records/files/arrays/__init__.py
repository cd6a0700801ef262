"""Arrays that are called something in a file: their names and units, stamps among them, lists of them."""
