"""Every number that decides the verdict on a posterior, with its meaning and where it comes from.

How far chains are run besides is in `sampling.settings`, after Vehtari, Gelman, Simpson, Carpenter and Buerkner,
Bayesian Analysis 16 (2021); how large residuals may be, in `problem.thresholds`.
"""

from __future__ import annotations

HOPELESS_R_HAT = 1.1
"""R-hat beyond which draws are of no use: the limit that was usual before 1.01 (Gelman and Rubin, Statistical Science 7
(1992))."""
HOPELESS_ESS = 50.0
"""Effective sample size below which means are uncertain by a seventh of a standard deviation."""
STUCK = 0.02
"""Acceptance below which a walker counts as stuck: a tenth of the lowest that is usual (Foreman-Mackey et al., Publ.
Astron. Soc. Pac. 125 (2013))."""
OVERLOOKED = 0.01
"""Share of a posterior that must not be overlooked: weight of other modes, divergent transitions of NUTS (Betancourt,
arXiv:1701.02434). Of the 2.5 % beyond an end of the interval it is a large part."""
SAME_MODE = 3.0
"""Distance in standard deviations up to which two searches ended in one mode: the middle between such two has a third
of the density."""
LEFT_MODE = 0.05
"""Share of the draws that lie nearer to another mode, above which an ensemble counts as having left its own: so
many lie beyond the middle of two normal modes 3.3 standard deviations apart, hardly more than `SAME_MODE`."""
FEWEST_ENSEMBLES = 4
"""Independent ensembles: agreement between fewer says little (Vehtari et al., as above)."""
DIFFERS = 0.01
"""Probability by chance, over means and standard deviations of all coordinates, of a difference between two samplers
below which they disagree."""
NUTS_R_HAT = 1.05
"""R-hat between the chains of NUTS from which they have not converged: of 800 draws, a third of them effective, chance
makes up to 1.04 in the worst of 15 coordinates."""
SAME_WIDTH = 0.8
"""Ratio of two standard errors from which they tell the same: below it, a third of the variance is gone. Of the GLS
estimate over the OLS one, and of a posterior over its prior, above which the data tell nothing of a parameter."""
PRIOR_MATTERS = 0.3
"""Posterior over prior width above which the prior matters: it draws a normal posterior to itself by the square of it,
a tenth of its distance."""
STRONG_CORRELATION = 0.995
"""Posterior correlation above which two parameters are not determined one by one, as `fitting.thresholds.TIED`: given
the other, each is ten times as sure."""
FAR_FROM_START = 4.0
"""Distance of what the fit reports from the posterior, beyond what its dimension explains, in standard deviations: by
chance less than one in a million."""
TRUNCATED = 0.1
"""Distance of a lower or upper 2.5 % point from a bound, in standard deviations, below which the bound truncates: a
normal posterior that it cuts there lacks 2 % of its draws."""
PARETO_K = 0.7
"""Pareto's k above which a block's importance weights cannot be relied on (Vehtari, Gelman and Gabry, Statistics and
Computing 27 (2017))."""
WIDE_PRIOR = 10.0
"""Default priors reach this many times the typical size of a parameter; limits that are no wider are a uniform one."""
