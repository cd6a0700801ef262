"""What a page is made of: a result as it was read, and the blocks in which it is shown, one below the other.

A file for each kind of result says in which blocks it is shown; the template knows how a block of each kind looks.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

from fibrefit.study.summaries.part import Groups, Part


class Illustration(NamedTuple):
    """A figure.

    Parameters
    ----------
    name, caption : str
        The caption says in sentences what is seen; it stands below, and in place of the picture for who cannot see it.
    """

    name: str
    caption: str
    png: bytes

    @property
    def content(self) -> str:
        """The picture as a page holds it."""
        return base64.b64encode(self.png).decode()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in dots, so that the page does not move while it is read."""
        return int.from_bytes(self.png[16:20]), int.from_bytes(self.png[20:24])


class Result(NamedTuple):
    """A result as it was read.

    Parameters
    ----------
    groups : mapping of group to mapping of name to Array
        Content of ``result.h5``; empty where there is none.
    items : mapping of str to Part
        Of a batch: the summary of each item that has one.
    link : str
        Address of the folder, seen from the page.
    """

    folder: str
    summary: Part
    pictures: Sequence[Illustration] = ()
    groups: Groups = MappingProxyType({})
    items: Mapping[str, Part] = MappingProxyType({})
    link: str = ""

    @property
    def name(self) -> str:
        """Name of the study, or of the batch."""
        own = getattr(self.summary, "study", None) or getattr(self.summary, "name", None)
        return str(own or Path(self.folder).name or "result")


@dataclass(frozen=True)
class Block:
    """A part of a page under a heading of its own."""

    kind: ClassVar[str] = ""
    heading: str


@dataclass(frozen=True)
class TableBlock(Block):
    """Rows under a head; the first cell of a row says what the row is about.

    Parameters
    ----------
    right : set of int
        Columns that are flush right.
    note : str
        Sentence below it.
    """

    kind: ClassVar[str] = "table"
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    right: frozenset[int] = frozenset()
    note: str = ""


@dataclass(frozen=True)
class Words(Block):
    """Paragraphs.

    Parameters
    ----------
    listed : bool
        As items of a list.
    """

    kind: ClassVar[str] = "words"
    paragraphs: Sequence[str]
    listed: bool = False


@dataclass(frozen=True)
class Pictures(Block):
    """Figures with their captions."""

    kind: ClassVar[str] = "pictures"
    pictures: Sequence[Illustration]


@dataclass(frozen=True)
class Hidden(Block):
    """What opens on request: text as it stands, below tables."""

    kind: ClassVar[str] = "hidden"
    text: str = ""
    tables: Sequence[TableBlock] = ()


@dataclass(frozen=True)
class Records(Block):
    """The view of the records.

    Parameters
    ----------
    view : dict
        What there is to see, see `fibrefit.report.page.records`.
    data : sequence of dict
        Packed samples of each record.
    """

    kind: ClassVar[str] = "records"
    view: Mapping[str, Any]
    data: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class Step:
    """A round of a search.

    Parameters
    ----------
    before, after : float
        Gap.
    table : TableBlock
        Its candidates.
    models : tuple of str
        Keys of the models before and after it in the view of the records; empty where there is none.
    """

    heading: str
    sentence: str
    before: float
    after: float
    table: TableBlock
    models: tuple[str, ...] = ()


@dataclass(frozen=True)
class Story(Block):
    """The rounds of a search, one after the other."""

    kind: ClassVar[str] = "story"
    steps: Sequence[Step]
    expected: float
    largest: float


@dataclass(frozen=True)
class Items(Block):
    """Many results as one table that sorts and filters, and as trends.

    Parameters
    ----------
    columns : sequence of dict
        ``label`` and ``kind`` (``text``, ``status``, ``number``) of each.
    rows : sequence of dict
        ``cells`` of (text, number or None, error or None) for each column; ``lacks``, whether its model leaves more
        than noise; ``detail`` lines that open; ``link``; ``printed``, whether it stands on paper too.
    """

    kind: ClassVar[str] = "items"
    columns: Sequence[Mapping[str, Any]]
    rows: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class PageContent:
    """A result as it is shown.

    Parameters
    ----------
    kind : str
        What it is a result of.
    status : {"ok", "suspect", "failed"}
    verdict : str
        In a line.
    opening : str
        What it means, in some sentences.
    facts : sequence of (str, str)
        Key numbers with their names.
    failed : sequence of str
        Checks that were not passed, in sentences.
    passed : int
        Number of checks that were.
    notes : sequence of str
        What its files hold that may give a reason to doubt a number.
    blocks : sequence of Block
        In their order.
    """

    kind: str
    status: str
    verdict: str
    opening: str = ""
    facts: Sequence[tuple[str, str]] = ()
    failed: Sequence[str] = ()
    passed: int = 0
    notes: Sequence[str] = ()
    blocks: Sequence[Block] = field(default_factory=tuple)
