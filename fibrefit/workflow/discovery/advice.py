"""What to do after a discovery."""

from __future__ import annotations

from fibrefit.discovery.model.finding import Finding
from fibrefit.report.sentences.discovery import worded_separation
from fibrefit.report.sentences.fit import advice_sentence
from fibrefit.workflow.thresholds import PREDICTED

SEARCH = "search"
"""Identifier of the advice to search for what the model lacks."""


def next_steps(finding: Finding, narrowed: bool) -> tuple[str, ...]:
    """Sentences, the most useful first.

    Parameters
    ----------
    finding : Finding
    narrowed : bool
        Whether effects of the catalogue were left out of the search.
    """
    # What the fit itself advises stays, but for the search that has just been made.
    rest = tuple(advice_sentence(one) for one in finding.after.advice if one.identifier != SEARCH)
    if finding.verdict == "named":
        return (*_named(finding), *rest)
    if finding.verdict == "unexplained":
        return (*_unexplained(narrowed, finding.proposed_law is not None), *rest)
    return rest


def _named(finding: Finding) -> tuple[str, ...]:
    said = []
    for names in finding.cannot_tell_apart:
        either = " or ".join(names)
        said.append(
            f"Decide between {either} by what is known of the rig, or add a record under other conditions: "
            "these do not separate them."
        )
    said += [worded_separation(record).says for record in finding.separated_by]
    missed = [held.record for held in finding.held_out if not held.gap_after <= PREDICTED]
    if missed:
        said.append(
            f"{', '.join(missed)}: not predicted within noise by a fit to the other records (gap above {PREDICTED:g}). "
            "See whether anything was different there before building on the new model."
        )
    said.append(
        "study.toml beside this result holds the new model with the values found: fibrefit fit, sample and simulate "
        "take it as it is."
    )
    return tuple(said)


def _unexplained(narrowed: bool, composed: bool) -> tuple[str, ...]:
    said = [
        "Look at the figures of places, states and spectrum: they show where the residuals exceed noise, on which "
        "state they depend, and at which frequencies."
    ]
    if narrowed:
        said.insert(0, "Let the whole catalogue be tried: effects were left out of this search by --only or --exclude.")
    if composed:
        said.append(
            "The law that was composed says what the records show, not why: ask what on the rig could do this, and "
            "take a record beyond the range that they saw to test it."
        )
        return tuple(said)
    said.append(
        "If you can write down a law that would do it, put it in a Python file and try it beside the catalogue with "
        "--also my_effects.py:MyEffect."
    )
    return tuple(said)
