"""A problem with all that a method of identification needs besides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import jax
import numpy as np

from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.observations import Steps
from fibrefit.problem.statement.problem import Problem
from fibrefit.rigs.signals.trace import Trace


@dataclass(frozen=True)
class Task:
    """What is to be identified, and where to begin.

    Parameters
    ----------
    traces : tuple of Trace
        The records behind the problem.
    start : (n_free,) in SI units
    spread : mapping of name to factor
        A shared parameter is searched between start / factor and start * factor.
    horizons : (n_way, n_stage, n_record) int
        Samples of each record in horizons that grow to the whole record, in several ways.
    noise : mapping of channel to Noise
    input_noise : mapping of input to Noise
    noise_given : tuple of str
        Channels whose noise the study states. Its colour is that of the rests.
    units : mapping of channel to str
        SI unit of each channel.
    steps : mapping of channel to Steps
        Of channels that are read in coarse steps. The problem takes errors of rounding for noise, as a search from far
        away has to; the last step of a fit has their likelihood.
    stated_over_rest : mapping of channel to float
        Of channels whose noise the study states: the stated one over that of the rests, both rms.
    """

    problem: Problem
    traces: tuple[Trace, ...]
    start: np.ndarray
    spread: Mapping[str, float]
    horizons: np.ndarray
    noise: Mapping[str, Noise]
    input_noise: Mapping[str, Noise]
    noise_given: tuple[str, ...]
    units: Mapping[str, str]
    steps: Mapping[str, Steps] = field(default_factory=dict)
    stated_over_rest: Mapping[str, float] = field(default_factory=dict)

    @property
    def noisy_inputs(self) -> tuple[str, ...]:
        """Inputs that were measured with noise."""
        known = {name: self.input_noise.get(name) for name in self.problem.model.rig.inputs}
        return tuple(name for name, noise in known.items() if noise is not None and not noise.silent)

    @property
    def counts(self) -> np.ndarray:
        """The first way, ``(n_stage, n_record)``; its last stage is the whole of each record."""
        return self.horizons[0]

    @property
    def rate(self) -> float:
        """Samples a second of the first record, in Hz."""
        return 1.0 / float(np.diff(np.asarray(self.problem.observations.experiment.times)[0]).mean())

    def of_record(self, record: int) -> Task:
        """The task of a single record, all values its own."""
        problem, layout = self.problem, self.problem.layout
        fixed = lambda slot: () if slot.free and slot.fixed_in(record) is None else (slot.fixed_in(record),)  # noqa: E731
        own = Layout(tuple(replace(slot, fixed=fixed(slot)) for slot in layout.slots), (layout.records[record],))
        mine = slice(record, record + 1)
        part = jax.tree.map(lambda leaf: leaf[mine], problem.observations)
        values = dict(zip(layout.names, np.asarray(layout.local(self.start))[record], strict=True))
        return replace(
            self,
            problem=Problem(problem.model, own, part, problem.soft_beyond),
            traces=self.traces[mine],
            start=np.array([values[slot.name] for slot, _ in own.entries]),
            horizons=self.horizons[..., mine],
            steps=jax.tree.map(lambda leaf: np.asarray(leaf)[mine], dict(self.steps)),
        )
