"""How text of any logger is built: rows, headings, cells, digits."""
