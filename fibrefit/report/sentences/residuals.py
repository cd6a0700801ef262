"""Sentences of the checks of what a fit leaves: its spectrum, and where and in which record it is larger."""

from __future__ import annotations

import math
from pathlib import PurePath

from fibrefit.core.formatting import in_words
from fibrefit.study.summaries.check import Check


def residual_spectrum_sentence(check: Check) -> str:
    """Whether the residuals have the spectrum of the noise."""
    facts, names = check.facts, in_words(check.facts["whole"])
    aside = f" Without a rest, stated noise of {names} has no known spectrum: only its power in all is judged."
    aside = aside if names else ""
    if check.passed and facts["whole_alone"]:
        return f"The residuals' power in all is no more than {check.threshold:g} times that of the stated noise.{aside}"
    if check.passed:
        return f"The residuals' power is nowhere more than {check.threshold:g} times that of the noise at rest.{aside}"
    low, channel = facts["low"], facts["channel"]
    where = f" between {low:.3g} and {2 * low:.3g} Hz" if low else ""
    rests = "noise at rest of the stated size" if channel in facts["stated"] else "rests"
    return (
        f"The residuals' power in the {channel}{where} is {check.statistic:.3g} times that of the "
        f"{rests if low else 'stated noise'}; chance allowed for, at most {check.threshold:g} is expected. "
        f"They are not noise.{aside}"
    )


def residual_phase_sentence(check: Check) -> str:
    """Whether residuals are larger in a phase of the motion."""
    most = check.threshold
    if check.passed:
        return f"The residuals of no phase of the motion are more than {most:g} times the noise, chance allowed for."
    return (
        f"The residual of the {check.facts['channel']} while {check.facts['phase']} is {check.statistic:.3g} times the "
        f"noise; at most {most:g} is expected, chance allowed for. The model lacks something there."
    )


def loudest_record_sentence(check: Check) -> str:
    """Whether residuals of a single record are larger than its noise."""
    most = f"{check.threshold:.3g}"
    if check.passed:
        return f"The residuals of no single record are more than {most} times the noise, chance allowed for."
    size = f"{check.statistic:.3g} times the noise" if math.isfinite(check.statistic or math.inf) else "not known"
    return (
        f'The residual RMS of "{PurePath(check.facts["record"]).stem}" is {size}; at most {most} is expected of a '
        "single record, chance allowed for. The model lacks something there, or what is stated of it is wrong."
    )


def residual_state_sentence(check: Check) -> str:
    """Whether residuals depend on a state of the rig."""
    facts, most = check.facts, 100 * (check.threshold or 0.0)
    if not facts["tried"]:
        return "Too few readings are in motion for a curve in a state: whether residuals depend on one is not known."
    if check.passed:
        names, beyond = facts["states"], "of what is left, chance allowed for"
        return f"No curve in {', '.join(names[:-1])} or {names[-1]} explains over {most:.0f} % {beyond}."
    return (
        f"The {facts['channel']} residual depends on the {facts['state']}: a curve in it explains "
        f"{100 * (check.statistic or 0.0):.0f} % of what is left, of noise at most {most:.0f} %. The model lacks "
        "something."
    )
