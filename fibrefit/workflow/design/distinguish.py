"""``distinguish``: which effects the records of a study can distinguish, measured or only planned."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fibrefit.core.limits import Progress, quiet
from fibrefit.core.threads import one_blas_thread
from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.distinguish import Confusion, best_split, confusion
from fibrefit.discovery.design.grams import as_simulated
from fibrefit.discovery.engine.thresholds import NOISE_LIKE, gate
from fibrefit.discovery.search.setup import set_up
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification, total
from fibrefit.fitting.thresholds import FEW_STARTS
from fibrefit.report.sentences.discovery import worded_separation
from fibrefit.report.sentences.thresholds import CONFOUNDED
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.check import SIZE, Status
from fibrefit.study.summaries.discovery import DistinguishSummary, Separation
from fibrefit.workflow.design.doubts import doubts_of_fit
from fibrefit.workflow.discovery.candidates import candidates_of, is_lasting
from fibrefit.workflow.prepare import is_planned, task_of, task_to_fit
from fibrefit.workflow.saved import FoundResult


@dataclass(frozen=True, repr=False)
class Distinguished(FoundResult):
    """What the records of a study can show and distinguish.

    Parameters
    ----------
    study : Study
    confusion : Confusion
    split : Separation or None
        The further record that best tells the worst pair apart.
    remarks : tuple of str
        What a reader should know besides.
    status : {"ok", "suspect", "failed"}
        Of the fit of the records at hand.
    seconds : float, optional
    """

    study: Study
    confusion: Confusion
    split: Separation | None
    remarks: tuple[str, ...] = ()
    status: Status = "ok"
    seconds: float | None = None

    def summary(self) -> DistinguishSummary:
        """Content of ``summary.json``."""
        found = self.confusion
        return DistinguishSummary(
            status=self.status,
            study=self.study.name,
            rig=self.study.kind,
            records=tuple(record.label for record in self.study.records),
            planned=is_planned(self.study),
            remarks=self.remarks,
            effects=found.directions,
            cosine=tuple(map(tuple, found.cosine.tolist())),
            cannot_tell_apart=found.inseparable,
            cannot_see=found.invisible,
            best_further_record=self.split and worded_separation(self.split),
            provenance=provenance(self.study, self.study.input_files(), seconds=self.seconds),
        )


@one_blas_thread
def distinguish_study(
    study: Study | str | Path,
    *,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    progress: Progress | None = None,
) -> Distinguished:
    """Compare the sensitivities of the records of a study, measured or only planned, to every effect.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        Of planned records, it needs initial values of the base parameters.
    only, exclude : sequence of str
        Names or patterns such as ``guide.*``. Effects of single records count only where they are named.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    Distinguished
        With ``confusion`` (detection limit of each effect, and the absolute cosine of the sensitivities of any two),
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
    >>> drop = fibrefit.example("drop_series") / "holdout"
    >>> found = fibrefit.distinguish(drop, only=["guide.viscous_friction", "guide.stribeck_friction"])
    >>> found.to_dataframe()["effect"].tolist()
    ['guide.viscous_friction', 'guide.stribeck_friction']
    """
    began, study = time.perf_counter(), as_study(study)
    on_progress = progress or quiet
    candidates = candidates_of(study, only=tuple(only), exclude=tuple(exclude))
    candidates = {name: effect for name, effect in candidates.items() if only or is_lasting(effect)}
    task = task_of(study)
    fit = None if is_planned(study) else identify(task_to_fit(study, task), FEW_STARTS, progress=on_progress)
    search = set_up(task, fit, tuple(candidates.values()), on_progress)
    base = search.base
    on_progress("comparing the sensitivities to the effects", None)
    remarks, louder = ((), 1.0) if fit is None else _beyond_noise(fit)
    limit = lambda parameters: gate(parameters, louder)  # noqa: E731
    supermodel = search.inference.common_noise.whitened(base.supermodel)
    if fit is None:  # nothing is measured
        supermodel = as_simulated(supermodel, base.fit.local, search.context.whole)
    beside = Beside(scatter={} if fit is None else {name: one.sd for name, one in fit.between.items()})
    found = confusion(supermodel, search.context, base.fit.local, search.effects, limit, beside)
    split, known = None, {effect.name: effect for effect in search.effects}
    if pairs := found.pairs(CONFOUNDED):
        split = best_split(search, supermodel, [known[name] for name in pairs[0][:2]], found, beside, louder)
    status = "ok" if fit is None else fit.status
    remarks += doubts_of_fit(fit, (SIZE,) if remarks else ())
    return Distinguished(study, found, split, remarks, status, time.perf_counter() - began)


def _beyond_noise(fit: Identification) -> tuple[tuple[str, ...], float]:
    """Remark on records whose residual exceeds noise, and its power where effects act, in units of the noise."""
    gap = total(fit.gap)
    if gap <= NOISE_LIKE * fit.expected_gap:
        return (), 1.0
    times = gap * max(fit.error_inflation, 1.0)
    said = f"The normalised residual RMS is {gap:.3g}, expected {fit.expected_gap:.3g}, which drowns weak effects"
    return (f"{said}: detection limits are {times:,.0f} times those under noise alone.",), times**2
