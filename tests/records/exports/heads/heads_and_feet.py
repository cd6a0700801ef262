"""Heads and feet of a table with the truth beside them: one line is enough for a layout."""

from __future__ import annotations

import re
from typing import Any

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, lines

HEADINGS = {
    "en": ("time [s]", "force [N]", "position [mm]"),
    "de": ("Zeit [s]", "Kraft [N]", "Weg [mm]"),
    "fr": ("Temps [s]", "Force [N]", "Déplacement [mm]"),
    "es": ("Tiempo [s]", "Fuerza [N]", "Desplazamiento [mm]"),
    "it": ("Tempo [s]", "Forza [N]", "Spostamento [mm]"),
    "cs": ("Čas [s]", "Síla [N]", "Dráha [mm]"),
    "pl": ("Czas [s]", "Siła [N]", "Droga [mm]"),
}
ROLES = ("time", "force", "position")


def table(said: str, language: str, below: bool, worth: dict[str, float], sign: str) -> str:
    """A table of which one number of a role is worth so much, with a text above or below it."""
    form = str if language == "en" else de
    columns = [v / worth.get(role, 1.0) for role, v in zip(ROLES, (TIME, FORCE, POSITION), strict=True)]
    rows = lines(lambda i: sign.join(form(f"{column[i]:.8g}") for column in columns), N)
    body = sign.join(HEADINGS[language]) + "\n" + rows
    return body + said + "\n" if below else said + "\n" + body


def ordinary(kind: Kind, said: str, language: str = "en", below: bool = False, **more: Any) -> None:
    """A text that changes nothing: the table is read without a question."""
    text = table(said, language, below, {}, "," if language == "en" else ";")
    kind.add(f"ordinary: {said.splitlines()[0]}", text, rtol=1e-6, **more)


def nasty(
    kind: Kind, said: str, role: str = "force", worth: float = 2.0, language: str = "en", below: bool = False
) -> None:
    """A text by which one number of a role is worth something else: it is asked about, and the answer is what to say."""
    text = table(said, language, below, {role: worth}, "," if language == "en" else ";")
    heading = HEADINGS[language][ROLES.index(role)]
    quoted = "|".join(re.escape(" ".join(line.split())[:14]) for line in said.splitlines() if line.strip())
    remedy = {"channels": {role: {"column": heading, "scale": f"{worth:.10g}"}}}
    kind.add(f"nasty: {said.splitlines()[0]}", text, refused=quoted, remedy=remedy, rtol=1e-6, atol_time=1e-7)
