"""Sentences of where a search ended: its starts, its second solver, and what was cut short."""

from __future__ import annotations

import math

from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import MOST_MINIMA
from fibrefit.study.summaries.results import Basin, StartsSummary


def second_solver_sentence(check: Check) -> str:
    """Whether another solver ends at the same values."""
    if check.statistic is None:
        return "A second solver was not run."
    gain, nats = check.facts["gain"], check.facts["nats"]
    if check.passed:
        same = nats is None or check.threshold is None or check.statistic <= check.threshold
        end = "at the same values" if same else f"in another minimum, which is {nats:.3g} nats less probable"
        return f"A second, independent solver ends {end}."
    if nats is not None and math.isinf(check.statistic):
        return "From where a second solver ends the likelihood leads nowhere. The minimum is not a plain one."
    if nats is not None:
        return (
            f"From where a second solver ends the likelihood leads {check.statistic:.2g} standard errors away, to what "
            f"is {abs(nats):.3g} nats {'less' if nats > 0 else 'more'} probable. The minimum is not a plain one."
        )
    away = beyond(check.statistic, check.threshold or 0.0)
    return (
        f"A second solver ends {away} standard errors away, with a cost {abs(gain):.3g} "
        f"{'lower' if gain > 0 else 'higher'}; at most {check.threshold:g} is expected. The minimum is not a plain one."
    )


def beyond(value: float, limit: float) -> str:
    """A number with two digits, or as many as tell it from the limit that it passed."""
    return next((text for text in (f"{value:.{n}g}" for n in range(2, 8)) if float(text) > limit), f"{value:.8g}")


def _larger(excess: float) -> str:
    return f"{excess:.3g} times as large" if excess >= 1.005 else "less than 1 % larger"


def completion_sentence(check: Check) -> str:
    """How much of an interrupted fit was done."""
    whole = check.statistic == check.threshold
    after = "; what should follow them was cut short." if whole else "; the best of them is kept."
    return f"Interrupted: {check.statistic:.0f} of {check.threshold:.0f} starts came to an end{after}"


def starts_sentence(check: Check) -> str:
    """Where the starts ended."""
    facts = check.facts
    says = f"{facts['agreeing']} of {facts['tried']} starts ended in the best minimum."
    if facts["others"]:
        says += f" {facts['others']} ended in others, the nearest with residuals {_larger(facts['excess'])}"
        says += ": bounces or swings that are matched with others than their own make such minima."
    if (lost := facts["lost"]) > 0:
        says += f" {lost} led nowhere and {'was' if lost == 1 else 'were'} given up."
    if facts["lonely"] and not check.passed:
        return f"{says} One start agrees with itself: whether there is a better minimum is not known without more."
    if facts["nats"] is not None and (facts["noise"] or not check.passed):
        return f"{says} {_followed(facts['nats'], facts['least'], check.passed)}"
    if check.statistic is not None and check.threshold is not None and check.statistic < check.threshold:
        another = f"a further start would find another minimum with a probability of {100 * (1 - facts['known']):.2g} %"
        if facts["noise"]:
            says += " The best one leaves only noise: none can lie below it."
        elif check.passed:
            says += f" All minima are taken to be known: {another}."
        else:
            says += f" At least {100 * check.threshold:.0f} % are expected, or that all minima are known: {another}. "
            says += "A better one may have been missed."
    return says


def _followed(nats: float, least: float, passed: bool) -> str:
    """What became of the best starts once their minima were followed to the end."""
    if math.isinf(nats):
        return "Followed on, the best of these minima lead to one place."
    says = f"Followed on, the next of these minima is {abs(nats):.3g} nats {'less' if nats >= 0 else 'more'} probable"
    return f"{says}." if passed else f"{says}; at least {least:g} less are expected. A better one may have been missed."


def multistart_sentence(starts: StartsSummary) -> str:
    """How many starts reached the best minimum, and which others there are."""
    text = f"Multistart: {starts.agreeing} of {starts.tried} starts reached the best minimum"
    others = [basin for basin in starts.basins if basin.cost > 0]
    shown = ", ".join(map(_other_minimum, others[:2]))
    more = "at least " if len(starts.basins) >= MOST_MINIMA else ""
    number = f"{more}{len(others)} local minim{'um' if len(others) == 1 else 'a'}"
    return f"{text}; {number}: {shown}{', and others' if len(others) > 2 else ''}." if others else f"{text}."


def _other_minimum(basin: Basin) -> str:
    """By how much its cost is above the best one, and how many starts ended there."""
    above = f"cost {100.0 * basin.cost:.2g} % higher" if basin.cost < 1.0 else f"cost x {1.0 + basin.cost:.3g}"
    return f"{above} ({basin.starts} start{'' if basin.starts == 1 else 's'})"
