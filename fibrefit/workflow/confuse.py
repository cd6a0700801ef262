"""``confuse``: which effects the records of a study could tell apart, measured or only planned."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from fibrefit.discover.begin import laid_out
from fibrefit.discover.confuse import Confusion, Split, best_split, confusion
from fibrefit.discover.evidence import NOISE_LIKE
from fibrefit.discover.search import Search
from fibrefit.fit.identify import identify
from fibrefit.fit.result import Identification, total
from fibrefit.report.confusion import confusion_report
from fibrefit.store import ResultDirectory
from fibrefit.store.files import write_whole
from fibrefit.study import Study
from fibrefit.workflow.candidates import candidates_of
from fibrefit.workflow.prepare import is_planned, task_of
from fibrefit.workflow.saved import Saved, write_figures

if TYPE_CHECKING:
    from fibrefit.plots import Figures

MENU: dict[str, dict[str, tuple[float, ...]]] = {
    "fibre_mass": {
        "lift": (0.005, 0.01, 0.02, 0.04),
        "inclination": (np.pi / 6, np.pi / 4, np.pi / 2),
        "added_mass": (0.0, 5.035),
    },
    "pulley_drive": {"added_mass": (0.0, 2.5, 5.035, 10.0), "inclination": (np.pi / 12, np.pi / 6, np.pi / 4)},
}
"""Conditions a further record could have, by kind of rig, in SI units."""
ALIKE = 0.9
"""Cosine beyond which a pair is listed."""


@dataclass(frozen=True)
class Confused(Saved):
    """What the records of a study could show.

    Parameters
    ----------
    study : Study
    confusion : Confusion
    split : Split or None
        The further record that best tells the worst pair apart.
    conditions : mapping of str to float
        Of that record, in SI units.
    remarks : tuple of str
        What a reader should know besides.
    """

    study: Study
    confusion: Confusion
    split: Split | None
    conditions: Mapping[str, float]
    remarks: tuple[str, ...] = ()

    def report(self) -> str:
        """The terminal report, at most 80 columns wide."""
        return confusion_report(self.study.name, self.confusion, self.split, self.conditions, self.remarks)

    def told(self) -> dict[str, Any]:
        """All of it for programs."""
        found = self.confusion
        return {
            "schema": "fibrefit/confusion/1",
            "study": self.study.name,
            "remarks": list(self.remarks),
            "effects": [
                {
                    "effect": one.effect,
                    "parameter": one.parameter,
                    "unit": one.unit,
                    "smallest_detectable": one.detectable if np.isfinite(one.detectable) else None,
                    "unique": one.unique,
                }
                for one in found.directions
            ],
            "cosine": found.cosine.tolist(),
            "cannot_tell_apart": [list(pair[:2]) for pair in found.pairs()],
            "cannot_see": list(found.invisible),
            "best_further_record": None
            if self.split is None
            else {
                "pair": list(self.split.pair),
                "conditions": dict(self.conditions),
                "cosine_before": self.split.before,
                "cosine_after": self.split.after,
            },
        }

    def plot(self) -> Figures:
        """The matrix of cosines."""
        from fibrefit.plots import confusion_figures

        return confusion_figures(self.confusion)

    def write(self, directory: ResultDirectory) -> None:
        """Write ``confusion.json`` and the figure."""
        write_whole(directory.path / "confusion.json", json.dumps(self.told(), indent=1) + "\n")
        write_figures(directory, self.plot)


def confuse_study(
    study: Study,
    *,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    progress: Callable[[str, float | None], None] | None = None,
) -> Confused:
    """Compare what every effect would do to the records of a study.

    Parameters
    ----------
    study : Study
        Of measured records, or of planned ones with initial values.
    only, exclude : sequence of str
        Names or patterns of effects.
    progress : callable, optional
        Told what is being done.

    Returns
    -------
    Confused
    """
    tell = progress or (lambda what, share: None)
    candidates = candidates_of(study, only=tuple(only), exclude=tuple(exclude))
    task = task_of(study)
    fit = None if is_planned(study) else identify(task, 1, progress=tell)
    search = laid_out(task, task.start if fit is None else fit.values, tuple(candidates.values()), tell)
    base = search.base
    tell("comparing what the effects do", None)
    remarks, louder = ((), 1.0) if fit is None else _beyond_noise(fit)
    found = confusion(base.frame, search.ground, base.fit.local, search.effects, max(search.kappa, louder))
    split, conditions = _split(search, found, study.kind)
    return Confused(study, found, split, conditions, remarks)


def _beyond_noise(fit: Identification) -> tuple[tuple[str, ...], float]:
    """What is said of records that hold more than noise, and its power where effects act, in units of the noise."""
    gap = total(fit.gap)
    if gap <= NOISE_LIKE * fit.expected_gap:
        return (), 1.0
    times = gap * max(fit.inflation, 1.0)
    said = f"The model leaves {gap:.3g} times the noise, which drowns weak effects: a strength counts as visible from "
    return (f"{said}{times:,.0f} times what the noise alone would ask for.",), times**2


def _split(search: Search, found: Confusion, kind: str) -> tuple[Split | None, Mapping[str, float]]:
    pairs = found.pairs(ALIKE)
    if not pairs or kind not in MENU:
        return None, {}
    names = tuple(MENU[kind])
    menu = [dict(zip(names, values, strict=True)) for values in product(*MENU[kind].values())]
    known = {effect.name: effect for effect in search.effects}
    pair = [known[name] for name in pairs[0][:2]]
    split = best_split(search.base.frame, search.ground, search.base.fit.local, pair, menu)
    return split, menu[split.record]
