"""Where the posterior is highest, and how wide it is there."""
