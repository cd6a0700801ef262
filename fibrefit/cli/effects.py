"""``fibrefit effects``, laws that can be added to a model, and ``fibrefit glossary``, the words of reports."""

from __future__ import annotations

import math
import textwrap
from itertools import groupby
from typing import TYPE_CHECKING

import click

from fibrefit.cli.options import option, plain_command
from fibrefit.cli.terminal import Terminal, say
from fibrefit.core.errors import StudyError, UsageError

if TYPE_CHECKING:
    from fibrefit.laws.law import Effect

_INDENT = "  "


@plain_command(
    "effects",
    click.Argument(["name"], required=False),
    option("--check", "Say all that is wrong with the effect; exit code 4 if anything is."),
)
def effects_command(terminal: Terminal, name: str | None, check: bool) -> int:
    """List the effects, or describe NAME: law, parameters, units, source, and a small picture.

    NAME is one of the list, or FILE.py:CLASS for an effect of your own. Such a path is relative to the current folder
    here, and to the folder of the study wherever a study is worked on: in its effects, in --also, --only and --exclude.
    """
    from fibrefit.laws.catalogue import CATALOGUE, all_wrong, find_effect
    from fibrefit.rigs.effects import effect_facts, sections

    if check:
        if name is None:
            raise UsageError("--check", "no effect", "fibrefit effects --check FILE.py:CLASS", "Name the effect.")
        from fibrefit.rigs.catalogue import RIGS

        declared = [condition for rig in RIGS.values() for condition in rig.conditions]
        conditions = {c.name: 1.0 if math.isnan(c.typical) else c.typical for c in declared}
        wrong = [str(error) for error in all_wrong(name, conditions)]
        for line in () if terminal.json else wrong:
            say(f"error: {line}")
        text = f"{name}: {len(wrong)} to mend." if wrong else f"{name} keeps the contract of a law."
        terminal.answer(text, {"name": name, "passed": not wrong, "violations": wrong})
        return StudyError.exit_code if wrong else 0
    if name is None:
        effects = sorted(CATALOGUE.values(), key=lambda effect: effect.name.partition(".")[0])
        width, lines = max(len(effect.name) for effect in effects), []
        for part_of_rig, group in groupby(effects, key=lambda effect: effect.name.partition(".")[0]):
            lines += ["", part_of_rig]
            for effect in group:
                lead = f"{_INDENT}{effect.name:<{width}}  "
                lines.append(_filled(sections(effect)[""], lead, " " * len(lead)))
        text = "\n".join([*lines[1:], "", "fibrefit effects NAME says more."])
        terminal.answer(text, [effect_facts(effect) for effect in effects])
        return 0
    try:
        effect = find_effect(name)
    except StudyError as error:
        raise UsageError(error.where, error.got, error.expected, error.do) from None
    terminal.answer(_page(effect, name, picture=not terminal.json), effect_facts(effect))
    return 0


def _page(effect: type[Effect], name: str, picture: bool) -> str:
    """All about one effect, by the name that was requested; with its curve at typical values, in letters."""
    from fibrefit.report.text_plot import CHANGED, PLAIN, text_plot
    from fibrefit.rigs.effects import picture_of, rigs_of, sections

    parts = sections(effect)
    lines = [effect.name, "=" * len(effect.name), "", _filled(parts[""])]
    lines += ["", "Law", _filled(parts.get("Law", ""), _INDENT), "", "Parameters"]
    for parameter in effect.parameters:
        symbol = f" ({parameter.symbol})" if parameter.symbol else ""
        unit = "" if parameter.unit == "-" else f" {parameter.unit}"
        facts = [f"{parameter.doc}; typically {parameter.typical:g}{unit}"]
        if parameter.name in effect.strength:
            facts.append(f"without effect at {parameter.null:g}{unit}")
        limits = ("at least", parameter.lower), ("at most", parameter.upper)
        facts += [f"{word} {limit:g}{unit}" for word, limit in limits if math.isfinite(limit)]
        lines += [f"{_INDENT}{effect.name}.{parameter.name}{symbol}", _filled(f"{', '.join(facts)}.", _INDENT * 2)]
    lines += ["", _filled(f"Rigs: {', '.join(rigs_of(effect))}")]
    if effect.needs:
        lines.append(_filled(f"Only together with {', '.join(effect.needs)}"))
    if picture and (found := picture_of(effect)) is not None:
        lines += ["", f"At its typical values ({CHANGED}), beside the base model ({PLAIN})"]
        drawn = text_plot(found.across, found.up, found.x, found.without, found.with_it)
        lines += [_INDENT + line for line in drawn]
    for title in ("Valid range", "Source"):
        if title in parts:
            lines += ["", title, _filled(parts[title], _INDENT)]
    if ".py:" not in name:
        return "\n".join([*lines, "", f'To use it: effects = ["{name}"] under [model].'])
    file = name.replace("\\", "/").rpartition("/")[2]
    said = "To use it, under [model] of a study in the same folder; elsewhere with its path from the study's folder:"
    return "\n".join([*lines, "", _filled(said), f'{_INDENT}effects = ["{file}"]'])


def _filled(text: str, indent: str = "", later: str | None = None) -> str:
    subsequent = indent if later is None else later
    return textwrap.fill(text, 80, initial_indent=indent, subsequent_indent=subsequent, break_on_hyphens=False)


@plain_command("glossary", click.Argument(["words"], nargs=-1, metavar="[WORD]..."))
def glossary_command(terminal: Terminal, words: tuple[str, ...]) -> int:
    """Say what the words of the reports mean: all of them, or those with a WORD in them, such as gap or R-hat."""
    from fibrefit.report.glossary import glossary, terms, terms_with

    found = terms_with(words) if words else terms()
    terminal.answer(glossary(found), [term._asdict() for term in found])
    return 0
