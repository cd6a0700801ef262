"""Which of the laws for a free curve is told, held to records it was not fitted to, and what is told of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.time_limit import beyond_limits, in_time
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


def holding(proposal: Proposal) -> HeldLaw | None:
    """Of laws that are not distinguished, the one that predicts left-out records best; None where none holds on them.

    Parameters
    ----------
    proposal : Proposal
    """
    best = HeldLaw(*proposal.ranked[0], proposal)
    if len(proposal.search.task.problem.layout.records) == 1:
        return best
    found, came = in_time(partial(_by_left_out, proposal), best)
    return found if not came or 0.0 < found.elpd_gain < np.inf else None


def held_law(
    search: Search, best: LaplaceFit, curves: Sequence[FittedCurve], before: Identification | None = None
) -> HeldLaw | None:
    """The best law for free curves on top of a model; None where they do better, or it does not hold.

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
    return None if proposal is None else holding(proposal)


def _by_left_out(proposal: Proposal) -> HeldLaw:
    """The law that foresees most of records left out, each with deviations of its own, as probable as they are.

    What shared values leave of a record is mostly what it differs by: a law that is right moves that as it comes.
    """
    search = proposal.search
    near = [pair for pair in proposal.ranked if proposal.best.log - pair[0].log < APART]
    number = 1 + len(near)
    before, *seen = (
        left_out(search, one, lambda share, i=i: search.tell(FORESEEING, (i + share) / number))  # type: ignore[misc]
        for i, one in enumerate((proposal.parent, *(end for end, _ in near)))
    )
    found = [
        HeldLaw(end, law, proposal, (before.gap, with_it.gap), float(np.sum(with_it.elpd - before.elpd)))
        for (end, law), with_it in zip(near, seen, strict=True)
    ]
    return max(found, key=lambda one: one.elpd_gain if np.isfinite(one.elpd_gain) else -np.inf)


class ToldLaw(NamedTuple):
    """A law, the model with it, and the search that it was found in."""

    search: Search
    fit: LaplaceFit
    told: ProposedLaw

    def without(self, gone: Collection[type[Effect]]) -> ToldLaw:
        """The same with a model without effects that are not kept."""
        kept = tuple(effect for effect in self.fit.effects if effect not in gone)
        return self if kept == self.fit.effects else self._replace(fit=self.search.inference.without(self.fit, kept))


def law_for(search: Search, best: LaplaceFit, before: Identification, curves: Sequence[FittedCurve]) -> ToldLaw | None:
    """What is told of the best law for free curves, see `held_law`; None where there is none.

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
    if (held := held_law(search, best, curves, before)) is None:
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
        probe=law.probe.name,
        heights=_heights(law, _values(law, fit), knots),
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
    return ProposedLaw(summary, law.file, law.source, law.probe, law.heights)


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


def _heights(law: Composed, values: Sequence[float], knots: np.ndarray) -> np.ndarray:
    """The law at places along its variable, without the median."""
    found = heights_of(law, knots, values)
    return found - np.median(found)
