"""Starting values of the rigs whose own file would be too long with them."""
