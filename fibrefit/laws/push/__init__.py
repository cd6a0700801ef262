"""Laws between a measured force and the mass it pushes, one file each."""
