"""Many runs of one model: sweeps over what is set, and what they show together."""
