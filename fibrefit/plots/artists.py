"""Loading matplotlib for a command that only draws: a tenth of a second less, without the help texts of its artists.

Where a person types, in a notebook, these texts are wanted; a command line ends before anybody could ask for them.
"""

from __future__ import annotations

from contextlib import suppress


def without_help() -> None:
    """Spare this process the lists of properties that matplotlib writes into the help of each of its hundred artists.

    Writing them takes a third of the time in which it is loaded. To be called before `matplotlib.figure` is imported;
    where matplotlib makes them in another way, nothing changes.
    """
    with suppress(ImportError):
        from matplotlib.artist import Artist

        if hasattr(Artist, _WRITES):
            setattr(Artist, _WRITES, classmethod(lambda cls: None))


_WRITES = "_update_set_signature_and_docstring"
