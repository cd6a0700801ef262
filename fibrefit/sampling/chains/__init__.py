"""The samplers: ensembles of walkers, their checkpoints, NUTS."""
