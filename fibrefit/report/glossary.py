"""The words of the reports and what they mean, from the glossary of the documentation, which ships with the program."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.report.layout import WIDTH

PACKAGE = Path(__file__).resolve().parents[1]

#: Where it is: in an installed package, and beside it in a checkout.
PLACES = (PACKAGE / "glossary.md", PACKAGE.parent / "docs" / "glossary.md")


class Explained(NamedTuple):
    """A word, or several for one thing.

    Parameters
    ----------
    section : str
        What it belongs to, such as ``"Estimates"``.
    """

    section: str
    word: str
    meaning: str


def terms() -> list[Explained]:
    """All words of the glossary, in its order."""
    found, section = [], ""
    for line in next((place for place in PLACES if place.is_file()), PLACES[0]).read_text(encoding="utf-8").split("\n"):
        if line.startswith("## "):
            section = line.removeprefix("## ")
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 2 and cells[0] != "word" and set(cells[0]) != {"-"}:
            found.append(Explained(section, *map(_plain, cells)))
    return found


def terms_with(words: Sequence[str]) -> list[Explained]:
    """Terms that have one of `words` in them, or in their meaning where no term has it; in the order of the glossary.

    Raises
    ------
    UsageError
        If a word is nowhere.
    """
    known = terms()
    found: set[Explained] = set()
    for word in words:
        begins = re.compile(rf"(?<!\w){re.escape(word)}", re.IGNORECASE)
        having = [term for term in known if begins.search(term.word)] or [
            term for term in known if begins.search(term.meaning)
        ]
        if not having:
            single = {part for term in known for part in re.findall(r"[\w-]+", term.word)}
            hint = did_you_mean(word, sorted(single)) or "fibrefit glossary lists them all."
            raise UsageError(f'word "{word}"', "not in the glossary", "one of its words", hint)
        found.update(having)
    return [term for term in known if term in found]


def glossary(found: Sequence[Explained]) -> str:
    """Terms under their sections, for the terminal."""
    parts = []
    for section, group in groupby(found, key=lambda term: term.section):
        parts += ["", section, "-" * len(section), *map(_entry, group)]
    return "\n".join(parts[1:])


def _entry(term: Explained) -> str:
    return textwrap.fill(f"{term.word}: {term.meaning}", WIDTH, subsequent_indent="    ", break_on_hyphens=False)


def _plain(cell: str) -> str:
    """A cell without the marks of the documentation: a link is its words."""
    return re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", cell).replace("`", "").replace("\\|", "|")
