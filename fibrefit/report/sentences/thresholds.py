"""Every number that decides by which words a finding is reported, with its meaning and where it comes from."""

from __future__ import annotations

SMALL_SHARE = 0.05
"""Share of the signal below which an effect is called small: a curve drawn over the other one hides it."""
SMALL_DIFFERENCE = 0.007
"""Upper end of the 95 % interval of a standard deviation between records up to which it is told that there is no
difference: a tenth of the 7 % that the prior alone leaves, of records that tell nothing."""
SURE = 5.0
"""Standard errors from which an effect is called systematic: the usual ones of a discovery."""
LITTLE_HELP = 5.0
"""Nats of which less, expected of a further record, are no great help: from 5 on two explanations are told apart."""
CONFOUNDED = 0.9
"""Absolute cosine of two sensitivities above which a pair is listed: of either, less than half is its own."""
SCATTERS_MORE = 2.0
"""Robust standard deviation between items over their median standard error, from which it is reported: the items
differ by more than they are uncertain."""
HEAVY_TAILS = 1.0
"""Excess kurtosis of the innovations above which a normal law is called into question: that of a thousand normal
samples scatters by 0.15, and Student's t with ten degrees of freedom has one."""
