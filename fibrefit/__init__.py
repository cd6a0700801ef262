"""Identify mechanical models of fibres, cables and their rigs from measured records.

Examples
--------
>>> import fibrefit
>>> study = fibrefit.load_study("configs/drop_series")
>>> result = fibrefit.fit(study)
>>> print(result.report())
>>> result.parameters["stiffness"].interval_95
>>> result.plot()["snaps"].savefig("snaps.pdf")
>>> result.save("results/drop_series")
>>> posterior = fibrefit.sample(study, start=result)
>>> posterior.plot_corner()

All numbers are in SI units. To import the package costs next to nothing; what it needs comes with the first call.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from fibrefit.core.environment import configure_jax as _configure_jax

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fibrefit.records import Record
    from fibrefit.study import Study
    from fibrefit.workflow import Confused, Discovery, Fit, Sampled, Simulation, Sweep

__all__ = ["confuse", "discover", "fit", "load_study", "read_record", "sample", "simulate", "sweep"]

# JAX reads these settings once; every module of the package is imported after this line.
_configure_jax()


def load_study(path: str | Path, overrides: Sequence[str] = ()) -> Study:
    """Read a study.

    Parameters
    ----------
    path : str or pathlib.Path
        A study file, or a folder with a ``study.toml``.
    overrides : sequence of str
        Changes to it, as on the command line: ``'rig.weight_mass="3.1 kg"'``.

    Returns
    -------
    Study
        Complete, in SI units; it cannot be changed.

    Raises
    ------
    StudyError
        If it is not valid: where, what was found, what was expected.

    Examples
    --------
    >>> study = fibrefit.load_study("configs/drop_series")
    >>> study.records[0].lift
    0.005
    """
    from fibrefit import study

    return study.load_study(path, overrides)


def read_record(path: str | Path, **how: Any) -> Record:
    """Read one measured record.

    Parameters
    ----------
    path : str or pathlib.Path
        Text of any logger, LVM or MATLAB; TDMS and MDF4 with the extra of that name.
    **how
        What the file does not say itself; see `fibrefit.records.read_record`. ``channels={"force": "F [N]"}`` names
        columns, ``units={"force": "N"}`` their units, ``rate=2000.0`` the sampling rate in Hz.

    Returns
    -------
    Record
        Channels in SI units, damaged samples NaN; it cannot be changed.

    Raises
    ------
    DataError
        If the file cannot be read, or not in one way only.

    Examples
    --------
    >>> record = fibrefit.read_record("drop_10mm_90deg.csv")
    >>> record.channels["force"].max(), record.rate
    """
    from fibrefit import records

    return records.read_record(path, **how)


def fit(
    study: Study,
    *,
    starts: int = 32,
    seed: int = 0,
    robust: bool = False,
    profile: bool = False,
    progress: Callable[[str, float | None], None] | None = None,
) -> Fit:
    """Identify the model of a study from its records by least squares.

    Parameters
    ----------
    study : Study
    starts : int
        Number of starts of the search.
    seed : int
        Of the scatter of starts; the same seed gives the same result.
    robust : bool
        Let residuals beyond three times the noise count less (soft L1).
    profile : bool
        Replace the normal intervals of shared parameters by profile-likelihood ones.
    progress : callable, optional
        Told what is being done and the share that is finished.

    Returns
    -------
    Fit
        With ``parameters``, ``status``, ``report()``, ``summary()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood, or does not show what the rig's motion should.
    StudyError
        If the study and the model do not fit together.

    Examples
    --------
    >>> result = fibrefit.fit(fibrefit.load_study("configs/drop_series"))
    >>> stiffness = result.parameters["stiffness"]
    >>> print(stiffness.value, stiffness.std_error, stiffness.unit)
    >>> result.status
    'ok'
    """
    from fibrefit.workflow import fit_study

    return fit_study(study, starts=starts, seed=seed, robust=robust, profile=profile, progress=progress)


def sample(
    study: Study,
    *,
    start: Fit | None = None,
    seed: int = 0,
    noise: str = "auto",
    heavy: bool = False,
    nuts: bool = False,
    compare: Sequence[str | Path] = (),
    checkpoint: str | Path | None = None,
    progress: Callable[[str, float | None], None] | None = None,
    **settings: Any,
) -> Sampled:
    """Sample the joint posterior of a study's parameters until independent ensembles of walkers agree.

    Parameters
    ----------
    study : Study
    start : Fit, optional
        Fit of the same study, around which the walkers begin; made where there is none.
    seed : int
        Of all random numbers; the same seed gives the same draws.
    noise : {"auto", "white", "autoregressive", "coloured"}
        Colour of the noise; ``"auto"`` lets the residuals of the fit choose.
    heavy : bool
        Student's t instead of a normal law, for records in which single samples stray.
    nuts : bool
        Ask the No-U-Turn sampler for a second opinion; needs the extra ``nuts``.
    compare : sequence of str or pathlib.Path
        Folders of other posteriors of the same records.
    checkpoint : str or pathlib.Path, optional
        Folder in which the chains are kept while they grow; a run that finds its own there goes on with them.
    progress : callable, optional
        Told what is being done and the share that is finished.
    **settings
        ``ess``, ``r_hat``, ``max_steps``, ``max_seconds``, ``ensembles``, ``walkers``, ``interval``, as on the
        command line; see `fibrefit.sample.settings.Settings`.

    Returns
    -------
    Sampled
        With ``parameters``, ``draws``, ``status``, ``report()``, ``summary()``, ``plot()``, ``plot_corner()``,
        ``plot_traces()``, ``plot_bands()``, ``plot_prior()`` and ``save(folder)``.

    Examples
    --------
    >>> posterior = fibrefit.sample(study, start=fibrefit.fit(study))
    >>> posterior.parameters["stiffness"].interval, posterior.draws["stiffness"].mean()
    """
    from fibrefit.workflow.sample import Options, sample_study, settings_of

    options = Options(noise, heavy, nuts, tuple(map(str, compare)))
    asked = settings_of({"seed": seed, **settings})
    return sample_study(study, start=start, settings=asked, options=options, folder=checkpoint, progress=progress)


def discover(
    study: Study,
    *,
    max_effects: int = 3,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    also: Sequence[str] = (),
    seed: int = 0,
    choose: Callable[[Sequence[Any]], str | None] | None = None,
    progress: Callable[[str, float | None], None] | None = None,
) -> Discovery:
    """Find what the model of a study lacks: where it goes wrong, which effect accounts for it, what is left then.

    Parameters
    ----------
    study : Study
    max_effects : int
        Most effects that are added.
    only : sequence of str
        Try nothing but these: names of the catalogue, patterns such as ``guide.*``, or ``my_effects.py:MyEffect``.
    exclude : sequence of str
        Names or patterns to leave out.
    also : sequence of str
        Effects of your own, tried beside those of the catalogue.
    seed : int
        Of the scatter of starts; the same seed gives the same result.
    choose : callable, optional
        Given the candidates of a round, best first, names the effect to add, or None to add no more.
    progress : callable, optional
        Told what is being done and the share that is finished.

    Returns
    -------
    Discovery
        With ``verdict``, ``added``, ``parameters``, ``final`` (study of the final model), ``finding``, ``report()``,
        ``summary()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood, or does not show what the rig's motion should.
    StudyError
        If the study and the model do not fit together.
    UsageError
        If the effects to try are not known, or none is left.

    Examples
    --------
    >>> found = fibrefit.discover(fibrefit.load_study("configs/drop_series"))
    >>> found.verdict
    'nothing_missing'
    """
    from fibrefit.workflow import discover_study

    tried = {"only": only, "exclude": exclude, "also": also}
    return discover_study(study, max_effects=max_effects, **tried, seed=seed, choose=choose, progress=progress)


def confuse(
    study: Study,
    *,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    progress: Callable[[str, float | None], None] | None = None,
) -> Confused:
    """Compare what every effect would do to the records of a study, measured or only planned.

    Parameters
    ----------
    study : Study
        Of planned records, it needs initial values of the base parameters.
    only, exclude : sequence of str
        Names or patterns such as ``guide.*``.
    progress : callable, optional
        Told what is being done and the share that is finished.

    Returns
    -------
    Confused
        With ``confusion`` (the smallest strength of each effect that would be found, and how alike any two are),
        ``split`` (the further record that tells the worst pair apart), ``report()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood.
    StudyError
        If the study and the model do not fit together.
    UsageError
        If the effects to compare are not known, or none is left.

    Examples
    --------
    >>> print(fibrefit.confuse(fibrefit.load_study("configs/drop_series")).report())
    """
    from fibrefit.workflow import confuse_study

    return confuse_study(study, only=only, exclude=exclude, progress=progress)


def simulate(study: Study) -> Simulation:
    """Simulate every record of a study at the study's initial values.

    Parameters
    ----------
    study : Study
        Parameters without an `initial` take the value the records themselves suggest.

    Returns
    -------
    Simulation
        With ``readings``, ``table(record)``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood.
    StudyError
        If the study and the model do not fit together.

    Examples
    --------
    >>> study = fibrefit.load_study("configs/drop_series", ['parameters.stiffness.initial="20 kN/m"'])
    >>> fibrefit.simulate(study).readings["force"].max()
    """
    from fibrefit.workflow import simulate_study

    return simulate_study(study)


def sweep(study: Study, *, progress: Callable[[str, float | None], None] | None = None) -> Sweep:
    """Swing the inverted pendulum of a study over the frequencies of its ``[sweep]``.

    Parameters
    ----------
    study : Study
        Of an inverted pendulum whose base parameters have initial values.
    progress : callable, optional
        Told what is being done and the share that is finished.

    Returns
    -------
    Sweep
        With ``curves``, ``summary()``, ``report()``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    UsageError
        If the study is of another rig.
    StudyError
        If a parameter has no initial value, or a curve no amplitude.

    Examples
    --------
    >>> study = fibrefit.load_study("configs/pendulum", ["sweep.lowest=4 Hz", "sweep.highest=5 Hz"])
    >>> print(fibrefit.sweep(study).report())
    """
    from fibrefit.workflow import sweep_study

    return sweep_study(study, progress=progress)


class _Root(ModuleType):
    """The package itself, in which a name that people call is never replaced by the package of the same name.

    The import system binds ``fibrefit.fit`` to the package of that name once anything in it is imported. From there,
    things are imported with ``from fibrefit.fit.solve import descend``.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Root
