"""An effect in words and numbers: what its docstring and its parameters say, as data."""

from __future__ import annotations

import inspect
import math
import re
from typing import Any

from fibrefit.laws.catalogue import CATALOGUE, suits
from fibrefit.laws.law import Effect
from fibrefit.rigs.catalogue import RIGS

_SECTION = re.compile(r"^(Law|Parameters|Valid range|Source)\n-+\n", re.MULTILINE)


def described_effects() -> dict[str, dict[str, Any]]:
    """The catalogue of effects that can be added to a model.

    Returns
    -------
    dict of str to dict
        By name: ``says``, ``law``, ``parameters`` (name, symbol, unit, limits, typical), ``rigs``, ``source``...

    Examples
    --------
    >>> fibrefit.effects()["guide.viscous_friction"]["parameters"][0]["unit"]
    'N s/m'
    """
    return {effect.name: effect_facts(effect) for effect in CATALOGUE.values()}


def effect_facts(effect: type[Effect]) -> dict[str, Any]:
    """Effect as data, for programs."""
    parts = sections(effect)
    return {
        "name": effect.name,
        "says": parts[""],
        "law": parts.get("Law", ""),
        "valid_range": parts.get("Valid range", ""),
        "source": parts.get("Source", ""),
        "rigs": rigs_of(effect),
        "needs": list(effect.needs),
        "strength": list(effect.strength),
        "parameters": [
            {
                "name": f"{effect.name}.{parameter.name}",
                "symbol": parameter.symbol,
                "unit": parameter.unit,
                "says": parameter.doc,
                # JSON has no infinity: a limit that is none is null.
                **{
                    key: value if math.isfinite(value := getattr(parameter, key)) else None
                    for key in ("null", "typical", "lower", "upper")
                },
            }
            for parameter in effect.parameters
        ],
    }


def rigs_of(effect: type[Effect]) -> list[str]:
    """Kinds of rig an effect makes sense on."""
    return sorted(kind for kind, rig in RIGS.items() if suits(effect, rig))


def sections(effect: type[Effect]) -> dict[str, str]:
    """Sections of the docstring; the summary has no title."""
    parts = _SECTION.split(inspect.cleandoc(effect.__doc__ or ""))
    titles, texts = ["", *parts[1::2]], parts[0::2]
    return {title: " ".join(text.split()).replace("`", "") for title, text in zip(titles, texts, strict=True)}
