"""``fibrefit glossary``: what the words of the reports mean."""

from __future__ import annotations

import click

from fibrefit.cli.terminal import Terminal, with_terminal


@click.command("glossary")
@click.argument("words", nargs=-1, metavar="[WORD]...")
@with_terminal
def command(terminal: Terminal, words: tuple[str, ...]) -> int:
    """Say what the words of the reports mean: all of them, or those with a WORD in them, such as gap or R-hat."""
    from fibrefit.report.glossary import glossary, terms, terms_with

    found = terms_with(words) if words else terms()
    terminal.answer(glossary(found), [term._asdict() for term in found])
    return 0
