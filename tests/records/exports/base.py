"""One record, as many programs would write it: what it holds, and the forms in which its numbers are printed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

N = 60
RATE = 2000.0


def _noise(i: int, k: int) -> float:
    """A number between -1 and 1 that looks random and never changes."""
    return math.modf(math.sin(12.9898 * i + 78.233 * k) * 43758.5453)[0]


FORCE = np.array([round(12.5 + 3.0 * math.sin(0.3 * i) + 0.2 * _noise(i, 1), 3) for i in range(N)])
"""In N."""
POSITION = np.array([round(-0.25 + 1.5 * math.sin(0.11 * i) + 0.01 * _noise(i, 2), 4) for i in range(N)])
"""In mm."""
TIME = np.arange(N) / RATE


@dataclass(frozen=True)
class Export:
    """A file, what a user says of it, and what is in it.

    `refused` is a pattern of the message where the file may be refused: what stands in doubt, and what to say. With
    `remedy`, the file must be read once that is said.
    """

    name: str
    content: bytes | Callable[[Any], None]
    options: dict[str, Any] = field(default_factory=dict)
    suffix: str = ".csv"
    refused: str | None = None
    remedy: dict[str, Any] | None = None
    #: What differs from the usual record.
    time: np.ndarray = field(default_factory=lambda: TIME)
    force: np.ndarray | None = field(default_factory=lambda: FORCE)
    position: np.ndarray | None = field(default_factory=lambda: POSITION * 1e-3)
    rtol: float = 1e-9
    atol_time: float = 1e-9
    #: Share of the samples that must be there at least.
    valid: float = 0.9
    #: Roles that no column of the file has.
    absent: tuple[str, ...] = ()
    #: Name and text of a header in a file of its own, the parts that follow, and a second logger with its offset in s.
    header: tuple[str, str] | None = None
    parts: tuple[str, ...] = ()
    beside: tuple[str, float | None] | None = None


class Kind(list[Export]):
    """Exports of one kind."""

    def add(self, name: str, content: str | bytes | Callable[[Any], None], **more: Any) -> None:
        encoded = content.encode(more.pop("encoding", "utf-8")) if isinstance(content, str) else content
        self.append(Export(name, encoded, **more))


def de(text: str) -> str:
    return text.replace(".", ",")


def t(i: int, scale: float = 1.0, digits: int = 4) -> str:
    return f"{i / RATE * scale:.{digits}f}"


def f(i: int, scale: float = 1.0, digits: int = 3) -> str:
    return f"{FORCE[i] * scale:.{digits}f}"


def u(i: int, scale: float = 1.0, digits: int = 4) -> str:
    return f"{POSITION[i] * scale:.{digits}f}"


def lines(make: Callable[[int], str], n: int = N, end: str = "\n") -> str:
    return "".join(make(i) + end for i in range(n))


def tfu(separator: str = ",", form: Callable[[str], str] = str) -> Callable[[int], str]:
    return lambda i: separator.join((form(t(i)), form(f(i)), form(u(i))))


def fu(separator: str = ",", form: Callable[[str], str] = str) -> Callable[[int], str]:
    return lambda i: separator.join((form(f(i)), form(u(i))))


def joined(cells: Iterable[Any], separator: str = ",") -> str:
    return separator.join(map(str, cells))
