"""Identify mechanical models of fibres, cables and their rigs from measured records.

Examples
--------
>>> import fibrefit
>>> study = fibrefit.load_study(fibrefit.example("drop_series"))
>>> result = fibrefit.fit(study, starts=4)
>>> result.status
'ok'
>>> round(result.parameters["stiffness"].value / 1e3, 1)
11.2
>>> result.to_dataframe().columns.tolist()
['name', 'record', 'value', 'std_error', 'low', 'high', 'unit']

All numbers are in SI units. To import the package costs next to nothing; what it needs comes with the first call.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fibrefit.core.environment import configure_jax as _configure_jax

if TYPE_CHECKING:
    from fibrefit.records.read import read_record
    from fibrefit.rigs.effects import described_effects as effects
    from fibrefit.study.load import example, examples, load_study
    from fibrefit.workflow.batches.run import batch
    from fibrefit.workflow.design.distinguish import distinguish_study as confuse
    from fibrefit.workflow.design.distinguish import distinguish_study as distinguish
    from fibrefit.workflow.design.plan import plan_study as plan
    from fibrefit.workflow.discovery.discover import discover_study as discover
    from fibrefit.workflow.fit import fit_study as fit
    from fibrefit.workflow.inspection.inspection import inspect
    from fibrefit.workflow.outcome.stored import load_result, read_batch
    from fibrefit.workflow.prediction.predict import predict_study as predict
    from fibrefit.workflow.sampling.sample import sample
    from fibrefit.workflow.simulate import simulate_study as simulate
    from fibrefit.workflow.sweep import sweep_study as sweep
    from fibrefit.workflow.together.series import series_study as series_of

__all__ = [
    "batch",
    "confuse",
    "discover",
    "distinguish",
    "effects",
    "example",
    "examples",
    "fit",
    "inspect",
    "load_result",
    "load_study",
    "plan",
    "predict",
    "read_batch",
    "read_record",
    "sample",
    "series_of",
    "simulate",
    "sweep",
]

#: Where each public function lives; it is imported when it is first used.
_HOMES = {
    "batch": "fibrefit.workflow.batches.run:batch",
    "effects": "fibrefit.rigs.effects:described_effects",
    "example": "fibrefit.study.load:example",
    "examples": "fibrefit.study.load:examples",
    "inspect": "fibrefit.workflow.inspection.inspection:inspect",
    "load_result": "fibrefit.workflow.outcome.stored:load_result",
    "read_batch": "fibrefit.workflow.outcome.stored:read_batch",
    "confuse": "fibrefit.workflow.design.distinguish:distinguish_study",
    "distinguish": "fibrefit.workflow.design.distinguish:distinguish_study",
    "discover": "fibrefit.workflow.discovery.discover:discover_study",
    "fit": "fibrefit.workflow.fit:fit_study",
    "load_study": "fibrefit.study.load:load_study",
    "plan": "fibrefit.workflow.design.plan:plan_study",
    "predict": "fibrefit.workflow.prediction.predict:predict_study",
    "read_record": "fibrefit.records.read:read_record",
    "sample": "fibrefit.workflow.sampling.sample:sample",
    "series_of": "fibrefit.workflow.together.series:series_study",
    "simulate": "fibrefit.workflow.simulate:simulate_study",
    "sweep": "fibrefit.workflow.sweep:sweep_study",
}

# JAX reads these settings once; every module of the package is imported after this line.
_configure_jax()


def __getattr__(name: str) -> Any:
    """A public function, from the module that holds it."""
    from importlib import import_module

    if name == "__version__":
        from importlib.metadata import version

        return version("fibrefit")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, function = _HOMES[name].partition(":")
    globals()[name] = found = getattr(import_module(module), function)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
