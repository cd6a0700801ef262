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
SECOND_MODE = 0.01
"""Weight from which other modes must not be passed over: of the 2.5 % beyond an end of the interval it is 1."""
NEGLIGIBLE_MODE = 1e-4
"""Weight by Laplace's method below which a mode is not sampled: a hundredth of `SECOND_MODE`."""
SAME_MODE = 3.0
"""Distance in standard deviations up to which two searches ended in one mode: the middle between such two has a third
of the density."""
LEFT_MODE = 0.05
"""Share of the draws that lie nearer to another mode, above which an ensemble counts as having left its own."""
FEWEST_ENSEMBLES = 4
"""Independent ensembles: agreement between fewer says little (Vehtari et al., as above)."""
FLAT_PART = 1e-2
"""Component along a direction that neither data nor prior limit from which a parameter is named: less is rounding."""
DIFFERS = 0.01
"""Probability by chance, over means and standard deviations of all coordinates, of a difference between two samplers
below which they disagree."""
NUTS_R_HAT = 1.05
"""R-hat between the chains of NUTS from which they have not converged: of 800 draws, a third of them effective, chance
makes up to 1.04 in the worst of 15 coordinates."""
DIVERGENT = 0.01
"""Share of divergent transitions of NUTS above which it misses a part of the posterior that counts: of the 2.5 % beyond
an end of the interval, a large part (Betancourt, arXiv:1701.02434)."""
GAINED = 0.8
"""Standard error of the GLS estimate over that of the OLS one, below which it is reported: a third less variance."""
UNCONTRACTED = 0.8
"""Posterior over prior width above which the data tell nothing of a parameter."""
PRIOR_MATTERS = 0.3
"""The same above which the prior matters: it draws a normal posterior to itself by a tenth of its distance."""
STRONG_CORRELATION = 0.995
"""Posterior correlation above which two parameters are not determined one by one, as `fitting.thresholds.TIED`."""
FAR_FROM_START = 4.0
"""Distance of what the fit reports from the posterior, beyond what its dimension explains, in standard deviations."""
TRUNCATED = 0.1
"""Distance of a lower or upper 2.5 % point from a bound, in standard deviations, below which the bound truncates."""
PARETO_K = 0.7
"""Pareto's k above which a block's importance weights cannot be relied on (Vehtari, Gelman and Gabry, Statistics and
Computing 27 (2017))."""
DECISIVE = 0.05
"""Probability by chance of so large a difference below which one of two models is said to predict better, by Student's
law, as its error is that of a scatter between blocks."""
