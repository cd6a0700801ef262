"""Which effects a search may add: those of the catalogue that suit the rig, as far as the user wants them tried."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from importlib.metadata import entry_points

from fibrefit.core.errors import StudyError, UsageError, did_you_mean
from fibrefit.laws.catalogue import CATALOGUE, ENTRY_POINTS, find_effect, is_sought, suits, unsuited
from fibrefit.laws.families import MARK, members
from fibrefit.laws.fibre.point_masses import PointMasses, point_masses
from fibrefit.laws.law import Effect
from fibrefit.rigs.catalogue import rig_of
from fibrefit.study import Study

Candidates = dict[str, type[Effect]]

POINTS = 5
"""Points of a fibre whose mass is looked for, where the study does not say: fewer are no match for an even one."""


def candidates_of(
    study: Study, only: Sequence[str] = (), exclude: Sequence[str] = (), also: Sequence[str] = ()
) -> Candidates:
    """Effects that may be missing from the model of a study.

    Parameters
    ----------
    study : Study
    only : sequence of str
        Nothing but these: names of the catalogue, patterns such as ``guide.*``, or ``my_effects.py:MyEffect``.
    exclude : sequence of str
        Names or patterns to leave out.
    also : sequence of str
        Effects of the user's own, tried beside those of the catalogue.

    Returns
    -------
    dict of str to Effect class
        By the name a study gives them.

    Raises
    ------
    UsageError
        If a name is not known, makes no sense on the rig, is in the model already or stands without another; if nothing
        is left to try.
    StudyError
        If a file with effects is not understood.
    """
    present = {_found(name, study, "study").name for name in study.model.effects}
    offered = _offered(study, present)
    further: Candidates = {}
    for name in also:
        further |= _tried(name, study, present, "also")
    offered |= further
    # What is offered by its very name is tried whatever a pattern leaves.
    chosen = {**_chosen(only, study, present, offered), **further} if only else dict(offered)
    for pattern in exclude:
        for name in _matching(pattern, {**offered, **chosen}, "exclude"):
            chosen.pop(name, None)
    kept = _standing(chosen, present)
    lost = [name for name in only if name in chosen and name not in kept]
    if lost:
        needed = ", ".join(f'"{other}"' for other in chosen[lost[0]].needs)
        raise UsageError(f'only "{lost[0]}"', f"stands without {needed}", "both", f"Add {needed} to the list.")
    if not (offered or only):
        do = "Offer a law of your own: --also FILE:CLASS."
        raise UsageError(f"rig {study.kind}", "no effect of the catalogue that is not in the model", "one to try", do)
    if not kept:
        raise UsageError("only and exclude", "no effect is left to try", "one at least", "Exclude fewer.")
    return kept


def is_lasting(effect: type[Effect]) -> bool:
    """Whether an effect acts in all records, those to come among them."""
    return not effect.records and not effect.sudden


def _offered(study: Study, present: Iterable[str]) -> Candidates:
    """Effects of the catalogue and of installed packages that are sought, suit the rig and are not in the model."""
    installed = {point.name: find_effect(point.name) for point in entry_points(group=ENTRY_POINTS)}
    known = {**CATALOGUE, **installed}
    fitting = {name: effect for name, effect in known.items() if is_sought(effect, rig_of(study.kind, study.variant))}
    one_each = [_members(name, _pointed(effect, study), study) for name, effect in fitting.items()]
    return {name: effect for some in one_each for name, effect in some.items() if effect.name not in present}


def _members(name: str, effect: type[Effect], study: Study) -> Candidates:
    """An effect by the name a study gives it; of one that belongs to single records, that of each record of a study."""
    if effect.records or effect.recurs:
        return {name: effect}
    return {name + one.name.removeprefix(effect.name): one for one in members(effect, len(study.records))}


def _chosen(only: Sequence[str], study: Study, present: Iterable[str], offered: Candidates) -> Candidates:
    chosen: Candidates = {}
    for name in only:
        if "*" in name:
            chosen |= {match: offered[match] for match in _matching(name, offered, "only")}
        else:
            chosen |= {name: offered[name]} if name in offered else _tried(name, study, present, "only")
    return chosen


def _matching(pattern: str, offered: Mapping[str, type[Effect]], option: str) -> list[str]:
    """Names that a name or a pattern stands for: that of effects of single records stands for all of these."""
    matches = [name for name in offered if fnmatchcase(name, pattern) or name.rpartition(MARK)[0] == pattern]
    if matches or (pattern in CATALOGUE and "*" not in pattern):
        return matches
    hint = did_you_mean(pattern, offered) or "`fibrefit effects` lists the catalogue."
    raise UsageError(f'{option} "{pattern}"', "no such effect among the candidates", "a name or a pattern", hint)


def _tried(name: str, study: Study, present: Iterable[str], option: str) -> Candidates:
    """What a name that was requested stands for, if it can be added to the model."""
    effect = _found(name, study, option)
    where = f'{option} "{name}"'
    if effect.name in present:
        raise UsageError(where, "is in the model already", "an effect that may be missing", "Take it off the list.")
    if not suits(effect, rig_of(study.kind, study.variant)):
        raise UsageError(where, *unsuited(effect, rig_of(study.kind, study.variant)), "Take it off the list.")
    found = _members(name, _pointed(effect, study), study)
    if not found:
        raise UsageError(where, "belongs to single records of a series", "two records or more", "Take it off the list.")
    return {one: member for one, member in found.items() if member.name not in present}


def _pointed(effect: type[Effect], study: Study) -> type[Effect]:
    """The same with as many points as the study's fibre has, where it is the fibre's mass."""
    if effect is not PointMasses:
        return effect
    return point_masses(getattr(study.rig, "masses_per_fibre", None) or POINTS)


def _found(name: str, study: Study, option: str) -> type[Effect]:
    try:
        return find_effect(name, study.source.parent)
    except StudyError as error:
        if option == "study" or ".py:" in name:
            raise
        raise UsageError(f'{option} "{name}"', error.got, error.expected, error.do) from None


def _standing(chosen: Candidates, present: Iterable[str]) -> Candidates:
    """Those whose needs are met by the model or by others that are tried."""
    names = {*present, *(effect.name for effect in chosen.values())}
    return {name: effect for name, effect in chosen.items() if set(effect.needs) <= names}
