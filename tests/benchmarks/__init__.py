"""How fast the simulator, its Jacobian and a fit are, beside other ways to do the same, all timed in one run."""
