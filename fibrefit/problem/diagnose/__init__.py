"""What a rig is doing at each sample, and what inverse dynamics says of the force."""
