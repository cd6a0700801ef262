"""Number on which it hangs whether innovations of a record are tested."""

FEWEST_TELLING = 6.0
"""Degrees of freedom of the scatter of a record's scores below which it is not tested for constancy and drift: those of
eighteen readings of normal noise that tell one parameter alike, of thirty that tell three."""
