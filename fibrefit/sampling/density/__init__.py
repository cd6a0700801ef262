"""The density that is sampled: priors, kinds of noise, the likelihood, and the log posterior of both."""
