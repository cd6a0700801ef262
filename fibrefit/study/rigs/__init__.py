"""What a study says of each kind of rig, one file each: constants, records, channels, noise, base parameters."""
