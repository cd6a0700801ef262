"""A posterior with what was requested of it: what its summary, its files and its reader take from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from fibrefit.core.errors import refuse_unknown
from fibrefit.sampling.nuts import CrossCheck
from fibrefit.sampling.posterior import Marginal, Posterior, status
from fibrefit.sampling.predict import Bands, CrossValidation
from fibrefit.sampling.settings import AS_A_FIT, NOISE_KINDS
from fibrefit.study import Study
from fibrefit.study.summaries.check import Check, Status
from fibrefit.study.summaries.results import ComparedModel
from fibrefit.workflow.compare import Rival, compared
from fibrefit.workflow.sampling.start import SamplingStart


@dataclass(frozen=True)
class SamplingOptions:
    """What was requested of a run beside the settings of the sampler.

    Parameters
    ----------
    noise : str
        One of `NOISE_KINDS`.
    heavy : bool
        Student's t instead of a normal likelihood.
    nuts : bool
        Cross-check with NUTS.
    compare : tuple of str
        Folders of other posteriors of the same data.
    """

    noise: str = AS_A_FIT
    heavy: bool = False
    nuts: bool = False
    compare: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a noise that nobody knows, before the fit that comes first."""
        refuse_unknown("noise", self.noise, NOISE_KINDS)


@dataclass(frozen=True, repr=False)
class Findings:
    """The posterior of a study, and all that was requested of it.

    Parameters
    ----------
    start : Start
        The fit around which the walkers are initialised.
    bands : mapping of channel to Bands
        Posterior predictive bands of the records.
    cross_validation : CrossValidation
        Predictive performance on blocks left out.
    cross_check : CrossCheck or None
        With NUTS.
    """

    study: Study
    start: SamplingStart
    posterior: Posterior
    bands: Mapping[str, Bands]
    cross_validation: CrossValidation
    cross_check: CrossCheck | None
    rivals: tuple[Rival, ...]
    options: SamplingOptions

    @cached_property
    def checks(self) -> tuple[Check, ...]:
        """All checks: the posterior's checks, the fit before it, and the cross-check with NUTS."""
        more = (
            *self.start.checks(),
            *((self.cross_check.check(self.posterior.target.names),) if self.cross_check else ()),
        )
        return (*self.posterior.checks, *more)

    @property
    def status(self) -> Status:
        """``ok``, ``suspect`` or ``failed``."""
        return status(self.checks)  # type: ignore[return-value]

    @property
    def parameters(self) -> dict[str, Marginal]:
        """Marginals of what all records share, noise included, by name; SI units."""
        names = self.posterior.density.problem.layout.records
        of_records = tuple(f"[{name}]" for name in names)
        return {name: found for name, found in self.posterior.marginals.items() if not name.endswith(of_records)}

    @cached_property
    def compared(self) -> tuple[ComparedModel, ...]:
        """The model against its rivals."""
        own, evidence, noise = self.cross_validation, self.posterior.log_evidence, self.posterior.noise_model.kind
        return tuple(compared(own, evidence, rival, noise) for rival in self.rivals)
