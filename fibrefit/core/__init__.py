"""Words every other floor speaks: errors, units, parameters, checks."""
