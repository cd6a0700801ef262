"""What to do after a discovery."""

from __future__ import annotations

from fibrefit.discover.finding import Finding

FORESEEN = 1.15
"""Gap up to which a record counts as foreseen by a model fitted to the others."""
TRY_AGAIN = "fibrefit discover"


def next_steps(finding: Finding) -> tuple[str, ...]:
    """Sentences, the most useful first."""
    return {"named": _named, "unexplained": _unexplained, "nothing_missing": _rest, "not_trusted": _rest}[
        finding.verdict
    ](finding)


def _named(finding: Finding) -> tuple[str, ...]:
    said = []
    for names in finding.cannot_tell_apart:
        either = " or ".join(names)
        said.append(
            f"Decide between {either} by what is known of the rig, or add a record under other conditions: "
            "these do not separate them."
        )
    missed = [held.record for held in finding.held_out if not held.gap_after <= FORESEEN]
    if missed:
        said.append(
            f"{', '.join(missed)}: the other records do not foresee {'it' if len(missed) == 1 else 'them'} down to the "
            "noise. See whether anything was different there before building on the new model."
        )
    said.append(
        "study.toml beside this result holds the new model with the values found: fibrefit fit, sample and simulate "
        "take it as it is."
    )
    return (*said, *_rest(finding))


def _unexplained(finding: Finding) -> tuple[str, ...]:
    return (
        "Look at the figures of places and states: they show where the model goes wrong and on what that depends.",
        "If you can write down a law that would do it, put it in a Python file and try it beside the catalogue with "
        "--also my_effects.py:MyEffect.",
        *_rest(finding),
    )


def _rest(finding: Finding) -> tuple[str, ...]:
    """What the fit itself advises, but for the search that has just been made."""
    return tuple(text for text in finding.after.advice if TRY_AGAIN not in text)
