"""Series of either rig, with one law of speed or without any, and what the command `series` says of them.

Each is drawn from the label of a release: fibre and guide, which parameter depends on speed, how strongly and with
which sign. Without a law records differ by one percent by chance.
"""

from __future__ import annotations

import itertools
import math
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.independent.make import write_study
from tests.independent.series import Series, draw_base, make_series
from tests.validation.cases import seed_of
from tests.validation.tables import revision

SCATTER = 0.01
STRENGTHS = {
    "stiffness": ("fibre.stiffness_speed_exponent", "stiffness_exponent", (0.01, 0.05)),
    "damping": ("fibre.damping_speed_exponent", "damping_exponent", (0.1, 0.5)),
    "friction": ("guide.friction_speed_exponent", "friction_exponent", (0.1, 0.3)),
}
"""Law, its exponent in the simulator, and the range of its size."""


@dataclass(frozen=True)
class Asked:
    """What the command said of one series; a row of the file of a release.

    Parameters
    ----------
    case : str
    rig, parameter : str
        Of it; no parameter where none depends on speed.
    exponent : float
        That is true.
    answer : str
        Of the command, or ``"error"`` and ``"too long"``.
    laws : str
        Effects it took, joined by " + ".
    told : float
        Exponent it told of the parameter, where it took a power; nan else.
    log_law, log_own : float
        Logarithms of the Bayes factors of the law and of values of each record over constant parameters.
    foresight : float
        What the law gains in records left out, in nats.
    gap, gap_law : float
        Of constant parameters and of the law.
    processor_seconds : float
    revision, says : str
        Of the program; the sentence or the error.
    """

    case: str
    rig: str
    parameter: str
    exponent: float
    answer: str
    laws: str
    told: float
    log_law: float
    log_own: float
    foresight: float
    gap: float
    gap_law: float
    processor_seconds: float
    revision: str
    says: str

    @property
    def found(self) -> bool:
        """Whether the law, of its parameter and no other, was preferred."""
        return self.answer == "speed_law" and self.parameters == {self.parameter}

    @property
    def among(self) -> bool:
        """Whether a law of its parameter was preferred, maybe with another one."""
        return self.answer == "speed_law" and self.parameter in self.parameters

    @property
    def made_up(self) -> bool:
        """Whether a law was preferred where there is none, or nothing was said."""
        return self.answer not in ("constant", "per_record")

    @property
    def parameters(self) -> set[str]:
        """Those that were given a law."""
        return {law.split(".")[1].split("_")[0] for law in self.laws.split(" + ") if law}


@dataclass(frozen=True)
class SpeedCase:
    """One series: which parameter goes with speed, empty for none, and its number among its like."""

    release: str
    rig: str
    parameter: str
    index: int

    @property
    def name(self) -> str:
        """Tells it from every other one."""
        return f"{self.release}/{self.rig}/{self.parameter or 'none'}/{self.index}"

    @property
    def seed(self) -> int:
        """Of all that is drawn."""
        return seed_of("law of speed", self.release, self.rig, self.parameter, str(self.index))

    def make(self) -> tuple[Series, float]:
        """The records, and the exponent of the law."""
        rng = np.random.default_rng(self.seed)
        base, effects, exponent = draw_base(rng), {}, 0.0
        if self.parameter:
            name, key, (low, high) = STRENGTHS[self.parameter]
            exponent = float(rng.uniform(low, high) * rng.choice([-1.0, 1.0]))
            effects = {name: {key: exponent}}
        scatter = 0.0 if self.parameter else SCATTER
        return make_series(self.rig, effects, seed=self.seed, base=base, scatter=scatter), exponent


def speed_cases(release: str, rig: str, *, lawful: bool) -> Iterator[SpeedCase]:
    """All series of a rig with a law, its parameters in turn, or all without; without end."""
    names = list(STRENGTHS) if lawful else [""]
    for i in itertools.count():
        yield SpeedCase(release, rig, names[i % len(names)], i // len(names))


def ask(case: SpeedCase) -> Asked:
    """Make a series and ask it; an error is an outcome too."""
    blank = dict.fromkeys(("told", "log_law", "log_own", "foresight", "gap", "gap_law"), math.nan)
    with tempfile.TemporaryDirectory() as name:
        series, exponent = case.make()
        write_study(series, Path(name))
        facts = {"case": case.name, "rig": case.rig, "parameter": case.parameter, "exponent": exponent}
        began = time.process_time()
        try:
            said = _said(Path(name), case.parameter)
        except Exception as error:
            said = {**blank, "answer": "error", "laws": "", "says": f"{type(error).__name__}: {error}"}
    return Asked(**facts, **said, processor_seconds=time.process_time() - began, revision=revision())


def _said(folder: Path, parameter: str) -> dict:
    from fibrefit.study import load_study
    from fibrefit.workflow.together.series import series_study

    result = series_study(load_study(folder))
    found = result.verdict
    lawful = result.answer == "speed_law"
    key = f"{STRENGTHS[parameter][0]}.exponent" if parameter else ""
    foresight = [float(found.left_out[name].elpd.sum()) for name in ("speed_law", "constant")]
    return {
        "answer": result.answer,
        "laws": " + ".join(effect.name for effect in found.models.law.effects) if lawful else "",
        "told": found.best.shared.get(key, math.nan),
        "log_law": found.logs["speed_law"],
        "log_own": found.logs["per_record"],
        "foresight": foresight[0] - foresight[1],
        "gap": found.gaps["constant"],
        "gap_law": found.gaps["speed_law"],
        "says": result.sentence,
    }
