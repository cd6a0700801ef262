"""What a search works with, and how it tries effects on top of models: nothing here changes what was found before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from threading import Lock

import numpy as np

from fibrefit.discovery.engine.candidates import Ground, Hypothesis, alone, fit_all, scouted
from fibrefit.discovery.engine.marginal import WRONG_MINIMUM, Scales, Weighed
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.engine.screening import Promise
from fibrefit.discovery.engine.supermodel import Frame, frame_of, group_of
from fibrefit.effects.law import Effect, extends
from fibrefit.problem.task import Task

Progress = Callable[[str, float | None], None]
PROMISING = 2.0
"""Cost over the lowest one, after some steps, up to which a candidate is refitted in full."""
REFITTED = 4
"""Candidates that always are."""
SCREENING_SHARE = 0.7
"""Share of a round's time in which all candidates take their first steps."""
UNPROMISING = -2.0
"""Nats that slopes promise, by which they may err, below which an effect is not looked at any further."""
NEARLY = 1.1
"""Gap up to which slopes tell where a missing effect leads; beyond it, candidates are searched for in plain squares."""


@dataclass(frozen=True)
class Search:
    """What all rounds of a search have in common.

    Parameters
    ----------
    task : Task
        Of the model the search began with.
    effects : tuple of Effect classes
        That may be added.
    ground : Ground
    base : Hypothesis
        Nothing added, in plain least squares.
    scales : Scales
        By which hypotheses are weighed now.
    tell : callable
    frames : list of Frame
        Compiled so far; a store of programs, not of results.
    lock : Lock
        Of that store.
    """

    task: Task
    effects: tuple[type[Effect], ...]
    ground: Ground
    base: Hypothesis
    scales: Scales
    tell: Progress
    frames: list[Frame] = field(default_factory=list)
    lock: Lock = field(default_factory=Lock, repr=False)

    @cached_property
    def samples(self) -> float:
        """Number of samples that count."""
        return float(self.base.frame.samples.sum())

    def weighed_with(self, scales: Scales) -> Search:
        """The same search with other scales."""
        return replace(self, scales=scales)

    def gap(self, hypothesis: Hypothesis) -> float:
        """Rms of what a hypothesis leaves, in units of the noise."""
        return float(np.sqrt(hypothesis.fit.cost / self.samples))

    def plain(self, weighed: Weighed) -> Hypothesis:
        """A weighed hypothesis at its mode, with what it leaves in plain squares."""
        cost = float(weighed.frame.costs(weighed.local, self.ground.whole).sum())
        return Hypothesis(weighed.effects, Refit(weighed.local, cost, weighed.shared, 0), weighed.frame)

    def frame_for(self, effect: type[Effect], kin: Sequence[type[Effect]] = ()) -> Frame:
        """A frame that holds an effect and others; made where there is none yet.

        One effect by itself is tried in a frame with its group, which is quick to run. On top of others it is tried in
        one with all: that is slower to run, but every further round does with the same program. With noisy inputs a
        program serves one round only.

        Parameters
        ----------
        effect : Effect class
        kin : sequence of Effect classes
            All that may be present beside it.
        """
        # What changes with time would slow down all others.
        kept = tuple(other for other in self.effects if not other.stiff and not extends(other))
        reused = kin and not effect.stiff and not extends(effect) and self.base.frame.reactions is None
        group = kept if reused else group_of(effect, self.effects)
        held = tuple(dict.fromkeys((*kin, *group)))
        with self.lock:
            for frame in self.frames:
                if set(frame.effects) == {*self.task.problem.model.effects, *held}:
                    return frame
            frame = frame_of(self.task, held, self.base.frame.reactions)
            self.frames.append(frame)
            return frame

    def extensions(self, parent: Weighed) -> tuple[type[Effect], ...]:
        """Effects that may be added to a hypothesis."""
        there = (*self.task.problem.model.effects, *parent.effects)
        present, excluded = {effect.name for effect in there}, {name for effect in there for name in effect.excludes}
        return tuple(
            effect
            for effect in self.effects
            if effect not in parent.effects
            and set(effect.needs) <= present
            and not set(effect.excludes) & present
            and effect.name not in excluded
        )

    def tried(self, parent: Weighed, effects: Sequence[type[Effect]], what: str) -> list[Weighed]:
        """A parent with each of some effects, the most probable first."""
        plain = self.plain(parent)
        if self.gap(plain) > NEARLY:
            # Of a sudden change slopes tell the instant; there are too many instants to be tried in plain squares.
            sudden = [effect for effect in effects if effect.sudden]
            found = self._from_plain_squares(parent, plain, [e for e in effects if not e.sudden], what)
            found += self._from_slopes(parent, sudden, what)
        else:
            found = self._from_slopes(parent, effects, what)
        return sorted((one for one in found if np.isfinite(one.log)), key=lambda one: -one.log)

    def _from_slopes(self, parent: Weighed, effects: Sequence[type[Effect]], what: str) -> list[Weighed]:
        """A parent with each effect whose slopes promise something, from where it is weak."""
        groups: dict[int, tuple[Frame, list[type[Effect]]]] = {}
        for effect in effects:
            frame = self.frame_for(effect, parent.effects)
            groups.setdefault(id(frame), (frame, []))[1].append(effect)
        screens = [partial(self.scales.screened, parent, frame, some) for frame, some in groups.values()]
        promised: dict[type[Effect], Promise] = {}
        for screen in fit_all(screens, lambda done: self.tell(what, 0.5 * done / max(len(screens), 1))):
            promised |= screen
        near = [effect for effect in effects if promised[effect].gain > UNPROMISING]
        jobs = [
            partial(self.scales.extended, parent, self.frame_for(effect, parent.effects), effect, promised[effect])
            for effect in near
        ]
        found = fit_all(jobs, lambda done: self.tell(what, 0.5 + 0.5 * done / max(len(jobs), 1)))
        rest = [effect for effect in effects if effect not in near]
        return [*found, *(self._as_promised(parent, effect, promised[effect].gain) for effect in rest)]

    def _as_promised(self, parent: Weighed, effect: type[Effect], gain: float) -> Weighed:
        """A parent with an effect that is not there: its slopes promise too little to look any further."""
        frame = self.frame_for(effect, parent.effects)
        return self.scales.absent(parent, frame, (effect,), gain)

    def _from_plain_squares(
        self, parent: Weighed, plain: Hypothesis, effects: Sequence[type[Effect]], what: str
    ) -> list[Weighed]:
        """A parent with each effect, from where plain squares led: in full those that are promising there."""
        ends = sorted(self._in_plain_squares(plain, effects, what).values(), key=lambda end: end.fit.cost)
        far = PROMISING * ends[0].fit.cost if ends else 0.0
        jobs = [partial(self._weighed, parent, end, i < REFITTED or end.fit.cost < far) for i, end in enumerate(ends)]
        share = 1.0 - SCREENING_SHARE
        return fit_all(jobs, lambda done: self.tell(what, SCREENING_SHARE + share * done / max(len(jobs), 1)))

    def _weighed(self, parent: Weighed, end: Hypothesis, near: bool) -> Weighed:
        """A parent with an effect: from where plain squares led, or where that is no good, from where it is weak."""
        if not near:
            return self.scales.at_once(end.frame, end.effects, end.fit.local, parent)
        found = self.scales.weigh(end.frame, end.effects, end.fit.local)
        if found.log > parent.log - WRONG_MINIMUM:
            return found
        effect = end.effects[-1]
        promise = self.scales.screened(parent, end.frame, [effect])[effect]
        if not np.isfinite(promise.gain):
            return found
        return max(found, self.scales.extended(parent, end.frame, effect, promise), key=lambda one: one.log)

    def _in_plain_squares(
        self, plain: Hypothesis, effects: Sequence[type[Effect]], what: str
    ) -> dict[type[Effect], Hypothesis]:
        """Each effect on top of a hypothesis, where plain squares over growing horizons lead."""
        jobs = [
            partial(scouted, self.frame_for(effect, plain.effects), self.ground, plain, (effect,)) for effect in effects
        ]
        tell = lambda done: self.tell(what, 0.6 * SCREENING_SHARE * done / max(len(jobs), 1))  # noqa: E731
        trials = sorted(fit_all(jobs, tell), key=lambda trial: trial.scouts[0].cost)
        far = PROMISING * trials[0].scouts[0].cost if trials else 0.0
        near = [trial for i, trial in enumerate(trials) if i < REFITTED or trial.scouts[0].cost < far]
        found = fit_all([partial(trial.refitted, self.ground) for trial in near], lambda done: None)
        found += [trial.as_it_is() for trial in trials[len(near) :]]
        return {hypothesis.effects[-1]: hypothesis for hypothesis in found}

    def task_with(self, weighed: Weighed) -> tuple[Task, np.ndarray]:
        """Task of a model with the effects of a hypothesis and no others, and its values ``(n_free,)`` in SI units."""
        return alone(self.task, self.plain(weighed))
