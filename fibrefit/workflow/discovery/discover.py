"""``discover``: a study in, what its model lacks out, and its files."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING

from fibrefit.core.environment import versions
from fibrefit.core.errors import FibrefitError, UsageError
from fibrefit.core.limits import Progress, quiet, refuse_seed
from fibrefit.core.paths import sha256_of
from fibrefit.core.threads import one_blas_thread
from fibrefit.discovery.discover import discover
from fibrefit.discovery.forward_selection import SECONDS, Limits
from fibrefit.discovery.model.finding import Finding
from fibrefit.discovery.model.law import LAWS
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.records import Record
from fibrefit.store import ResultDirectory
from fibrefit.store.summary import provenance, read_summary
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.discovery import Candidate, DiscoverySummary, Verdict
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.workflow.discovery.candidates import Candidates, candidates_of
from fibrefit.workflow.discovery.files import discovery_groups, discovery_summary, final_study
from fibrefit.workflow.prediction.predicts import Predicts
from fibrefit.workflow.prepare import read_records, task_of, task_to_fit
from fibrefit.workflow.saved import write_parts

if TYPE_CHECKING:
    from fibrefit.study.summaries.part import Variable

Choose = Callable[[Sequence[Candidate]], str | None]

TIME = "time"
"""What the time a search was given is called among the settings of its result."""


@dataclass(frozen=True)
class SearchOptions:
    """What a search was requested to do, and a program must know to do it again.

    Parameters
    ----------
    max_effects : int
    only, exclude, also : tuple of str
        As for `candidates_of`.
    seed : int
    seconds : float
        After which there is an answer.
    """

    max_effects: int = 3
    only: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    seed: int = 0
    seconds: float = SECONDS
    least: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what no search can do."""
        refuse_seed(self.seed)
        if not 1 <= self.max_effects <= len(CATALOGUE):
            expected = f"1 to {len(CATALOGUE)}, as many as the catalogue holds"
            raise UsageError("max_effects", str(self.max_effects), expected)
        if not 0.0 <= self.seconds < float("inf"):
            raise UsageError("seconds", f"{self.seconds:g}", "a time in seconds")
        if not 0.0 <= self.least < float("inf"):
            raise UsageError("least", f"{self.least:g}", "0 or more, in units of the noise")

    def as_settings(self) -> dict[str, str]:
        """Settings as a summary keeps them; the seed has a place of its own there."""
        lists = {name: ", ".join(sorted(getattr(self, name))) for name in ("only", "exclude", "also")}
        time = {} if self.seconds == SECONDS else {TIME: f"{self.seconds:g}"}
        least = {"least": f"{self.least:g}"} if self.least else {}
        return {
            "max_effects": str(self.max_effects),
            **time,
            **least,
            **{name: text for name, text in lists.items() if text},
        }


@dataclass(frozen=True, repr=False)
class Discovery(Predicts):
    """What the model of a study lacks.

    Parameters
    ----------
    study : Study
        The one the search began with.
    records : tuple of Record
    finding : Finding
    candidates : dict of str to Effect class
        Those that were tried, by the name a study gives them.
    options : SearchOptions
    chosen : bool
        Whether a person chose among the candidates.
    """

    study: Study
    records: tuple[Record, ...]
    finding: Finding
    candidates: Candidates
    options: SearchOptions
    chosen: bool = False

    @property
    def verdict(self) -> Verdict:
        """``nothing_missing``, ``named``, ``unexplained`` or ``not_trusted``."""
        return self.finding.verdict

    @property
    def added(self) -> tuple[str, ...]:
        """Effects of the final model that the study does not have, by their names in a study."""
        names = {effect: name for name, effect in self.candidates.items()}
        return tuple(names.get(effect, effect.name) for effect in self.finding.added)

    @property
    def parameters(self) -> dict[str, ParameterSummary]:
        """Parameters of the final model that all records share, by name, in SI units."""
        return self.finding.after.parameters

    @cached_property
    def final(self) -> Study:
        """Study of the final model: with what was added, starting at the values that were found."""
        if self.finding.proposed_law is None:
            return final_study(self.study, self.finding, self.added)
        # A study names a law by its file, which is there as long as this result is.
        folder = Path(mkdtemp(prefix="fibrefit-"))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        _write_law(self.finding, folder)
        return final_study(self.study, self.finding, self._effects(folder))

    def _effects(self, folder: Path) -> tuple[str, ...]:
        """What was added, with the law that was composed, a file in a folder."""
        law = self.finding.proposed_law
        return self.added if law is None else (*self.added, str(folder / law.summary.effect))

    def summary(self) -> DiscoverySummary:
        """Content of ``summary.json``."""
        settings = self.options.as_settings() | ({"interactive": "yes"} if self.chosen else {})
        origin = provenance(
            self.study,
            self.inputs(),
            seed=self.options.seed,
            seconds=self.finding.seconds,
            settings=settings,
        )
        return discovery_summary(self.study, self.records, self.finding, origin)

    def groups(self) -> dict[str, dict[str, Variable]]:
        """Arrays of ``result.h5``."""
        return discovery_groups(self.finding)

    def inputs(self) -> list[Path]:
        """Files of the study, and those with effects that were tried."""
        return inputs_of(self.study, self.options)

    def predicting(self) -> Study:
        """The study of the final model."""
        return self.final

    def write_data(self, directory: ResultDirectory) -> None:
        """Write ``summary.json``, ``result.h5``, ``study.toml`` of the final model."""
        _write_law(self.finding, directory.path)
        study = final_study(self.study, self.finding, self._effects(directory.out))
        write_parts(directory, self.summary(), self.groups(), study)


def _write_law(finding: Finding, folder: Path) -> None:
    """Write the law that was composed, if any, where the study of the final model names it."""
    if (law := finding.proposed_law) is not None:
        (folder / LAWS).mkdir(exist_ok=True)
        (folder / LAWS / law.file).write_text(law.source, encoding="utf-8")


@one_blas_thread
def discover_study(
    study: Study | str | Path, *, max_effects: int = 3, only: Sequence[str] = (), exclude: Sequence[str] = (),
    also: Sequence[str] = (), seed: int = 0, seconds: float = SECONDS, least: float = 0.0,
    choose: Choose | None = None, folder: str | Path | None = None, progress: Progress | None = None,
) -> Discovery:  # fmt: skip
    """Find what the model of a study lacks: where it goes wrong, which effect accounts for it, what is left then.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        A path is that of a study file, or of a folder with a ``study.toml``.
    max_effects : int
        Most effects that are added.
    only, exclude, also : sequence of str
        Try nothing but these, leave these out, try these too: names of the catalogue, patterns such as ``guide.*``, or
        effects of your own, ``my_effects.py:MyEffect``.
    seed : int
        Of the scatter of starts; the same seed gives the same result.
    seconds : float
        Time in s after which there is an answer: the best so far, and what was not tried.
    least : float
        Smallest effect of interest, the rms of what it explains in units of the noise rms: what is there but
        smaller is reported, not added. It takes no part in the test of whether an effect is there.
    choose : callable, optional
        Given the candidates of a round, best first, names the effect to add, or None to add no more.
    folder : str or pathlib.Path, optional
        Where what was found is kept from job to job, so that the same search made again goes on from there; made where
        there is none.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    Discovery
        With ``verdict``, ``added`` (the effects that account for it), ``parameters`` of the final model in SI units,
        ``status``, ``report()``, ``summary()``, ``to_dataframe()``, ``residuals``, ``plot()``, ``predict(study)`` and
        ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood, or does not show what the rig's motion should.
    StudyError
        If the study and the model do not fit together.
    UsageError
        If the effects to try are not known, or none is left; if the folder cannot be made.

    Examples
    --------
    >>> drop = fibrefit.example("drop_series") / "holdout"
    >>> found = fibrefit.discover(drop, only=["guide.viscous_friction"])
    >>> found.verdict, found.added
    ('nothing_missing', ())
    >>> list(found.to_dataframe().columns)
    ['name', 'record', 'value', 'std_error', 'low', 'high', 'unit']
    """
    study = as_study(study)
    options = SearchOptions(max_effects, tuple(only), tuple(exclude), tuple(also), seed, seconds, least)
    candidates = candidates_of(study, options.only, options.exclude, options.also)
    journal = None if folder is None else _made(Path(folder))
    (progress or quiet)("reading records", None)
    records = read_records(study)
    limits = Limits(max_effects, seed, choose, seconds if choose is None else WITH_A_PERSON, journal, least)
    finding = discover(task_to_fit(study, task_of(study, records)), tuple(candidates.values()), limits, progress)
    return Discovery(study, records, finding, candidates, options, choose is not None)


def _made(folder: Path) -> Path:
    """A folder to keep things in: a search does not end because of it, and so would not say that it keeps nothing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            str(folder), f"cannot be made: {error.strerror}", "a folder to write to", "Name another."
        ) from None
    return folder


WITH_A_PERSON = 86400.0
"""Seconds where a person chooses: to think takes time too."""


def inputs_of(study: Study, options: SearchOptions) -> list[Path]:
    """Every file a search rests on: those of the study, and those with effects of the user's own."""
    return list(dict.fromkeys([*study.input_files(), *own_laws(study, options)]))


def own_laws(study: Study, options: SearchOptions) -> list[Path]:
    """Files with effects of the user's own that a search is told to try."""
    files = [name.rpartition(":")[0] for name in (*options.only, *options.also) if ".py:" in name]
    return list(dict.fromkeys(map(study.path_of, files)))


def finished(folder: Path, study: Study, options: SearchOptions) -> DiscoverySummary | None:
    """Result of the same search in a folder: the same study, files, settings, seed and versions.

    One that was made in as much time is the same, and so is one that says what the time did not suffice for: with more
    it is gone on with. What single steps would have found in more time is not known of another.

    Parameters
    ----------
    folder : pathlib.Path
        Where it may be.
    study : Study
    options : SearchOptions

    Returns
    -------
    DiscoverySummary or None
        None where there is none, or that of another search.
    """
    try:
        summary = read_summary(folder)
    except FibrefitError:
        return None
    if not isinstance(summary, DiscoverySummary) or summary.provenance is None:
        return None
    origin = summary.provenance
    digests = [sha256_of(path) for path in inputs_of(study, options) if path.is_file()]
    now: Mapping[str, object] = {
        "resolved_study": study.resolved_toml(),
        "inputs": sorted(digests),
        "settings": replace(options, seconds=SECONDS).as_settings(),
        "seed": options.seed,
        "versions": versions(),
    }
    then = {name: getattr(origin, name) for name in now} | {"inputs": sorted(origin.inputs.values())}
    then["settings"] = {name: value for name, value in origin.settings.items() if name != TIME}
    given = float(origin.settings.get(TIME, SearchOptions().seconds))
    if options.seconds > given and not (summary.untried or summary.undone):
        return None
    return summary if then == now else None
