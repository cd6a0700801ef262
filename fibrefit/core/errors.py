"""Errors a person can act on: where, what was found, what was expected, what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Self, TypeVar

LONGEST = 400
"""Letters of what a message quotes: a file may hold a word of megabytes."""


MOST_TOLD = 8
"""Mistakes of one file that are told at once, a line each."""

LIKE = 0.6
"""Likeness from which a word is suggested, where 1 is the same."""

NO_FILES = ("nothing", "a study, or records", "If a pattern was to name them, nothing matches it.")
"""What is said of an empty list of files: what was found, what was expected, what to do."""

#: Letters from which the beginning of a word tells which word is meant.
_BEGINNING = 3


def _in_short(text: str) -> str:
    half = LONGEST // 2
    return text if len(text) <= LONGEST else f"{text[:half]} ... {text[-half:]}"


class FibrefitError(Exception):
    """A failure that is explained to the person who met it.

    Parameters
    ----------
    where : str
        File, line, column, key or option the message is about.
    got : str
        What was found there.
    expected : str
        What would have been accepted; empty when the remedy says it all.
    do : str
        The next thing to try, as a sentence.
    further : iterable of FibrefitError
        What else is wrong in the same place, told below it, a line each.
    """

    exit_code = 1

    def __init__(
        self, where: str, got: str, expected: str = "", do: str = "", further: Iterable[FibrefitError] = ()
    ) -> None:
        self.where, self.got, self.expected, self.do = where, got, expected, do
        self.further = tuple(further)
        super().__init__(str(self))

    def __str__(self) -> str:
        text = f"{_in_short(self.where)}: {_in_short(self.got)}"
        if self.expected:
            text += f"; expected {self.expected}"
        if not text.endswith((".", "?", "!")):
            text += "."
        return "\n".join([f"{text} {self.do}".rstrip(), *map(str, self.further)])

    def __reduce__(self) -> tuple:
        return type(self), (self.where, self.got, self.expected, self.do, self.further)

    def inside(self, place: str) -> Self:
        """The same error, of what stands in a place: a file, and a key of it."""
        further = [each.inside(place) for each in self.further]
        return type(self)(f"{place}, {self.where}", self.got, self.expected, self.do, further)

    def each(self) -> tuple[FibrefitError, ...]:
        """The error by itself, and those that are told with it."""
        return (type(self)(self.where, self.got, self.expected, self.do), *self.further)


class UsageError(FibrefitError):
    """The command line or a function call cannot be carried out as given."""

    exit_code = 2


class DataError(FibrefitError):
    """A measurement file is not understood."""

    exit_code = 3


class StudyError(FibrefitError):
    """A study file, or a file bound to a schema, is not valid."""

    exit_code = 4


Refused = TypeVar("Refused", bound=FibrefitError)


def as_one(errors: Sequence[Refused], where: str) -> Refused:
    """The first of some errors with the others below it: `MOST_TOLD` at most, and how many there are besides.

    Parameters
    ----------
    errors : sequence of FibrefitError
        At least one; the class is that of the first.
    where : str
        What all of them are about.
    """
    first, *others = errors
    told = others[: MOST_TOLD - 1]
    if left := len(others) - len(told):
        told.append(type(first)(where, f"{left} more mistake{'s' * (left != 1)}"))
    return type(first)(first.where, first.got, first.expected, first.do, told)


class Mistakes:
    """What is refused by looks that do not rest on each other: all of them are taken before it is told, as one error.

    Parameters
    ----------
    where : str
        What all of them look at.

    Examples
    --------
    >>> with Mistakes("study.toml") as mistakes:
    ...     for file in ("a.csv", "b.csv"):
    ...         with mistakes.collect():
    ...             raise StudyError(file, "no such file")
    Traceback (most recent call last):
    ...
    fibrefit.core.errors.StudyError: a.csv: no such file.
    b.csv: no such file.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._found: list[FibrefitError] = []

    @property
    def full(self) -> bool:
        """Whether more of them would only be counted."""
        return len(self._found) >= MOST_TOLD

    def note(self, error: FibrefitError) -> None:
        """Keep what a look refused."""
        self._found += error.each()

    @contextmanager
    def collect(self) -> Iterator[None]:
        """A look by itself: what it refuses is kept, and the next one is taken."""
        try:
            yield
        except FibrefitError as error:
            self.note(error)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if isinstance(error, FibrefitError):
            self.note(error)
        elif error is not None:
            return
        if self._found:
            raise as_one(self._found, self._where) from None


def refuse_unknown(name: str, word: str, known: Iterable[str]) -> None:
    """Refuse a word that is none of those an argument takes.

    Parameters
    ----------
    name : str
        Of the argument.

    Raises
    ------
    UsageError
        Naming those it takes.
    """
    words = list(known)
    if word not in words:
        raise UsageError(name, f'"{word}"', f"one of {', '.join(words)}", did_you_mean(str(word), words))


def did_you_mean(word: str, known: Iterable[str], likeness: float = LIKE) -> str:
    """Sentence that suggests the nearest known word; empty when none is near.

    Parameters
    ----------
    word : str
        The word that was not recognised.
    known : iterable of str
        The words that would have been; capitals do not count.
    likeness : float
        How near a word must be, from 0 to 1, where 1 is the same; up to `LIKE` its beginning will do.

    Returns
    -------
    str
        ``Did you mean "stiffness"?`` or an empty string.
    """
    spelt = {one.casefold(): one for one in known}
    wanted = word.casefold()
    # What the word begins is meant before what it merely resembles: "guide.visc" and not "guide.spring".
    begins = likeness <= LIKE and len(wanted) >= _BEGINNING
    begun = [one for one in spelt if one.startswith(wanted)] if begins else []
    near = difflib.get_close_matches(wanted, begun or spelt, n=1, cutoff=0.0 if begun else likeness)
    return f'Did you mean "{spelt[near[0]]}"?' if near else ""
