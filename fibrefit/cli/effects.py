"""``fibrefit effects``: the catalogue of laws that can be added to a model."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

import click

from fibrefit.cli.terminal import Terminal, say, with_terminal

if TYPE_CHECKING:
    from fibrefit.core.declarations import Parameter
    from fibrefit.laws.law import Effect

_INDENT = "  "


@click.command("effects")
@click.argument("name", required=False)
@click.option("--check", is_flag=True, help="Say all that is wrong with the effect; exit code 4 if anything is.")
@with_terminal
def command(terminal: Terminal, name: str | None, check: bool) -> int:
    """List the effects, or describe NAME: law, parameters, units, source, and a small picture.

    NAME is one of the list, or FILE.py:CLASS for an effect of your own. Such a path is relative to the current folder
    here, and to the folder of the study wherever a study is worked on: in its effects, in --also, --only and --exclude.
    """
    from fibrefit.core.errors import StudyError, UsageError
    from fibrefit.laws.catalogue import CATALOGUE, find_effect
    from fibrefit.rigs.described import effect_facts

    if check:
        if name is None:
            raise UsageError("--check", "no effect", "fibrefit effects --check FILE.py:CLASS", "Name the effect.")
        return _checked(terminal, name)
    if name is None:
        effects = sorted(CATALOGUE.values(), key=lambda effect: effect.name.partition(".")[0])
        terminal.answer(_list(effects), [effect_facts(effect) for effect in effects])
        return 0
    try:
        effect = find_effect(name)
    except StudyError as error:
        raise UsageError(error.where, error.got, error.expected, error.do) from None
    terminal.answer(_page(effect, name, () if terminal.json else _picture(effect)), effect_facts(effect))
    return 0


def _checked(terminal: Terminal, name: str) -> int:
    """Tell all that is wrong with an effect; the exit code."""
    from fibrefit.core.errors import StudyError
    from fibrefit.laws.catalogue import all_wrong
    from fibrefit.rigs.catalogue import RIGS

    declared = [condition for rig in RIGS.values() for condition in rig.conditions]
    conditions = {c.name: 1.0 if math.isnan(c.typical) else c.typical for c in declared}
    wrong = [str(error) for error in all_wrong(name, conditions)]
    for line in () if terminal.json else wrong:
        say(f"error: {line}")
    text = f"{name}: {len(wrong)} to mend." if wrong else f"{name} keeps the contract of a law."
    terminal.answer(text, {"name": name, "passed": not wrong, "violations": wrong})
    return StudyError.exit_code if wrong else 0


def _list(effects: list[type[Effect]]) -> str:
    """One line for each effect, under the part of the rig it belongs to."""
    from fibrefit.rigs.described import sections

    width = max(len(effect.name) for effect in effects)
    lines = []
    for port, group in groupby(effects, key=lambda effect: effect.name.partition(".")[0]):
        lines += ["", port]
        for effect in group:
            lead = f"{_INDENT}{effect.name:<{width}}  "
            lines.append(_filled(sections(effect)[""], lead, " " * len(lead)))
    return "\n".join([*lines[1:], "", "fibrefit effects NAME says more."])


def _picture(effect: type[Effect]) -> list[str]:
    """What it does at its typical values, in letters; empty where no curve says it."""
    from fibrefit.report.text_plot import CHANGED, PLAIN, text_plot
    from fibrefit.rigs.picture import picture_of

    found = picture_of(effect)
    if found is None:
        return []
    lines = text_plot(found.across, found.up, found.x, found.without, found.with_it)
    return [
        "",
        f"At its typical values ({CHANGED}), beside the base model ({PLAIN})",
        *(_INDENT + line for line in lines),
    ]


def _page(effect: type[Effect], name: str, picture: Sequence[str] = ()) -> str:
    """All about one effect, by the name that was requested."""
    from fibrefit.rigs.described import rigs_of, sections

    parts = sections(effect)
    lines = [
        effect.name,
        "=" * len(effect.name),
        "",
        _filled(parts[""]),
        "",
        "Law",
        _filled(parts.get("Law", ""), _INDENT),
    ]
    lines += ["", "Parameters"]
    for parameter in effect.parameters:
        symbol = f" ({parameter.symbol})" if parameter.symbol else ""
        lines += [f"{_INDENT}{effect.name}.{parameter.name}{symbol}", _filled(_facts(effect, parameter), _INDENT * 2)]
    lines += ["", _filled(f"Rigs: {', '.join(rigs_of(effect))}")]
    if effect.needs:
        lines.append(_filled(f"Only together with {', '.join(effect.needs)}"))
    lines += picture
    for title in ("Valid range", "Source"):
        if title in parts:
            lines += ["", title, _filled(parts[title], _INDENT)]
    return "\n".join([*lines, "", *_use(name)])


def _use(name: str) -> list[str]:
    """The line to write in a study."""
    if ".py:" not in name:
        return [f'To use it: effects = ["{name}"] under [model].']
    beside = name.replace("\\", "/").rpartition("/")[2]
    said = "To use it, under [model] of a study in the same folder; elsewhere with its path from the study's folder:"
    return [_filled(said), f'{_INDENT}effects = ["{beside}"]']


def _facts(effect: type[Effect], parameter: Parameter) -> str:
    unit = "" if parameter.unit == "-" else f" {parameter.unit}"
    text = f"{parameter.doc}; typically {parameter.typical:g}{unit}"
    if parameter.name in effect.strength:
        text += f", without effect at {parameter.null:g}{unit}"
    limits = [
        f"{word} {limit:g}{unit}"
        for word, limit in (("at least", parameter.lower), ("at most", parameter.upper))
        if math.isfinite(limit)
    ]
    return f"{', '.join([text, *limits])}."


def _filled(text: str, indent: str = "", later: str | None = None) -> str:
    subsequent = indent if later is None else later
    return textwrap.fill(text, 80, initial_indent=indent, subsequent_indent=subsequent, break_on_hyphens=False)
