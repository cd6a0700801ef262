"""Which of the laws for a free curve is told, held to records it was not fitted to, and what is told of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import beyond_limits, in_time
from fibrefit.discovery.curves.free_form import FittedCurve, proposing
from fibrefit.discovery.curves.probes import COURSES
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import APART, false_alarm_at_most
from fibrefit.discovery.laws.propose import PRICE_OF_LOOKS, Proposal, proposed
from fibrefit.discovery.laws.source import Composed, heights_of
from fibrefit.discovery.laws.two_variables import price_of_second
from fibrefit.discovery.model.law import LAWS, ProposedLaw
from fibrefit.discovery.search.cross_validation import left_out
from fibrefit.discovery.search.search import Search
from fibrefit.fitting.result import Identification, total
from fibrefit.laws.law import Effect
from fibrefit.laws.ports import PORTS
from fibrefit.study.summaries.discovery import LawParameter, OtherLaw, ProposedLawSummary

FORESEEING = "predicting each record from the others"


class HeldLaw(NamedTuple):
    """A law that is told.

    Parameters
    ----------
    fit : LaplaceFit
        The model with it.
    law : Composed
    proposal : Proposal
        That it is from.
    left_out : (float, float)
        Normalised residual RMS of records predicted from the others, without it and with it; nan where the time did not
        suffice to predict any, or there is but one.
    elpd_gain : float
        Log predictive density in nats of records left out, over that without it; nan as before.
    """

    fit: LaplaceFit
    law: Composed
    proposal: Proposal
    left_out: tuple[float, float] = (np.nan, np.nan)
    elpd_gain: float = np.nan

    @property
    def holds(self) -> bool:
        """Whether it foresees records left out better than the model without it."""
        return bool(0.0 < self.elpd_gain < np.inf)


def holding(proposal: Proposal) -> HeldLaw | None:
    """Of laws that are not distinguished the one that left-out records speak for; None where none holds on them.

    Parameters
    ----------
    proposal : Proposal
    """
    best = HeldLaw(*proposal.ranked[0], proposal)
    if len(proposal.search.task.problem.layout.records) == 1:
        return best
    found, came = in_time(partial(_by_left_out, proposal), best)
    return found if not came or found.holds else None


def held_laws(
    search: Search, best: LaplaceFit, curves: Sequence[FittedCurve], before: Identification | None = None
) -> Iterator[HeldLaw]:
    """Laws for free curves on top of a model that hold, the best of each curve in turn; none where curves do better.

    Readings linearised about the model without any tell a law over one variable from one over another by some nats,
    which may be the other way round once they are linearised about the laws: where one is not what is missing, the next
    is asked that does what the best curve does.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
        The model that lacks something.
    curves : sequence of FittedCurve
        Free curves on top of it, the best first.
    before : Identification, optional
        Of the model the search began with; without it, laws are of one variable.
    """
    proposal = proposed(search, best, curves, before)
    while proposal is not None and proposal.gain > proposal.needed:
        held = holding(proposal)
        if held is not None:
            yield held
        proposal = proposal.beside(proposal.ranked[0][1] if held is None else held.law)


def holding_without(search: Search, parent: LaplaceFit, held: HeldLaw) -> HeldLaw | None:
    """A law beside fewer effects, by records left out there; None where it does not hold on them.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
        The model without the law, and without what it makes needless.
    held : HeldLaw
        Its fit is that without them too.
    """
    if not np.isfinite(held.elpd_gain):
        return held
    (found,) = _foreseeing(search, parent, [held])
    return found if found.holds else None


def _by_left_out(proposal: Proposal) -> HeldLaw:
    """The law that is most probable, and foresees most of records left out, each with deviations of its own.

    What shared values leave of a record is mostly what it differs by: a law that is right moves that as it comes.
    """
    enough = proposal.parent.log + proposal.needed
    near = [pair for pair in proposal.ranked if proposal.best.log - pair[0].log < APART and pair[0].log > enough]
    near = near or list(proposal.ranked[:1])
    found = _foreseeing(proposal.search, proposal.parent, [HeldLaw(end, law, proposal) for end, law in near])
    # What all records say of two laws counts as much as what they say of those left out: neither overrules by a hair.
    return max(found, key=lambda one: one.fit.log + one.elpd_gain if np.isfinite(one.elpd_gain) else -np.inf)


def _foreseeing(search: Search, parent: LaplaceFit, laws: Sequence[HeldLaw]) -> list[HeldLaw]:
    """Laws with what they say of records left out, beside the model without them."""
    number = 1 + len(laws)
    before, *seen = (
        left_out(search, one, lambda share, i=i: search.tell(FORESEEING, (i + share) / number))  # type: ignore[misc]
        for i, one in enumerate((parent, *(law.fit for law in laws)))
    )
    return [
        law._replace(left_out=(before.gap, with_it.gap), elpd_gain=float(np.sum(with_it.elpd - before.elpd)))
        for law, with_it in zip(laws, seen, strict=True)
    ]


class ToldLaw(NamedTuple):
    """A law, the model with it, and the search that it was found in."""

    search: Search
    fit: LaplaceFit
    told: ProposedLaw

    def without(self, gone: Collection[type[Effect]]) -> ToldLaw:
        """The same with a model without effects that are not kept."""
        kept = tuple(effect for effect in self.fit.effects if effect not in gone)
        return self if kept == self.fit.effects else self._replace(fit=self.search.inference.without(self.fit, kept))

    @property
    def effect(self) -> str:
        """Name of the law in the model."""
        return self.told.summary.name


def law_for(search: Search, best: LaplaceFit, before: Identification, curves: Sequence[FittedCurve]) -> ToldLaw | None:
    """What is told of the best law for free curves, see `held_laws`; None where there is none.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
        The model that lacks something.
    before : Identification
        Of the model the search began with.
    curves : sequence of FittedCurve
        Free curves on top of it, the best first.
    """
    if (held := next(held_laws(search, best, curves, before), None)) is None:
        return None
    there = held.proposal
    return ToldLaw(there.search, held.fit, described(there.search, there.parent, held))


def law_over_course(
    search: Search, best: LaplaceFit, before: Identification, curves: Sequence[FittedCurve]
) -> tuple[ToldLaw, list[FittedCurve]] | None:
    """The best law over the course of a record, and its curves, where it gains what the best curve of a state does.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
        The model that lacks something.
    before : Identification
        Of the model the search began with.
    curves : sequence of FittedCurve
        Free curves over states on top of it, the best first.
    """
    over_course = proposing(search, best, before, tuple(PORTS), COURSES)
    law = law_for(search, best, before, over_course) if over_course else None
    if law is None or (curves and law.told.summary.evidence <= curves[0].gain):
        return None
    return law, [*over_course, *curves]


def described(search: Search, parent: LaplaceFit, held: HeldLaw) -> ProposedLaw:
    """What is told of a law.

    Parameters
    ----------
    search : Search
        That decided for it.
    parent : LaplaceFit
        The model without it there.
    held : HeldLaw
        Its fit is that there.
    """
    fit, law, proposal, (without, with_it), elpd_gain = held
    knots = next(one.knots for one in proposal.curves if one.probe is law.probe)
    with beyond_limits():
        gaps = [search.gap_left(one) for one in (parent, fit)]
    first = next(end for end, other in proposal.ranked if other is law)
    evidence = fit.log - parent.log - PRICE_OF_LOOKS - price_of_second(law)
    return ProposedLaw(
        ProposedLawSummary(
            name=law.name,
            file=f"{LAWS}/{law.file}",
            effect=f"{LAWS}/{law.file}:{law.title}",
            says=law.says,
            port=law.port,
            variables=tuple(law.variables),
            variable_units=tuple(law.variables.values()),
            valid_range=(float(knots[0]), float(knots[-1])),
            second_at_most=None if law.second is None else law.span,
            form=law.fitted.form.name,
            expression=law.expression,
            parameters=_parameters(law, fit),
            evidence=evidence,
            false_alarm=false_alarm_at_most(evidence),
            gap_before=gaps[0],
            gap_after=gaps[1],
            gap_left_out_before=without,
            gap_left_out=with_it,
            elpd_left_out=elpd_gain,
            runners_up=tuple(
                OtherLaw(name=other.name, says=other.says, evidence=end.log - first.log)
                for end, other in proposal.ranked
                if other is not law
            ),
        ),
        file=law.file,
        source=law.source,
        curve=law.probe.says,
        shape=partial(_heights, law, knots),
    )


def told_by_fit(law: ProposedLaw, effect: str, after: Identification) -> ProposedLaw:
    """A law with the numbers of the final fit, as study.toml has them.

    Parameters
    ----------
    law : ProposedLaw
    effect : str
        Name of the law in the model.
    after : Identification
        The final fit, of the model with it.
    """
    parameters = {}
    for name, one in law.summary.parameters.items():
        there = after.parameters[f"{effect}.{name}"]
        # Where the fit cannot tell an error, that of the search stands.
        error = one.std_error if there.std_error is None else there.std_error
        parameters[name] = one.model_copy(update={"value": there.value, "std_error": error})
    summary = law.summary.model_copy(update={"parameters": parameters, "gap_after": total(after.gap)})
    return replace(law, summary=summary)


def _parameters(law: Composed, fit: LaplaceFit) -> dict[str, LawParameter]:
    """Numbers of a law in SI units."""
    declared, errors = fit.supermodel.declared, fit.errors
    return {
        term.name: LawParameter(
            symbol=term.symbol,
            value=value,
            std_error=errors[f"{law.name}.{term.name}"],
            unit=declared[f"{law.name}.{term.name}"].unit,
        )
        for term, value in zip(law.terms, _values(law, fit), strict=True)
    }


def _values(law: Composed, fit: LaplaceFit) -> list[float]:
    shared = fit.shared
    return [shared[f"{law.name}.{term.name}"] for term in law.terms]


def _heights(law: Composed, knots: np.ndarray, values: Sequence[float]) -> np.ndarray:
    """The law at places along its variable, without the median."""
    found = heights_of(law, knots, values)
    return found - np.median(found)
