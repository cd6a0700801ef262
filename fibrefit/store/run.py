"""What a run rests on, kept beside what it has done: a run goes on only from its own."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import is_plain_file, path_from, sha256_of
from fibrefit.store.manifest import Manifest
from fibrefit.study import Study

COMMAND, STUDY, SETTINGS = "command", "study", "settings"


@dataclass(frozen=True)
class Run:
    """What a run rests on.

    Parameters
    ----------
    inputs : tuple of pathlib.Path
        Every file it reads: none may lie in the folder of the result.
    parts : mapping of str to str
        The digest of everything that must be the same when the run goes on, by the name a message calls it.
    """

    inputs: tuple[Path, ...] = ()
    parts: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, command: str, study: Study, settings: str = "", files: Sequence[Path] = ()) -> Run:
        """Run of a command on a study.

        Parameters
        ----------
        command : str
            Its name.
        study : Study
            The study's own file may change in ways that mean nothing, such as a comment; what it says, its records and
            its laws may not.
        settings : str
            All else the run depends on.
        files : sequence of pathlib.Path
            Read beside those of the study, which may not change either.
        """
        parts = {COMMAND: command, STUDY: _digest(study.resolved_toml()), SETTINGS: _digest(settings)}
        read = (*study.data_files(), *files)
        # Named from the study, wherever the command was called.
        named = {path_from(study.source.parent, file): file for file in read if is_plain_file(file)}
        digests = {f'data "{name}"': sha256_of(file) for name, file in named.items()}
        return cls((*study.input_files(), *files), parts | digests)

    def check(self, kept: Manifest | None, shown: str) -> None:
        """Refuse to go on from what another run has kept.

        Parameters
        ----------
        kept : Manifest or None
            Marker of the folder it would go on from.
        shown : str
            How messages call the folder.

        Raises
        ------
        UsageError
            Naming the first thing that is not the same.
        """
        if kept is None:
            return
        do = "Start anew, with --force in place of --resume, or go back to what the run was started with."
        if kept.run is None:
            raise UsageError(shown, "was begun by another version of the program", "a layout that is known", do)
        for name in dict.fromkeys([*self.parts, *kept.run]):
            then, now = kept.run.get(name), self.parts.get(name)
            if then != now:
                raise UsageError(shown, _differs(name, then, now), "the same study, data and settings", do)


def _differs(name: str, then: str | None, now: str | None) -> str:
    if name == COMMAND:
        return f"holds a run of {then}, not of {now}"
    if then is None or now is None:
        return f"holds a run {'with' if now is None else 'without'} the {name}"
    return f"holds a run with other {name}" if name == SETTINGS else f"holds a run with another {name}: it has changed"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
