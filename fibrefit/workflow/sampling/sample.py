"""``sample``: a study in, the joint posterior of its parameters out, and its files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.core.limits import Progress, quiet
from fibrefit.core.threads import one_blas_thread
from fibrefit.problem import Task
from fibrefit.sampling.density.prior import Priors
from fibrefit.sampling.nuts import cross_check, require_nuts
from fibrefit.sampling.predict import CrossValidation, cross_validate, predict
from fibrefit.sampling.sample import ChainStart, PosteriorRequest, number_of_coordinates, sample_posterior
from fibrefit.sampling.settings import AS_A_FIT, Settings
from fibrefit.store.summary import files_of_result, provenance
from fibrefit.study import PriorSetting, Study, as_study
from fibrefit.study.summaries.results import PosteriorSummary
from fibrefit.workflow.compare import refuse_other_readings, rival_of
from fibrefit.workflow.fit import Fit
from fibrefit.workflow.prediction.predicts import Predicts
from fibrefit.workflow.prepare import read_records, task_of, task_to_fit
from fibrefit.workflow.sampling.files import groups_of, posterior_summary
from fibrefit.workflow.sampling.found import Findings, SamplingOptions
from fibrefit.workflow.sampling.progress import followed
from fibrefit.workflow.sampling.start import CHAINS, begin, digest_of

if TYPE_CHECKING:
    from fibrefit.plots.figures import Figures
    from fibrefit.study.summaries.part import Variable

BUDGET = ("max_steps", "max_seconds", "checkpoint_seconds", "threads", "r_hat", "r_hat_walkers", "ess", "interval")
"""Settings that say when a run ends and what is reported of it: a run may go on with others."""


def identity(options: SamplingOptions, settings: Settings) -> str:
    """All that makes a run what it is, and that must stay the same when it goes on."""
    fixed = {field.name: getattr(settings, field.name) for field in fields(settings) if field.name not in BUDGET}
    return repr(sorted({**fixed, "noise": options.noise, "heavy": options.heavy}.items()))


def files_compared(options: SamplingOptions) -> list[Path]:
    """Files of the posteriors that one is to be compared with."""
    return [file for rival in options.compare for file in files_of_result(Path(rival))]


class Sampled(Findings, Predicts):
    """The posterior of a study, to be read, drawn and saved."""

    def inputs(self) -> list[Path]:
        """Files of the study, and of the posteriors it was compared with, which may be gone by now."""
        there = tuple(one for one in self.options.compare if Path(one).exists())
        return [*super().inputs(), *files_compared(replace(self.options, compare=there))]

    def summary(self) -> PosteriorSummary:
        """Content of ``summary.json``."""
        settings = {
            name: str(value) for name, value in {**asdict(self.options), **asdict(self.posterior.settings)}.items()
        }
        del settings["seed"]
        origin = provenance(
            self.study,
            self.inputs(),
            seed=self.posterior.settings.seed,
            seconds=self.posterior.seconds,
            settings=settings,
        )
        return posterior_summary(self, origin)

    def groups(self) -> dict[str, dict[str, Variable]]:
        """Arrays of ``result.h5``."""
        return self._arrays

    @cached_property
    def _arrays(self) -> dict[str, dict[str, Variable]]:
        return groups_of(self)

    def plot_corner(self, *names: str) -> Figures:
        """Joint distribution of every two of some values: all that records share, unless named.

        Parameters
        ----------
        *names : str
            Such as ``"stiffness"``; a value of one record is ``"release[drop_5mm.csv]"``.

        Returns
        -------
        Figures
            By name: ``corner``.

        Raises
        ------
        UsageError
            If there is no value of that name.

        Examples
        --------
        >>> list(posterior.plot_corner("stiffness", "damping"))
        ['corner']
        """
        from fibrefit.plots.posterior import corner_figures

        return corner_figures(self.summary(), self.groups(), names)

    def plot_traces(self, *names: str) -> Figures:
        """Traces of each ensemble and rank plots: of all that records share, unless named.

        Parameters
        ----------
        *names : str
            Such as ``"stiffness"``; a value of one record is ``"release[drop_5mm.csv]"``.

        Returns
        -------
        Figures
            By name: ``traces``.

        Raises
        ------
        UsageError
            If there is no value of that name.

        Examples
        --------
        >>> list(posterior.plot_traces("stiffness"))
        ['traces']
        """
        from fibrefit.plots.posterior import trace_figures

        return trace_figures(self.summary(), self.groups(), names)

    def plot_bands(self, *records: str) -> Figures:
        """Posterior predictive bands against what was measured, for all records unless named.

        Parameters
        ----------
        *records : str
            Names of records.

        Returns
        -------
        Figures
            By ``record <name>``.

        Raises
        ------
        UsageError
            If there is no record of that name.

        Examples
        --------
        >>> list(posterior.plot_bands("drop_14mm_60deg.csv"))
        ['record drop_14mm_60deg.csv']
        """
        from fibrefit.plots.posterior import band_figures

        return band_figures(self.groups(), records)

    def plot_prior(self, *names: str) -> Figures:
        """Prior against posterior, for all that records share unless named.

        Parameters
        ----------
        *names : str
            Such as ``"stiffness"``; a value of one record is ``"release[drop_5mm.csv]"``.

        Returns
        -------
        Figures
            By name: ``prior``.

        Raises
        ------
        UsageError
            If there is no value of that name.

        Examples
        --------
        >>> list(posterior.plot_prior("stiffness"))
        ['prior']
        """
        from fibrefit.plots.posterior import prior_figures

        return prior_figures(self.summary(), self.groups(), names)


def settings_of(requested: Mapping[str, Any]) -> Settings:
    """Settings of the sampler by name.

    Raises
    ------
    UsageError
        If one is not known, or cannot work.
    """
    known = [field.name for field in fields(Settings)]
    for name in requested:
        if name not in known:
            raise UsageError(f'setting "{name}"', "not known", f"one of {', '.join(known)}", did_you_mean(name, known))
    return Settings(**requested)


@one_blas_thread
def sample(
    study: Study | str | Path, *, start: Fit | None = None, seed: int = 0, noise: str = AS_A_FIT,
    student_t: bool = False, heavy: bool = False, nuts: bool = False, compare: Sequence[str | Path] = (),
    checkpoint: str | Path | None = None, progress: Progress | None = None, **settings: Any,
) -> Sampled:  # fmt: skip
    """Sample the joint posterior of a study's parameters until independent ensembles of walkers agree.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        A path is that of a study file, or of a folder with a ``study.toml``.
    start : Fit, optional
        Fit of the same study and records, around which the walkers are initialised; made where there is none.
    seed : int
        Of all random numbers; the same seed gives the same draws.
    noise : str
        Noise spectrum: ``"fit"``, that of a fit; ``"auto"``, the kind that explains the residuals best; or one kind, as
        the option ``--noise`` lists them, with the spectra of the rests if it is made of spectra and all channels have
        one.
    student_t, heavy : bool
        Student's t (heavy-tailed) likelihood instead of a normal one; `heavy` is its earlier name.
    nuts : bool
        Cross-check with the No-U-Turn sampler (NUTS); needs the extra ``nuts``.
    compare : sequence of str or pathlib.Path
        Folders of other posteriors of the same records.
    checkpoint : str or pathlib.Path, optional
        Folder in which the chains are kept while they grow; a run that finds its own there goes on with them.
    progress : callable, optional
        Called with what is being done and the share that is finished.
    **settings : int or float
        As on the command line: ``ess``, effective sample size of each value (400); ``r_hat`` below which ensembles
        agree (1.01); ``max_steps`` (4000); ``max_seconds`` of each mode (none); ``ensembles``, 4 or more (4);
        ``walkers`` of each ensemble, an even number (as many as are needed); ``interval``, probability of the intervals
        (0.95).

    Returns
    -------
    Sampled
        With ``parameters``, ``draws``, ``status``, ``report()``, ``summary()``, ``to_dataframe()``, ``to_datatree()``
        for ArviZ, ``predict(study)``, ``plot()``, ``plot_corner()``, ``plot_traces()``, ``plot_bands()``,
        ``plot_prior()`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood, or does not show what the rig's motion should.
    StudyError, UsageError
        If study, model and priors do not fit together; if a setting cannot work, or a package is missing; if `start` or
        what `checkpoint` holds is of another study or other records.

    Examples
    --------
    A first look at one record; numbers to be used take the settings as they are.

    >>> drop = fibrefit.example("drop_series") / "holdout"
    >>> posterior = fibrefit.sample(drop, noise="white", ess=50, max_steps=200, r_hat=1.2)
    >>> low, high = posterior.parameters["stiffness"].interval
    >>> bool(low < posterior.draws["stiffness"].mean() < high)
    True
    >>> sorted(set(posterior.to_datatree().children) & {"posterior", "log_likelihood"})
    ['log_likelihood', 'posterior']
    """
    options = SamplingOptions(noise, heavy or student_t, nuts, tuple(map(str, compare)))
    requested = settings_of({"seed": seed, **settings})
    return sample_study(
        as_study(study), start=start, settings=requested, options=options, folder=checkpoint, progress=progress
    )


def sample_study(
    study: Study,
    *,
    start: Fit | None = None,
    settings: Settings | None = None,
    options: SamplingOptions | None = None,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> Sampled:
    """As `sample`, by settings and options as objects; chains that are in `folder` go on.

    Raises
    ------
    DataError, StudyError, UsageError
        As `sample`; and if the chains of the folder belong to another run.
    """
    settings, options, on_progress = settings or Settings(), options or SamplingOptions(), progress or quiet
    if options.nuts:
        require_nuts()
    on_progress("reading records", None)
    records = read_records(study)
    task = task_to_fit(study, task_of(study, records))
    settings.walkers_for(number_of_coordinates(task, options.heavy))  # refused before the fit, not after it
    rivals = tuple(rival_of(Path(rival), study) for rival in options.compare)
    for rival in rivals:
        refuse_other_readings(rival, task.problem)
    stated = _stated(study, task)
    kept = None if folder is None else Path(folder)
    begun = begin(digest_of(study, records), task, start, settings.seed, kept, on_progress)
    posterior = sample_posterior(
        task,
        ChainStart(begun.plain, begun.coefficients, begun.basins, begun.values),
        PosteriorRequest(options.noise, options.heavy, settings),
        stated=stated,
        checkpoint_file=None if kept is None else kept / CHAINS,
        progress=followed(on_progress, settings),
    )
    return _evaluated(Sampled(study, begun, posterior, {}, _NOTHING, None, rivals, options), on_progress)


def _stated(study: Study, task: Task) -> dict[str, PriorSetting]:
    """Priors of the study, seen to be possible before any long work."""
    settings = study.settings({parameter.name: parameter for parameter in task.problem.model.parameters})
    stated = {name: setting.prior for name, setting in settings.items() if setting.prior is not None}
    Priors.of(task.problem.layout, task.problem.model, task.start, stated)
    return stated


def _evaluated(found: Sampled, on_progress: Progress) -> Sampled:
    """The posterior with its predictions, its cross-validation and the cross-check with NUTS."""
    posterior, seed = found.posterior, found.posterior.settings.seed
    on_progress("predicting the records", None)
    bands, ahead = predict(posterior, seed=seed), cross_validate(posterior, seed=seed)
    nuts = cross_check(posterior, seed=seed, progress=on_progress) if found.options.nuts else None
    return replace(found, bands=bands, cross_validation=ahead, cross_check=nuts)


_NOTHING = CrossValidation(np.zeros(0), np.zeros(0), 0.0)
