"""The posterior: independent ensembles on the log posterior density, and whether to believe them."""
