"""What the records of a series say together: constant parameters, a law of speed, or values of each record's own."""
