"""How a search tries effects on top of models: nothing here changes what was found before."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fibrefit.discovery.engine.candidates import (
    Hypothesis,
    fit_all,
    transferred,
)
from fibrefit.discovery.engine.effort import followed_in_turn, is_followed_instead
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.screening import PredictedGain, PredictedGains
from fibrefit.discovery.engine.secant import Seed
from fibrefit.discovery.engine.supermodel import Supermodel, group_of, is_quick
from fibrefit.discovery.engine.thresholds import NAMED, PRICE
from fibrefit.discovery.search.base import SearchState
from fibrefit.discovery.search.followed import extended
from fibrefit.discovery.search.plain_squares import from_plain_squares
from fibrefit.discovery.search.recurring import may_recur, predicted_recurrence
from fibrefit.discovery.search.screen import Elsewhere, Screen, per_unit
from fibrefit.discovery.search.starts import (
    EffectStart,
    is_left_to_follow,
    is_worth_following,
    little_is_missing,
    most_promising,
)
from fibrefit.laws.law import Effect


class Tried(NamedTuple):
    """What became of some effects on top of a hypothesis.

    Parameters
    ----------
    found : list of LaplaceFit
        One each, the most probable first; without those that no motion follows from.
    untried : tuple of Effect classes
        Those that the time did not suffice for.
    """

    found: list[LaplaceFit]
    untried: tuple[type[Effect], ...] = ()


@dataclass(frozen=True)
class Search(SearchState):
    """A search that tries effects by what their slopes predict."""

    def _screen(
        self, effect: type[Effect], parent: LaplaceFit, slopes: Seed, near: tuple[LaplaceFit, Seed] | None
    ) -> tuple[Screen, Supermodel]:
        """Score tests of an effect and its group on a parent, and the supermodel that holds all of them.

        With slopes taken in a `near` model, if any, whose own are known.
        """
        there = () if near is None else near[0].effects
        known, screen = self.supermodel_for(effect, there), Screen(self.inference, parent, slopes)
        if known.holds(parent.effects):
            return screen, known
        whole = self.supermodel_for(effect, parent.effects)
        if near is not None and not effect.needs:
            local = transferred(known, near[0].supermodel, near[0].local)
            screen = replace(screen, near=Elsewhere(known, local, there, near[1]))
            # Beside a stiff effect groups are smaller.
            if not whole.holds(known.effects):
                whole = self.supermodel_with((*parent.effects, *known.effects))
        return screen, whole

    def tried(
        self, parent: LaplaceFit, effects: Sequence[type[Effect]], what: str, least: float = -np.inf,
        near: LaplaceFit | None = None, of_singular: float = -np.inf,
    ) -> Tried:  # fmt: skip
        """A parent with each of some effects, as far as the time goes.

        Parameters
        ----------
        parent : LaplaceFit
        effects : sequence of Effect classes
        what : str
            What is said of it while it goes on.
        least : float
            Nats that slopes have to predict of an effect that is followed, where fewer would do otherwise.
        near : LaplaceFit, optional
            A model that leaves little, without all or the last of the parent's effects, in which slopes may be taken.
        of_singular : float
            The same of an effect at whose null the model changes its kind: slopes say little of it.
        """
        slopes, plain = self.inference.slopes(parent), self.plain(parent)
        predictions = self.predicted_gains(parent, slopes, effects, what, near)
        most = max((prediction.promise for prediction in predictions.values()), default=-np.inf)
        if little_is_missing(self.gap(plain), most):
            follow = partial(is_worth_following, least=least, of_singular=of_singular)
            found = self._from_slopes(parent, slopes, predictions, what, follow, near)
        else:
            found = self._by_predicted_gain(parent, plain, predictions, what, (least, of_singular))
        reached = {one.effects[-1] for one in found}
        ranked = sorted((one for one in found if np.isfinite(one.log)), key=lambda one: -one.log)
        return Tried(ranked, tuple(effect for effect in effects if effect not in reached))

    def _from_slopes(
        self, parent: LaplaceFit, slopes: Seed, predictions: PredictedGains, what: str, follow: Callable[..., bool],
        near: LaplaceFit | None,
    ) -> list[LaplaceFit]:  # fmt: skip
        """A parent with each effect whose slopes predict something, from where it is weak."""
        views = [(parent, predictions, slopes)]
        seen = list(predictions)
        if parent.evidence.mode.sigma.any():
            pooled = self.inference.pooled(parent)
            seed = self.inference.slopes(pooled)
            # There an effect is followed from its full strength alone, as it has to take the place of differences.
            there = self.predicted_gains(pooled, seed, seen, what, near)
            views.append((pooled, {effect: one._replace(weak=one.values) for effect, one in there.items()}, seed))
            seen = [effect for effect in seen if effect in there]
        starts = [
            EffectStart(predicted[effect].promise + view.log - parent.log, effect, view, predicted[effect], seed)
            for view, predicted, seed in views
            for place, effect in enumerate(most_promising(predicted, seen))
            if view is parent or is_followed_instead(place)
        ]
        # What most is predicted of is followed first: where the time ends, it is the rest that was not looked at.
        likely = [start for start in starts if follow(start.effect, start.predicted_gain)]
        likely.sort(key=lambda start: -start.predicted_gain)
        found, followed = self._followed(parent, likely, what)
        ends: dict[type[Effect], LaplaceFit] = {}
        for one in found:
            last = one.effects[-1]
            ends[last] = max(ends.get(last, one), one, key=lambda other: other.log)
        rest = [
            self._as_predicted(parent, start.effect, start.predicted_gain)
            for start in starts[: len(seen)]
            if start.effect not in followed
        ]
        return [*ends.values(), *rest]

    def _followed(
        self, parent: LaplaceFit, starts: Sequence[EffectStart], what: str
    ) -> tuple[list[LaplaceFit], set[type[Effect]]]:
        """Where starts lead, the first ones first, and the effects they are of; none with too little predicted.

        Once an effect explains something beyond doubt, slopes have to predict a fair share of that.
        """
        found, begun, left = list[LaplaceFit](), list[EffectStart](), list(starts)
        follow, supermodel = partial(extended, self.inference), self.supermodel_for
        while left:
            now = followed_in_turn(left)[0]
            left = left[len(now) :]
            jobs = [
                self.recalled(
                    "extended", view, (effect.name, prediction),
                    partial(follow, view, supermodel(effect, parent.effects), effect, prediction, seed),
                )
                for _, effect, view, prediction, seed in now
            ]  # fmt: skip
            done = len(begun)
            tell = lambda number, done=done: self.tell(what, 0.5 + 0.5 * (done + number) / len(starts))  # noqa: E731
            found += [one for one in fit_all(jobs, tell) if one is not None]
            begun += now
            gain = max((one.log - parent.log for one in found), default=0.0)
            left = [start for start in left if is_left_to_follow(start, gain)]
        return found, {start.effect for start in begun}

    def lacks_little(self, parent: LaplaceFit, gained: float) -> bool:
        """Whether slopes in a parent tell what they would beside what has gained so many nats on top of it."""
        return little_is_missing(self.gap_left(parent), gained)

    def predicted_gains(
        self,
        parent: LaplaceFit,
        slopes: Seed,
        effects: Sequence[type[Effect]],
        what: str,
        near: LaplaceFit | None = None,
    ) -> dict[type[Effect], PredictedGain]:
        """What slopes predict of each effect, as far as the time goes: those of a supermodel together."""
        once, recurring = [one for one in effects if not one.recurs], [one for one in effects if one.recurs]
        elsewhere = None if near is None else (near, per_unit(near, self.inference.slopes(near)))
        groups: dict[int, tuple[Screen, Supermodel, list[type[Effect]]]] = {}
        for effect in once:
            screen, supermodel = self._screen(effect, parent, slopes, elsewhere)
            program = supermodel if screen.near is None else screen.near.supermodel
            groups.setdefault(id(program), (screen, supermodel, []))[2].append(effect)
        screens = list[Callable[[], Any]]()
        # What is stiff takes longest to compile and to run: begun last, it is waited for by idle cores.
        for screen, supermodel, some in sorted(groups.values(), key=lambda group: not any(e.stiff for e in group[2])):
            test = partial(screen.predicted, supermodel, some)
            about = [effect.name for effect in some], screen.place
            screens.append(self.recalled("screened", parent, about, test))
        found = fit_all(screens, lambda done: self.tell(what, 0.5 * done / max(len(screens), 1)))
        known = {effect: prediction for screen in found if screen is not None for effect, prediction in screen.items()}
        more = {one: self._screen(one, parent, slopes, elsewhere) for one in recurring if may_recur(one, known)}
        asked = [
            self.recalled(
                "recurring", parent, (effect.name, screen.place),
                partial(predicted_recurrence, screen, supermodel, effect),
            )
            for effect, (screen, supermodel) in more.items()
        ]  # fmt: skip
        judged = recurring if all(screen is not None for screen in found) else []
        nothing = {one: PredictedGain(-PRICE, {}, {}, {}) for one in judged if one not in more}
        found = fit_all(asked, lambda done: None)
        return known | nothing | {effect: one for effect, one in zip(more, found, strict=False) if one is not None}

    def _by_predicted_gain(
        self, parent: LaplaceFit, plain: Hypothesis, predictions: PredictedGains, what: str, least: tuple[float, float]
    ) -> list[LaplaceFit]:
        """A parent with each effect, what slopes predict most of first; the rest only where that comes to nothing.

        Where much is missing slopes predict something of nearly every effect, too much of most; but what is missing is
        among those that they predict much of: more than the least, that of effects at whose null the model changes its
        kind being the second.
        """
        ranked, found, gain = sorted(predictions, key=lambda effect: -predictions[effect].gain), list[LaplaceFit](), 0.0
        far = [effect for effect in ranked if predictions[effect].gain < least[bool(effect.singular)]]
        left = self.in_turn([effect for effect in ranked if effect not in far])
        # From afar slopes predict too much: what they predict less of than was found is not what is missing.
        while left and (gain <= NAMED or predictions[left[0][0]].gain > gain):
            now = {each: predictions[each] for each in left.pop(0)}
            found += from_plain_squares(self, parent, plain, now, what)
            gain = max((one.log - parent.log for one in found), default=0.0)
        behind = (*(each for group in left for each in group), *far)
        return [*found, *(self._as_predicted(parent, each, min(predictions[each].gain, 0.0)) for each in behind)]

    @abstractmethod
    def in_turn(self, ranked: Sequence[type[Effect]]) -> list[list[type[Effect]]]:
        """Effects, the most promising first, in groups: after each it is tested whether the next may do better."""

    def _as_predicted(self, parent: LaplaceFit, effect: type[Effect], gain: float) -> LaplaceFit:
        """A parent with an effect that is not there: its slopes predict too little to look any further."""
        return self.inference.absent(parent, self.supermodel_for(effect, parent.effects), (effect,), gain)


@dataclass(frozen=True)
class EffectSearch(Search):
    """A search whose candidates are the effects of a catalogue, in programs that hold groups of them."""

    def supermodel_for(self, effect: type[Effect], others: Sequence[type[Effect]] = ()) -> Supermodel:
        """One effect by itself is tried with its group, which is quick to run.

        On top of others it is tried with all: that is slower to run, but every further round does with the same
        program. With noisy inputs a program serves one round only.
        """
        kept, stiff = tuple(filter(is_quick, self.effects)), any(other.stiff for other in others)
        reused = others and not stiff and self.shares_a_program(effect)
        group = kept if reused else group_of(effect, self.effects, stiff)
        return self.supermodel_with((*others, *group))

    def extensions(self, parent: LaplaceFit) -> tuple[type[Effect], ...]:
        """Effects that need nothing that is not there, and that nothing there excludes."""
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

    def in_turn(self, ranked: Sequence[type[Effect]]) -> list[list[type[Effect]]]:
        """Effects in the groups that candidates of any search are followed in."""
        return followed_in_turn(ranked)
