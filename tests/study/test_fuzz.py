"""Damaged study files: each is refused with a reason, or means exactly what its text says.

The text is read a second time by a few lines that share nothing with the program but the TOML parser.
"""

from __future__ import annotations

import math
import random
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from fibrefit.core.errors import StudyError
from fibrefit.study import Study, load_study
from tests.study.conftest import TEXT

NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

#: Every unit that a small damage to the study may leave behind, and what it is worth.
WORTH = {
    "kg": 1, "g": 1e-3, "mg": 1e-6, "gf": 9.80665e-3, "m": 1, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "nm": 1e-9,
    "deg": math.pi / 180, "grad": math.pi / 180, "rad": 1,
    "s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60, "h": 3600,
    "N": 1, "kN": 1e3, "KN": 1e3, "MN": 1e6, "mN": 1e-3, "cN": 1e-2, "daN": 10, "dN": 0.1, "uN": 1e-6,
    "N/m": 1, "kN/m": 1e3, "KN/m": 1e3, "MN/m": 1e6, "mN/m": 1e-3, "cN/m": 1e-2, "daN/m": 10, "uN/m": 1e-6,
    "N/mm": 1e3, "kN/mm": 1e6, "kN/cm": 1e5, "kN/um": 1e9, "kN/nm": 1e12,
}  # fmt: skip

#: Relative difference of two roundings of the same product.
ROUNDING = 4e-16

CHARACTERS = "0123456789.,-+eE \"'=[]{}#\\\n\tkKgmMNdsrau_/ü\x00"


def damaged(rng: random.Random) -> str:
    """The study with one to three small damages."""
    text = TEXT
    for _ in range(rng.randint(1, 3)):
        i = rng.randrange(max(len(text), 1))
        j = min(len(text), i + rng.randint(1, 12))
        lines = text.splitlines(keepends=True) or [""]
        k, m = rng.randrange(len(lines)), rng.randrange(len(lines))
        swapped = list(lines)
        swapped[k], swapped[m] = swapped[m], swapped[k]
        text = rng.choice(
            [
                text[:i] + text[i + 1 :],
                text[:i] + rng.choice(CHARACTERS) + text[i:],
                text[:i] + rng.choice(CHARACTERS) + text[i + 1 :],
                text[:i] + text[i:j][::-1] + text[j:],
                text[:i] + text[j:],
                text[:j] + text[i:],
                "".join(lines[:k] + lines[k + 1 :]),
                "".join([*lines[:k], lines[m], *lines[k:]]),
                "".join(swapped),
                text[: max(i, 1)],
            ]
        )
    return text


def second_reading(text: str) -> float:
    """Number in SI of a quantity, by other means than the program's."""
    match = NUMBER.fullmatch(text)
    assert match is not None, f"{text!r} was accepted"
    worth = WORTH.get(match[2])
    assert worth is not None, f"{text!r} was accepted"
    return float(match[1]) * worth


def agrees(raw: Any, found: Any) -> bool:
    """Whether a part of the study is what its text says."""
    if isinstance(raw, str) and isinstance(found, float):
        return math.isclose(second_reading(raw), found, rel_tol=ROUNDING)
    return bool(raw == found)


def check(text: str, study: Study) -> None:
    """Fail if any number or word of the study is not in its text."""
    raw = tomllib.loads(text)
    parameters = raw.pop("parameters", {})
    rig, records = raw["rig"], raw["records"]
    assert len(records) == len(study.records)
    for given, record in zip(records, study.records, strict=True):
        expected = {key: value for key, value in rig.items() if key != "kind"} | given
        found = {key: value for key, value in record.model_dump().items() if value is not None}
        assert found.keys() == expected.keys()
        assert all(agrees(expected[key], found[key]) for key in expected), (expected, found)
    for key, value in raw.get("noise", {}).items():
        assert agrees(value, getattr(study.noise, key))
    assert raw.get("units", {}) == study.units
    assert raw.get("channels", {}) == {key: value for key, value in study.channels if value is not None}
    assert raw.get("model", {}).get("tension_law", "clamped") == study.model.tension_law
    assert tuple(raw.get("model", {}).get("effects", ())) == study.model.effects
    assert raw["name"] == study.name
    # Parameters stay text until their unit is known; nothing may be lost on the way.
    written = {setting for name in parameters for setting in leaves(parameters[name])}
    kept = {s for table in study.parameters.values() for s in leaves(table.model_dump(exclude_defaults=True))}
    assert {s for s in written if s not in ("True", "False")} == {s for s in kept if s not in ("True", "False")}


def leaves(content: Any) -> set[str]:
    if isinstance(content, dict):
        return {leaf for value in content.values() for leaf in leaves(value)}
    if isinstance(content, list | tuple):
        return {leaf for value in content for leaf in leaves(value)}
    return {str(float(content) if isinstance(content, int) and not isinstance(content, bool) else content)}


def survive(folder: Path, seed: int) -> bool:
    """Whether a damaged file was accepted; fails if anything but a `StudyError` came out."""
    text = damaged(random.Random(seed))
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8", newline="")
    try:
        study = load_study(path)
    except StudyError as error:
        refused = error
    else:
        check(text, study)
        return True
    assert str(folder) in refused.where
    assert refused.got
    return False


def test_300_damaged_studies(folder: Path) -> None:
    accepted = sum(survive(folder, seed) for seed in range(300))
    # Both outcomes must occur, or the test would show nothing.
    assert 20 < accepted < 280


@pytest.mark.slow
def test_3000_damaged_studies(folder: Path) -> None:
    assert 200 < sum(survive(folder, seed) for seed in range(1000, 4000)) < 2800


def test_the_second_reading_sees_a_changed_number(folder: Path) -> None:
    (folder / "study.toml").write_text(TEXT)
    study = load_study(folder)
    check(TEXT, study)
    heavier = study.records[0].model_copy(update={"weight_mass": 3.097})
    with pytest.raises(AssertionError):
        check(TEXT, study.model_copy(update={"records": (heavier, study.records[1])}))
