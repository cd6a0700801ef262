"""The search for laws of speed: that of a missing effect, in one supermodel that holds all laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.series.together.laws import parameter_of


@dataclass(frozen=True)
class SpeedSearch(Search):
    """A search whose candidates are laws of speed, at most one for each parameter."""

    @classmethod
    def of(cls, search: Search) -> SpeedSearch:
        """The same search with this way to try candidates."""
        return cls(**{one.name: getattr(search, one.name) for one in fields(Search)})

    def extensions(self, parent: LaplaceFit) -> tuple[type[Effect], ...]:
        """Laws of parameters that have none yet."""
        taken = {parameter_of(effect) for effect in (*self.task.problem.model.effects, *parent.effects)}
        return tuple(effect for effect in self.effects if parameter_of(effect) not in taken)

    def in_turn(self, ranked: Sequence[type[Effect]]) -> list[list[type[Effect]]]:
        """All forms of a law together, that of the parameter first of which slopes predict most."""
        parameters = dict.fromkeys(map(parameter_of, ranked))
        return [[effect for effect in ranked if parameter_of(effect) == name] for name in parameters]

    def supermodel_for(self, effect: type[Effect], others: Sequence[type[Effect]] = ()) -> Supermodel:
        """The one supermodel that holds all laws: they are few and quick, and one program serves every round."""
        with self.lock:
            for supermodel in self.supermodels:
                if supermodel.holds(self.effects) and supermodel.sensitivities is self.base.supermodel.sensitivities:
                    return supermodel
            self.supermodels.append(supermodel_of(self.task, self.effects, self.base.supermodel.sensitivities))
            return self.supermodels[-1]
