"""``sample``: a study in, the joint posterior of its parameters out, and its files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fibrefit.core.check import Check
from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.problem.prior import priors_of
from fibrefit.problem.task import Task
from fibrefit.report.posterior import posterior_report
from fibrefit.sample.compare import Foresight, foresight
from fibrefit.sample.nuts import SecondOpinion, require_nuts, second_opinion
from fibrefit.sample.posterior import Marginal, Posterior, status
from fibrefit.sample.predict import Bands, predict
from fibrefit.sample.sample import sample_posterior
from fibrefit.sample.settings import Settings
from fibrefit.store import ResultDirectory
from fibrefit.store.hdf5 import write_result
from fibrefit.store.summary import provenance, write_summary
from fibrefit.study import PriorSetting, Study
from fibrefit.study.summaries import ComparedModel, PosteriorSummary, Status
from fibrefit.workflow.compare import Rival, compared, rival_of
from fibrefit.workflow.fit import Fit
from fibrefit.workflow.prepare import read_records, task_of
from fibrefit.workflow.sample_files import groups_of, posterior_summary
from fibrefit.workflow.sample_start import CHAINS, Start, begin
from fibrefit.workflow.sample_told import Follow, followed

if TYPE_CHECKING:
    from fibrefit.plots import Figures

Progress = Callable[[str, float | None], None]
BUDGET = ("max_steps", "max_seconds", "checkpoint_seconds", "threads", "r_hat", "r_hat_walkers", "ess", "interval")
"""Settings that say when a run ends and what is told of it: a run may go on with others."""


@dataclass(frozen=True)
class Options:
    """What a run was asked for beside the settings of the sampler.

    Parameters
    ----------
    noise : str
        ``auto``, ``white``, ``autoregressive`` or ``coloured``.
    heavy : bool
        Student's t instead of a normal law for single samples.
    nuts : bool
        Ask NUTS for a second opinion.
    compare : tuple of str
        Folders of other posteriors of the same data.
    """

    noise: str = "auto"
    heavy: bool = False
    nuts: bool = False
    compare: tuple[str, ...] = ()


def identity(options: Options, settings: Settings) -> str:
    """All that makes a run what it is, and that must stay the same when it goes on."""
    fixed = {field.name: getattr(settings, field.name) for field in fields(settings) if field.name not in BUDGET}
    return repr(sorted({**fixed, "noise": options.noise, "heavy": options.heavy}.items()))


@dataclass(frozen=True)
class Sampled:
    """The posterior of a study.

    Parameters
    ----------
    study : Study
    start : Start
        What the walkers began around.
    posterior : Posterior
    bands : mapping of channel to Bands
        What it foretells of the records.
    foresight : Foresight
        How well it foretells what was left out.
    opinion : SecondOpinion or None
    rivals : tuple of Rival
    options : Options
    """

    study: Study
    start: Start
    posterior: Posterior
    bands: Mapping[str, Bands]
    foresight: Foresight
    opinion: SecondOpinion | None
    rivals: tuple[Rival, ...]
    options: Options

    @cached_property
    def checks(self) -> tuple[Check, ...]:
        """What the result was put to: the posterior's checks, the fit before it, and the second opinion."""
        more = (self.start.check(), *((self.opinion.check(self.posterior.target.names),) if self.opinion else ()))
        return (*self.posterior.checks, *more)

    @property
    def status(self) -> Status:
        """``ok``, ``suspect`` or ``failed``."""
        return status(self.checks)  # type: ignore[return-value]

    @property
    def parameters(self) -> dict[str, Marginal]:
        """Marginals of what all records share, noise included, by name; SI units."""
        names = self.posterior.density.problem.layout.records
        alone = tuple(f"[{name}]" for name in names)
        return {name: found for name, found in self.posterior.marginals.items() if not name.endswith(alone)}

    @cached_property
    def draws(self) -> dict[str, np.ndarray]:
        """Draws ``(n_ensemble, n_draw)`` of every value by name, in SI units."""
        drawn = self.posterior.draws
        return {name: drawn[..., i] for i, name in enumerate(self.posterior.target.names)}

    @cached_property
    def compared(self) -> tuple[ComparedModel, ...]:
        """The model against its rivals."""
        return tuple(compared(self.foresight, self.posterior.log_evidence, rival) for rival in self.rivals)

    def summary(self) -> PosteriorSummary:
        """Content of ``summary.json``."""
        told = {name: str(value) for name, value in {**asdict(self.options), **asdict(self.posterior.settings)}.items()}
        del told["seed"]
        origin = provenance(
            self.study.resolved_toml(),
            self.study.input_files(),
            seed=self.posterior.settings.seed,
            seconds=self.posterior.seconds,
            settings=told,
        )
        return posterior_summary(self, origin)

    def report(self) -> str:
        """The terminal report, at most 80 columns wide."""
        return posterior_report(self.summary())

    def plot(self) -> Figures:
        """Figures by name: corner, traces, ranks, prior, and each record with its bands."""
        from fibrefit.plots import posterior_figures

        return posterior_figures(self.posterior, self.bands)

    def plot_corner(self, *names: str) -> Figures:
        """Joint distribution of every two of some values: all that records share, unless named."""
        from fibrefit.plots import corner_figures

        return corner_figures(self.posterior, names)

    def plot_traces(self, *names: str) -> Figures:
        """The way of each ensemble and its ranks: of all that records share, unless named."""
        from fibrefit.plots import trace_figures

        return trace_figures(self.posterior, names)

    def plot_bands(self, *records: str) -> Figures:
        """What the posterior foretells against what was measured, for all records unless named."""
        from fibrefit.plots import band_figures

        return band_figures(self.posterior, self.bands, records)

    def plot_prior(self, *names: str) -> Figures:
        """What was believed before against what the data say, for all that records share unless named."""
        from fibrefit.plots import prior_figures

        return prior_figures(self.posterior, names)

    def save(self, out: Path | str, *, force: bool = False) -> Path:
        """Write ``summary.json``, ``result.h5``, ``study.toml`` and the figures, whole or not at all.

        Parameters
        ----------
        out : pathlib.Path or str
            Folder of the result.
        force : bool
            Replace an earlier result there.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        UsageError
            If the folder exists and may not be replaced.
        """
        with ResultDirectory(Path(out), force=force) as directory:
            self.write(directory)
        return directory.out

    def write(self, directory: ResultDirectory) -> None:
        """Write all files into a folder that is being made."""
        from fibrefit.plots import save_figures

        summary = self.summary()
        write_summary(directory.path, summary)
        assert summary.provenance is not None
        groups = groups_of(self)
        write_result(directory.path / "result.h5", summary.schema_name, groups, summary.provenance)
        resolved = self.study.resolved_toml(relative_to=directory.out)
        (directory.path / "study.toml").write_text(resolved, encoding="utf-8")
        save_figures(self.plot(), directory.path / "figures")


def settings_of(asked: Mapping[str, Any]) -> Settings:
    """Settings of the sampler by name.

    Raises
    ------
    UsageError
        If one is not known, or cannot work.
    """
    known = [field.name for field in fields(Settings)]
    for name in asked:
        if name not in known:
            raise UsageError(f'setting "{name}"', "not known", f"one of {', '.join(known)}", did_you_mean(name, known))
    return Settings(**asked)


def sample_study(
    study: Study,
    *,
    start: Fit | None = None,
    settings: Settings | None = None,
    options: Options | None = None,
    folder: str | Path | None = None,
    progress: Follow | None = None,
) -> Sampled:
    """The joint posterior of a study's parameters.

    Parameters
    ----------
    study : Study
    start : Fit, optional
        Fit of the same study; made where there is none.
    settings : Settings, optional
        Of the sampler.
    options : Options, optional
    folder : str or pathlib.Path, optional
        Folder in which the chains are kept while they grow; those that are there already go on.
    progress : callable, optional
        Told what is being done and the share that is finished.

    Raises
    ------
    DataError
        If a record is not understood, or does not show what the rig's motion should.
    StudyError
        If study, model and priors do not fit together.
    UsageError
        If the chains of the folder belong to another run, settings cannot work, or a package is missing.
    """
    settings, options, follow = settings or Settings(), options or Options(), progress or _unheard
    if options.nuts:
        require_nuts()
    follow("reading records", None)
    task = task_of(study, start.records if start is not None else read_records(study))
    rivals = tuple(rival_of(Path(rival), study) for rival in options.compare)
    stated = _stated(study, task)
    kept = None if folder is None else Path(folder)
    begun = begin(study, task, start, settings.seed, kept, follow)
    posterior = sample_posterior(
        task,
        begun.plain,
        stated=stated,
        basins=begun.basins,
        noise=options.noise,
        heavy=options.heavy,
        settings=settings,
        checkpoint_file=None if kept is None else kept / CHAINS,
        resume=True,
        progress=followed(follow, settings),
    )
    return _looked_into(Sampled(study, begun, posterior, {}, _NOTHING, None, rivals, options), follow)


def _stated(study: Study, task: Task) -> dict[str, PriorSetting]:
    """Priors of the study, seen to be possible before any long work."""
    settings = study.settings({parameter.name: parameter for parameter in task.problem.model.parameters})
    stated = {name: setting.prior for name, setting in settings.items() if setting.prior is not None}
    priors_of(task.problem.layout, task.problem.model, task.start, stated)
    return stated


def _looked_into(found: Sampled, follow: Follow) -> Sampled:
    """The posterior with what it foretells, and what NUTS says of it."""
    posterior, seed = found.posterior, found.posterior.settings.seed
    follow("foretelling the records", None)
    bands, ahead = predict(posterior, seed=seed), foresight(posterior, seed=seed)
    opinion = second_opinion(posterior, seed=seed, progress=follow) if found.options.nuts else None
    return replace(found, bands=bands, foresight=ahead, opinion=opinion)


def _unheard(doing: str, share: float | None) -> None:
    """Nobody listens."""


_NOTHING = Foresight(np.zeros(0), np.zeros(0), 0.0)
