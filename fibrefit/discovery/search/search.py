"""The search: refit every effect that may be missing, alone and in pairs, and keep what the records ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from fibrefit.discovery.curves.free_form import Reading
from fibrefit.discovery.engine.candidates import (
    Ground,
    Hypothesis,
    absent_values,
    alone,
    carried,
    fit_all,
    scouted,
    without,
)
from fibrefit.discovery.engine.noise_inflation import colour_of
from fibrefit.discovery.engine.refit import SCATTER, refit
from fibrefit.discovery.engine.supermodel import FAR, Frame, frame_of, group_of, reactions_of, waves_at
from fibrefit.discovery.engine.thresholds import LOUDER, NOISE_LIKE, RESTING, USUAL, alike, needed
from fibrefit.effects.catalogue import is_costly
from fibrefit.effects.law import Effect
from fibrefit.fitting.search.varpro import Joint, expected_gap, joint
from fibrefit.problem.inputs.errors_in_variables import input_errors
from fibrefit.problem.noise.spectrum import rests
from fibrefit.problem.statement.observations import Trace
from fibrefit.problem.task import Task

Progress = Callable[[str, float | None], None]
USUAL_SCATTER = 6.0
"""Mean squared deviation between records, in units of what is usual, beyond which it is no scatter but an effect."""
BARELY = 3.0
"""Factor on the gain a name takes, up to which scatter is looked for from more places: it may explain as much."""
SCATTERED = 12
"""Further starts of a refit with scatter that needs more of it than is usual."""
PROMISING = 2.0
"""Cost over the lowest one, after some steps, up to which a candidate is refitted in full."""
REFITTED = 4
"""Candidates that always are."""
SCOUTS_SHARE = 0.7
"""Share of a round's time in which all candidates take their first steps."""
MOST_OF = 0.5
"""Share of the best one's gain from which another explanation may be like it."""
MORE = 1.02
"""Gap over that of a perfect model from which errors of noisy inputs leave more than noise."""
BEAM = 3
"""Hypotheses that are extended when a single effect leaves a gap."""


@dataclass
class Search:
    """State of a search over hypotheses.

    Parameters
    ----------
    task : Task
        Of the model the search began with.
    effects : tuple of Effect classes
        That may be added.
    ground : Ground
    base : Hypothesis
        Nothing added.
    kappa : float
        Colour of the noise.
    slowest : float
        Its colour where no effect meets more of it.
    samples : float
        Number of measured samples.
    tell : callable
    frames : list of Frame
        Compiled so far.
    scatter : dict of tuple of str to Hypothesis
        Refits with scatter made so far, by the names of their effects.
    searched : set of tuple of str
        Names of those for which that was done from many places.
    singles : dict of str to Hypothesis
        Each effect by itself, once it has been tried.
    colours : dict of (tuple of str, tuple of str) to float
        Colour of the noise where what one hypothesis adds to another acts, as far as it was asked for.
    corrected : dict of tuple of str to Joint
        Refits together with the errors of measured inputs made so far.
    foreseen : dict of tuple of str to (n_record,)
        Gap of each record as foreseen from the others, by the names of effects.
    tried : int
        Candidates of the last look for more.
    curves : tuple of Reading
        Free curves on the model the search began with, best first, once they have been looked for.
    """

    task: Task
    effects: tuple[type[Effect], ...]
    ground: Ground
    base: Hypothesis
    kappa: float
    slowest: float
    samples: float
    tell: Progress
    frames: list[Frame] = field(default_factory=list)
    scatter: dict[tuple[str, ...], Hypothesis] = field(default_factory=dict)
    searched: set[tuple[str, ...]] = field(default_factory=set)
    singles: dict[str, Hypothesis] = field(default_factory=dict)
    colours: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = field(default_factory=dict)
    corrected: dict[tuple[str, ...], Joint] = field(default_factory=dict)
    foreseen: dict[tuple[str, ...], np.ndarray] = field(default_factory=dict)
    tried: int = USUAL
    curves: tuple[Reading, ...] = ()

    def gap(self, hypothesis: Hypothesis) -> float:
        """Gap a hypothesis leaves."""
        return float(np.sqrt(hypothesis.fit.cost / self.samples))

    def frame_for(self, effect: type[Effect], kin: Sequence[type[Effect]]) -> Frame:
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
        kept = tuple(other for other in self.effects if not other.stiff)
        reused = kin and not effect.stiff and self.base.frame.reactions is None
        group = kept if reused else group_of(effect, self.effects)
        held = tuple(dict.fromkeys((*kin, *group)))
        for frame in self.frames:
            if set(frame.effects) == {*self.task.problem.model.effects, *held}:
                return frame
        frame = frame_of(self.task, held, self.base.frame.reactions)
        self.frames.append(frame)
        return frame

    def extended(self, parents: Sequence[Hypothesis], what: str) -> list[Hypothesis]:
        """Every parent with every further effect, refitted, best first; costly ones only where others leave a gap."""
        pairs = self._extensions(parents)
        self.tried = len(pairs)
        found = self._tried([pair for pair in pairs if not is_costly(pair[1])], parents, what)
        costly = [pair for pair in pairs if is_costly(pair[1]) and self._may_help(*pair)]
        if costly and not (found and (self.gap(found[0]) <= NOISE_LIKE or self.only_scatters(found[0]))):
            found = sorted(found + self._tried(costly, parents, what), key=lambda hypothesis: hypothesis.fit.cost)
        if parents[0] is self.base:
            self.singles = {hypothesis.names[0]: hypothesis for hypothesis in found}
        return found

    def _extensions(self, parents: Sequence[Hypothesis]) -> list[tuple[Hypothesis, type[Effect]]]:
        pairs = []
        seen: set[frozenset[str]] = set()
        for parent in parents:
            for effect in self.effects:
                names, present = frozenset((*parent.names, effect.name)), self._present(parent)
                if effect in parent.effects or names in seen or not set(effect.needs) <= present:
                    continue
                if set(effect.excludes) & present or effect.name in self._excluded(parent):
                    continue
                seen.add(names)
                pairs.append((parent, effect))
        return pairs

    def _may_help(self, parent: Hypothesis, effect: type[Effect]) -> bool:
        """Whether an effect is worth trying on top of others: it helped by itself, where that has been tried."""
        by_itself = self.singles.get(effect.name)
        return not parent.effects or by_itself is None or self.is_significant(by_itself, self.base)

    def _tried(
        self, pairs: Sequence[tuple[Hypothesis, type[Effect]]], parents: Sequence[Hypothesis], what: str
    ) -> list[Hypothesis]:
        """Every parent with its further effect, refitted, best first; in full where it is promising."""
        kin = tuple(dict.fromkeys(effect for parent in parents for effect in parent.effects))
        jobs = [
            partial(scouted, self.frame_for(effect, kin), self.ground, parent, (effect,)) for parent, effect in pairs
        ]
        tell = lambda done: self.tell(what, SCOUTS_SHARE * done / len(jobs))  # noqa: E731
        trials = sorted(fit_all(jobs, tell), key=lambda trial: trial.scouts[0].cost)
        far = PROMISING * trials[0].scouts[0].cost if trials else 0.0
        near = [trial for i, trial in enumerate(trials) if i < REFITTED or trial.scouts[0].cost < far]
        share = lambda done: self.tell(what, SCOUTS_SHARE + (1.0 - SCOUTS_SHARE) * done / len(near))  # noqa: E731
        found = fit_all([partial(trial.refitted, self.ground) for trial in near], share)
        found += [trial.as_it_is() for trial in trials[len(near) :]]
        return sorted(found, key=lambda hypothesis: hypothesis.fit.cost)

    def scattered(self, hypothesis: Hypothesis) -> Hypothesis:
        """A hypothesis refitted with base parameters that may scatter between records."""
        if hypothesis.names not in self.scatter:
            subset = self.ground.subset(hypothesis.effects, scattering=True)
            fit = refit(hypothesis.frame, subset, hypothesis.fit.local, self.ground.whole)
            self.scatter[hypothesis.names] = replace(hypothesis, fit=fit)
        return self.scatter[hypothesis.names]

    def gain(self, hypothesis: Hypothesis, over: Hypothesis) -> float:
        """Gain over another hypothesis that remains when base parameters may scatter; re-based.

        The other is refitted from the values of this one too: a base fit a little above its minimum makes every
        candidate look significant. The best it has reached is kept, whichever candidate led there.
        """
        mine = self.scattered(hypothesis)
        subset = self.ground.subset(over.effects, scattering=True)
        for found in (hypothesis, mine):
            fit = refit(found.frame, subset, without(found, over.effects), self.ground.whole)
            if fit.surprise < self.scattered(over).fit.surprise:
                self.scatter[over.names] = Hypothesis(over.effects, fit, found.frame)
        return self.scattered(over).fit.surprise - mine.fit.surprise

    def is_significant(self, hypothesis: Hypothesis, over: Hypothesis) -> bool:
        """Whether a hypothesis is better than another by more than chance, and enough so to be worth a name."""
        added = [effect for effect in hypothesis.effects if effect not in over.effects]
        gain = over.fit.cost - hypothesis.fit.cost
        if not gain > self.needed(hypothesis, over, 1.0):
            return False
        gain = min(gain, self.gain(hypothesis, over))
        if not gain > self.needed(hypothesis, over, 1.0):
            return False
        # How the noise is coloured where the effect acts is only asked where that may decide.
        pair = hypothesis.names, over.names
        if not gain > self.needed(hypothesis, over, self.slowest) and pair not in self.colours:
            self.colours[pair] = colour_of(self.task, hypothesis, added)
        needed = self.needed(hypothesis, over, self.colour(hypothesis, over))
        if needed < gain < BARELY * needed and over.names not in self.searched and self.gap(over) <= NOISE_LIKE:
            self._scattered_anew(over)
            gain = min(gain, self.gain(hypothesis, over))
        return gain > needed

    def needed(self, hypothesis: Hypothesis, over: Hypothesis, kappa: float) -> float:
        """Gain over another hypothesis from which what is added gets its name, in noise of a colour."""
        size, inputs = hypothesis.size - over.size, hypothesis.frame.reactions is not None
        return needed(size, self.tried, kappa, over.fit.cost, inputs)

    def gate(self, parameters: int, louder: float = 1.0) -> float:
        """Gain over the base from which an effect with so many parameters gets its name, unless the base scatters.

        What is no effect may be `louder` than noise of the colour found, in units of its power.
        """
        inputs = self.base.frame.reactions is not None
        return needed(parameters, len(self.effects), max(self.kappa, louder), self.base.fit.cost, inputs)

    def colour(self, hypothesis: Hypothesis, over: Hypothesis) -> float:
        """Colour of the noise for what a hypothesis adds to another: at the motion's pace if it was not asked for."""
        return self.colours.get((hypothesis.names, over.names), self.kappa)

    def colour_over(self, over: Hypothesis) -> float:
        """Colour of the noise by which all that was tried on top of a hypothesis is compared: the worst asked for."""
        asked = [colour for (_, names), colour in self.colours.items() if names == over.names]
        return max([self.kappa, *asked])

    def with_inputs(self, hypothesis: Hypothesis) -> Joint | None:
        """A hypothesis refitted together with the errors of noisy inputs, for the motion it leads to; None without."""
        reactions = self.base.frame.reactions
        if reactions is None:
            return None
        if hypothesis.names not in self.corrected:
            self.tell("finding the errors of measured inputs", None)
            task, values = alone(self.task, hypothesis)
            waves = waves_at(task, values, reactions)
            self.corrected[hypothesis.names] = joint(task, input_errors(task), values, waves, whole=False)
        return self.corrected[hypothesis.names]

    def leaves_much(self, hypothesis: Hypothesis) -> bool:
        """Whether all samples together have more left than a perfect model leaves, as where a second effect hides."""
        found = self.with_inputs(hypothesis)
        if found is None:
            return False
        task, known = alone(self.task, hypothesis)[0], input_errors(self.task)
        whole = joint(task, known, found.values, found.waves)
        self.corrected[hypothesis.names] = whole
        return whole.gap > MORE * expected_gap(task, known, whole)[0]

    def anew(self, hypothesis: Hypothesis) -> tuple[Search, Hypothesis] | None:
        """Search and hypothesis with what errors of noisy inputs do to the hypothesis; None without such inputs."""
        found = self.with_inputs(hypothesis)
        if found is None:
            return None
        self.tell("finding what errors of inputs do to the better model", None)
        task = alone(self.task, hypothesis)[0]
        expected = expected_gap(task, input_errors(task), found)[0]
        reactions = reactions_of(task, found.values, found.waves, found.gap > FAR * expected)
        frame, own = frame_of(self.task, (), reactions), frame_of(self.task, hypothesis.effects, reactions)
        local = np.asarray(task.problem.layout.local(found.values))
        local = carried(own, absent_values(own, len(local)), Frame(task), local)
        fit = refit(own, self.ground.subset(hypothesis.effects), local, self.ground.whole)
        base = refit(frame, self.ground.subset(()), self.base.fit.local, self.ground.whole)
        search = replace(
            self,
            base=Hypothesis((), base, frame),
            samples=float(frame.samples.sum()),
            frames=[frame],
            scatter={},
            searched=set(),
            singles={},
            colours={},
            foreseen={},
            curves=(),
        )
        return search, Hypothesis(hypothesis.effects, fit, own)

    def is_noise_with_inputs(self, hypothesis: Hypothesis) -> bool:
        """Whether only noise is left once the errors of noisy inputs are found anew."""
        found = self.with_inputs(hypothesis)
        return found is not None and found.foretold <= NOISE_LIKE

    @cached_property
    def moving(self) -> np.ndarray:
        """Samples of each record before anything moves, and before all is at rest again, ``(2, n_record)``."""
        return np.array([moving(trace) for trace in self.task.traces]).T

    def is_louder_in_motion(self, frame: Frame, local: np.ndarray) -> bool:
        """Whether more is left while the rig moves than at rest, for values ``(n_record, n_local)`` in SI units."""
        if frame.reactions is not None:
            return False
        ends = [*self.moving, self.ground.whole]
        costs = np.array([frame.costs(local, counts).sum() for counts in ends])
        samples = np.array([frame.samples_before(counts).sum() for counts in ends])
        resting = samples[0] + samples[2] - samples[1]
        if resting < RESTING:
            return False
        at_rest, in_motion = (costs[0] + costs[2] - costs[1]) / resting, np.diff(costs[:2]) / np.diff(samples[:2])
        return bool(in_motion[0] > LOUDER**2 * at_rest)

    def alike(self, best: Hypothesis, others: Sequence[Hypothesis], over: Hypothesis) -> list[Hypothesis]:
        """Those of `others` that explain the records as well as the best one, with most of its gain over another."""
        least = over.fit.cost - MOST_OF * (over.fit.cost - best.fit.cost)
        near = [other for other in others if other.fit.cost <= least]
        return [other for other in near if alike(best.fit.cost, other.fit.cost, self.samples, self.kappa)]

    def simplest(self, ranked: Sequence[Hypothesis], over: Hypothesis) -> Hypothesis:
        """Of the explanations like the best one, that with the fewest parameters; then the best."""
        near = self.alike(ranked[0], ranked, over) or ranked[:1]
        return min(near, key=lambda hypothesis: (hypothesis.size, hypothesis.fit.cost))

    def is_noise(self, hypothesis: Hypothesis) -> bool:
        """Whether only noise is left, or noise and base parameters that scatter a little from record to record."""
        if self.gap(hypothesis) <= NOISE_LIKE and not self.is_louder_in_motion(hypothesis.frame, hypothesis.fit.local):
            return True
        return self.only_scatters(hypothesis) or self.is_noise_with_inputs(hypothesis)

    def only_scatters(self, hypothesis: Hypothesis) -> bool:
        """Whether base parameters that scatter no more than usual between records leave only noise."""
        found = self.scattered(hypothesis)
        usual = USUAL_SCATTER * len(self.ground.base) * len(found.fit.local)
        if self.gap(found) > NOISE_LIKE:
            return False
        if found.fit.penalty > usual:
            found = self._scattered_anew(hypothesis)
        return found.fit.penalty <= usual and not self.is_louder_in_motion(found.frame, found.fit.local)

    def _scattered_anew(self, hypothesis: Hypothesis) -> Hypothesis:
        """The best of refits with scatter from several places: bounces give them a minimum each."""
        first, random = self.scattered(hypothesis), np.random.default_rng(0)
        columns = [first.frame.names.index(name) for name in self.ground.base]
        subset, fits = self.ground.subset(hypothesis.effects, scattering=True), [first.fit]
        for _ in range(SCATTERED):
            local = first.fit.local.copy()
            local[:, columns] = local[:, columns].mean(axis=0) * (1.0 + SCATTER * random.standard_normal(len(columns)))
            fits.append(refit(first.frame, subset, local, self.ground.whole))
        self.searched.add(hypothesis.names)
        self.scatter[hypothesis.names] = replace(first, fit=min(fits, key=lambda fit: fit.cost + fit.penalty))
        return self.scatter[hypothesis.names]

    def pruned(self, hypothesis: Hypothesis) -> Hypothesis:
        """The hypothesis without the effects a later one has made needless."""
        for effect in hypothesis.effects:
            rest = tuple(other for other in hypothesis.effects if other is not effect)
            if not rest or any(effect.name in other.needs for other in rest):
                continue
            fit = refit(hypothesis.frame, self.ground.subset(rest), without(hypothesis, rest), self.ground.whole)
            lesser = Hypothesis(rest, fit, hypothesis.frame)
            if not self.is_significant(hypothesis, lesser):
                return self.pruned(lesser)
        return hypothesis

    def _present(self, parent: Hypothesis) -> set[str]:
        return {effect.name for effect in (*self.task.problem.model.effects, *parent.effects)}

    def _excluded(self, parent: Hypothesis) -> set[str]:
        return {name for effect in (*self.task.problem.model.effects, *parent.effects) for name in effect.excludes}


def moving(trace: Trace) -> tuple[int, int]:
    """Samples of a record before anything moves, and before all is at rest again; all, where neither is seen."""
    first, last = 0, len(trace.times)
    for rest in rests(trace):
        if rest.start == 0:
            first = rest.stop
        else:
            last = rest.start
    return min(first, last), last
