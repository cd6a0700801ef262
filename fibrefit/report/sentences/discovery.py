"""Sentences of a discovery, by the identifiers of what was found: quantity, number, threshold, consequence."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from fibrefit.core.declarations import Statement
from fibrefit.core.formatting import format_quantity, from_to, in_words
from fibrefit.report.sentences.thresholds import LITTLE_HELP, SMALL_SHARE, SURE
from fibrefit.study.summaries.discovery import Round, Separation, Weight

NO_HELP = " That is little: it takes another kind of test."
READ_IN = {"m": ("mm", 1e3), "-": ("times what it is without", 1.0)}
"""Unit a person reads an SI unit in, and its factor, where it is another."""


def discovery_sentence(found: Statement) -> str:
    """What a search found."""
    return SENTENCES[found.identifier](found.facts)


def reason(found: Sequence[Statement]) -> str:
    """Why a verdict is what it is."""
    return " ".join(map(discovery_sentence, found))


def worded_round(summary: Round, found: Sequence[Statement]) -> Round:
    """A round with what was found in it put into words."""
    return summary.model_copy(update={"sentence": " ".join(map(discovery_sentence, found))})


def worded_weight(found: Weight) -> Weight:
    """The size of an effect with the sentence that says it."""
    sure = found.standard_errors >= SURE
    times = f"{found.standard_errors:.0f}" if sure else f"{found.standard_errors:.2g}"
    says = f"{found.effect} makes up {100.0 * found.share_of_signal:.2g} % of the {found.signal} and "
    if found.share_of_gap is None:
        says += "does not show in the gap, which was that of noise without it"
    else:
        says += f"accounts for {100.0 * found.share_of_gap:.0f} % of the gap"
    if sure:
        small = ": small but systematic." if found.share_of_signal < SMALL_SHARE else "."
        says += f"; its strength is {times} times its standard error{small}"
    else:
        says += f", but its strength is only {times} times its standard error."
    return found.model_copy(update={"says": says})


class Varied(Protocol):
    """A record under other conditions, or driven otherwise."""

    @property
    def conditions(self) -> Mapping[str, float]:
        """Those that differ, in SI units."""

    @property
    def pace(self) -> float:
        """Factor on how fast its input runs."""

    @property
    def size(self) -> float:
        """Factor on how far its input runs."""


def further_record(like: str, choice: Varied) -> str:
    """A record that could be measured."""
    changed = _changed(choice)
    return f"A record like {like} with {changed}" if changed else f"{like} once more"


def _changed(choice: Varied) -> str:
    parts = [f"{name} {shown_condition(name, value)}" for name, value in choice.conditions.items()]
    for factor, how in ((choice.pace, "fast"), (choice.size, "far")):
        if factor != 1.0:
            parts.append(f"its input run {factor:.3g} times as {how}")
    return ", ".join(parts)


def shown_condition(name: str, value: float) -> str:
    """A condition of a record as a person reads it.

    Parameters
    ----------
    name : str
        That of a study, ``drive_travel`` and ``drive_speed`` among them.
    value : float, in SI units
    """
    if name == "inclination":
        return f"{math.degrees(value):.3g} deg"
    unit = "kg" if name.endswith("mass") else "m/s" if name.endswith("_speed") else "m"
    return format_quantity(value, unit, 3)


def shown_probability(share: float) -> str:
    """A probability in percent; what is not certain is not told as certain.

    Parameters
    ----------
    share : float
        0 to 1.
    """
    percent = f"{100.0 * share:.0f}"
    return {"0": "< 1" if share > 0.0 else "0", "100": "> 99"}.get(percent, percent)


def worded_separation(found: Separation) -> Separation:
    """A record that tells two effects apart, with the sentence that says what it would tell."""
    first, second = found.pair
    begin = f"To tell {first} from {second}, the best further record is one like {found.record} with {_changed(found)}"
    before, after = found.nats_before, found.nats_after
    effect = f"the expected logarithm of their likelihood ratio rises from {before:.2g} to {after:.2g}."
    little = after - before < LITTLE_HELP
    return found.model_copy(update={"says": f"{begin}: {effect}{NO_HELP if little else ''}"})


UNDONE = {
    "further": "a further effect",
    "pairs": "effects in pairs",
    "exchange": "others in place of the first effect",
    "curves": "free curves",
    "curves_instead": "free curves in place of effects",
    "law": "a law for the free curves",
    "left_out": "predictions of left-out records",
    "weights": "weights of the effects",
    "detectable": "what would have been found",
    "rivals": "records that tell rivals apart",
    "final_fit": "the last steps of the final fit",
}
"""Parts of a search that the time may not suffice for, by identifier."""

Facts = Mapping[str, Any]


def _place(facts: Facts) -> str:
    ways = "".join(f" and {what} {how}" for what, how in facts["ways"])
    said = [f"{100 * facts['share']:.0f} % of the gap lies in the {facts['channel']} while {facts['phase']}{ways}"]
    if facts.get("soon") is not None:
        said.append(f"{100 * facts['soon_share']:.0f} % of that in the first {_in_ms(facts['soon'])} after take-up")
    if facts.get("with_speed") is not None:
        said.append(f"it {facts['with_speed']} with the speed at take-up")
    if facts["band"] is not None:
        low, high, share = facts["band"]
        said.append(f"{100 * share:.0f} % of that of the {facts['channel']} lies between {low:.3g} and {high:.3g} Hz")
    return f"{'; '.join(said)}."


def _in_ms(time: float) -> str:
    """Rounded up to half a millisecond, or a whole one."""
    step = 0.5 if time < 5e-3 else 1.0
    return f"{step * math.ceil(1e3 * time / step - 1e-6):g} ms"


def _added(facts: Facts) -> str:
    before, after = facts["gaps"]
    said = f"{facts['effects']}: the normalised residual RMS {from_to(before, after, '.3g')} (logarithm of the "
    said += f"Bayes factor {facts['gain']:.3g}, threshold {facts['threshold']:g}{by_chance(facts['chance'])})."
    if not facts["changes"]:
        return said
    moved = in_words(
        f"{name} {'rises' if new > old else 'falls'} from {old:.4g} to {new:.4g} {unit}"
        for name, old, new, unit in facts["changes"]
    )
    they = "they had" if len(facts["changes"]) > 1 else "it had"
    return f"{said} With it {moved}: until then {they} been biased by the missing effect."


def by_chance(probability: float | None, what: str = "the best of all candidates") -> str:
    """How probable it is that chance reaches as much; nothing where that is not known."""
    if probability is None:
        return ""
    # A bound on the safe side; of less than 1e-12 the size says nothing.
    most = max(probability, 1e-12)
    return f"; by chance {what} reaches it with a probability of {most:.1g} at the most"


def _constancy(facts: Facts) -> str:
    return (
        f"Parameters of their own in {facts['parts']} parts of each motion gain {facts['gain']:.0f} in twice the log "
        f"likelihood, where chance gives {facts['chance']} (p = {facts['probability']:.2g})."
    )


def _drift(facts: Facts) -> str:
    return (
        f"Slow changes of {facts['worst']} and the others within a motion, alike in all records, gain "
        f"{facts['gain']:.0f} where chance gives {facts['chance']} (p = {facts['probability']:.2g})."
    )


def _jump(facts: Facts) -> str:
    return (
        f"Readings jump more than their noise does, first of all the {facts['channel']} of {facts['record']} at "
        f"{facts['instant']:.3f} s (p = {facts['probability']:.2g} of all records together)."
    )


def _rest(facts: Facts) -> str:
    return (
        f"Below {facts['below']:g} Hz the {facts['channel']} holds {facts['times']:.2g} times the noise it has at rest "
        f"(p = {facts['probability']:.2g})."
    )


def _curve(facts: Facts) -> str:
    unit, factor = READ_IN.get(facts["unit"], (facts["unit"], 1.0))
    height_unit, height_factor = READ_IN.get(facts["height_unit"], (facts["height_unit"], 1.0))
    least, most = (height_factor * height for height in facts["heights"])
    says = f"{facts['curve']}, between {least:.2g} and {most:.2g} {height_unit}"
    for side in ("beyond", "below"):
        if facts[side] is not None:
            says += f", {side} a {facts['variable']} of {factor * facts[side]:.3g} {unit}"
    if facts["turns"] >= 2:
        low, high = facts["range"]
        says += f", rising and falling {facts['turns']} times over {factor * (high - low):.3g} {unit}"
    return says


def _curve_left(facts: Facts) -> str:
    return f"{_curve(facts)}; it accounts for {100 * facts['share']:.0f} % of the gap"


def _event(facts: Facts) -> str:
    others = ", the other records do not" if facts["others"] else ""
    return f"an event in time: {facts['record']} departs from the model at {facts['instant']:.3f} s{others}"


def _events(facts: Facts) -> str:
    departing = ", ".join(f"{record} at {instant:.3f} s" for record, instant in facts["departing"])
    return f"an event in time: records depart from the model, {departing}"


def _noise_left(facts: Facts) -> str:
    besides = ", and base parameters that differ between records" if facts["between_records"] else ""
    return f"What is left is noise{besides}: no test of the innovations objects."


def _unknown(facts: Facts) -> str:
    known, lies = "was tried" if facts["cut"] else "is known of", discovery_sentence(facts["lies"]).removesuffix(".")
    return f"nothing that {known}; {lies[:1].lower()}{lies[1:]}"


def _lost(facts: Facts) -> str:
    (before, after), later, beside = facts["gaps"], facts.get("later", ()), facts.get("beside", ())
    were = "were" if len(later) > 1 else "was"
    lost = (
        f"A fit with {in_words((*beside, facts['effect']))} loses a bounce of {facts['record']}: the normalised "
        f"residual RMS there rises from {before:.3g} to {after:.3g}"
    )
    if beside:
        return f"{lost}. Which of them does is not known: the time ended in the fit without {facts['effect']}."
    taken_too = f" {in_words(later)} {were} added later, and {were} not fitted without it." if later else ""
    return f"{lost}, so it is not what is missing.{taken_too}"


def _fit_in_wrong_minimum(facts: Facts) -> str:
    followed, fitted = facts["gaps"]
    return (
        f"The search followed the motion with a normalised residual RMS of {followed:.3g}; the final fit ends at "
        f"{fitted:.3g}, and its values and error bars are of no use."
    )


def _taken_out(facts: Facts) -> str:
    gone, several = facts["effects"], len(facts["effects"]) > 1
    were, are, place = ("were", "they are", "their places") if several else ("was", "it is", "its place")
    return (
        f"{in_words(gone)} {were} added and taken out again: with the others {are} no longer more than chance, "
        f"or what stands in {place} now is more probable."
    )


SENTENCES: dict[str, Callable[[Facts], str]] = {
    "no_place": lambda facts: "No channel exceeds its noise level in any phase of the motion.",
    "place": _place,
    "added": _added,
    "constancy": _constancy,
    "drift": _drift,
    "jump": _jump,
    "rest": _rest,
    "no_effect": lambda facts: "A gap is left that no effect of the catalogue that was tried accounts for.",
    "none_tried": lambda facts: (
        "A gap is left that no effect that was tried accounts for, and the time ended before all was tried."
    ),
    "all_untried": lambda facts: (
        "A gap is left, and the time ended before any effect was tried; more is given by --time."
    ),
    "curve_gains": lambda facts: f"{_curve(facts)} gains {facts['gain']:.3g} nats.",
    "curve_left": _curve_left,
    "curve_stays": lambda facts: (
        "No law that was tried says as much as the free curve and holds on records it was not fitted to: the curve "
        "stays."
    ),
    "event": _event,
    "events": _events,
    "unknown": _unknown,
    "noise_left": _noise_left,
    "lost": _lost,
    "fit_in_wrong_minimum": _fit_in_wrong_minimum,
    "taken_out": _taken_out,
    "too_small": lambda facts: (
        f"{facts['effect']} is there, but explains {facts['strength']:.2g} of the noise rms, less than the least of "
        f"interest ({facts['least']:g}): it was not added."
    ),
    "time_ended": lambda facts: (
        "Of what was tried nothing is missing, but the time ended before all was tried; more is given by --time."
    ),
    "motion_lost": lambda facts: (
        f"The fit leaves a gap of {facts['gap']:.3g} over whole records: it loses the motion after the first bounces, "
        "and what may be missing was looked for before these alone. Of the rest nothing is known."
    ),
    "no_further_look": lambda facts: (
        "The time ended before all that may be missing beside what was named was looked at; more is given by --time."
    ),
    "no_time": lambda facts: "The time ended before any effect was tried; more is given by --time.",
}
"""By identifier."""
