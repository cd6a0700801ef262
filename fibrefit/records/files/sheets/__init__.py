"""Workbooks: which sheet and which of its cells are the table, and what the cells hold behind what they show."""
