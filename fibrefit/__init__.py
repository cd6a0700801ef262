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

from typing import TYPE_CHECKING, Any

from fibrefit.core.environment import configure_jax as _configure_jax

if TYPE_CHECKING:
    from fibrefit.records.read import read_record
    from fibrefit.study.load import load_study
    from fibrefit.workflow.confuse import confuse_study as confuse
    from fibrefit.workflow.confuse import confuse_study as distinguish
    from fibrefit.workflow.discovery.discover import discover_study as discover
    from fibrefit.workflow.fit import fit_study as fit
    from fibrefit.workflow.prediction.predict import predict_study as predict
    from fibrefit.workflow.sampling.sample import sample
    from fibrefit.workflow.simulate import simulate_study as simulate
    from fibrefit.workflow.sweep import sweep_study as sweep

__all__ = [
    "confuse",
    "discover",
    "distinguish",
    "fit",
    "load_study",
    "predict",
    "read_record",
    "sample",
    "simulate",
    "sweep",
]

#: Where each public function lives; it is imported when it is first asked for.
_HOMES = {
    "confuse": "fibrefit.workflow.confuse:confuse_study",
    "distinguish": "fibrefit.workflow.confuse:confuse_study",
    "discover": "fibrefit.workflow.discovery.discover:discover_study",
    "fit": "fibrefit.workflow.fit:fit_study",
    "load_study": "fibrefit.study.load:load_study",
    "predict": "fibrefit.workflow.prediction.predict:predict_study",
    "read_record": "fibrefit.records.read:read_record",
    "sample": "fibrefit.workflow.sampling.sample:sample",
    "simulate": "fibrefit.workflow.simulate:simulate_study",
    "sweep": "fibrefit.workflow.sweep:sweep_study",
}

# JAX reads these settings once; every module of the package is imported after this line.
_configure_jax()


def __getattr__(name: str) -> Any:
    """A public function, from the module that holds it."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, function = _HOMES[name].partition(":")
    globals()[name] = found = getattr(import_module(module), function)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
