"""Results as tables of pandas and trees of xarray, for whoever goes on in Python."""
