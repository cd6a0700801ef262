"""Progress of the sampler in words, for a person."""

from __future__ import annotations

import math
from collections.abc import Callable

from fibrefit.core.limits import Progress
from fibrefit.sampling.chains import SamplerProgress
from fibrefit.sampling.settings import Settings


def followed(on_progress: Progress, settings: Settings) -> Callable[[SamplerProgress], None]:
    """A listener of the sampler that passes its progress on in words.

    Parameters
    ----------
    on_progress : Progress
        Called with what is being done and the share that is finished.
    """

    def listener(progress: SamplerProgress) -> None:
        on_progress(line_of(progress, settings), share_of(progress, settings))

    return listener


def share_of(progress: SamplerProgress, settings: Settings) -> float | None:
    """Share of the run that is finished, as far as it can be estimated."""
    if math.isnan(progress.seconds_left):
        return None
    remaining = progress.seconds_left
    if settings.max_seconds is not None:
        remaining = min(remaining, max(settings.max_seconds - progress.seconds, 0.0))
    return progress.seconds / max(progress.seconds + remaining, 1e-9)


def line_of(progress: SamplerProgress, settings: Settings) -> str:
    """``step 75, 20 s left, accepted 45 %, R-hat 1.013, ESS 311/400``: short enough for a terminal with a bar."""
    said = [f"step {progress.steps}"]
    if not math.isnan(progress.seconds_left):
        said.append(f"{spoken(progress.seconds_left)} left")
    if not math.isnan(progress.acceptance):
        said.append(f"accepted {100 * progress.acceptance:.0f} %")
    if not math.isnan(progress.r_hat):
        said += [f"R-hat {progress.r_hat:.3f}", f"ESS {progress.ess:.0f}/{settings.ess:g}"]
    return ", ".join(said)


def spoken(seconds: float) -> str:
    """A time as one says it: ``12 s``, ``3 min``, ``1.5 h``."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
