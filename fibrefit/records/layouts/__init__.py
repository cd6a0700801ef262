"""Layouts of their own, brought to that of a table with a line of headings, or refused with what makes one of them."""
