"""Programs of the first round of a search, which can be made while the first fit goes on.

A fit whose inputs are exact leaves cores idle, and a round waits for a dozen programs that take longer to compile than
to run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from fibrefit.discovery.curves.predicted import probe_sets
from fibrefit.discovery.curves.probes import PROBES
from fibrefit.discovery.engine.supermodel import simulation_groups, supermodel_of
from fibrefit.laws.catalogue import is_costly
from fibrefit.laws.law import Effect
from fibrefit.laws.ports import PORTS
from fibrefit.problem import Task


def first_programs(task: Task, effects: Sequence[type[Effect]]) -> list[Callable[[], None]]:
    """Jobs that make the programs in which effects and curves over a state are looked at first, in the order of need.

    Parameters
    ----------
    task : Task
        Of the model to begin with; its inputs are exact.
    effects : sequence of Effect classes
        That may be missing.
    """
    model = task.problem.model
    wanted = [effect for effect in effects if effect not in model.effects]
    groups = simulation_groups(wanted, any(effect.stiff for effect in model.effects))
    stiff = lambda group: any(effect.stiff for effect in group)  # noqa: E731
    last = [group for group in groups if all(map(is_costly, group))]
    first = sorted((group for group in groups if group not in last), key=stiff)
    # What takes longest to make is begun first, and a round asks for it last.
    last = sorted(last, key=stiff, reverse=True)
    curves = probe_sets(model.rig, {probe.variable for probe in PROBES}, tuple(PORTS), [PROBES])
    in_turn: list[Sequence[type[Effect]]] = [*map(_by_name, first), *curves, *map(_by_name, last)]
    return [partial(_made, task, each) for each in in_turn]


def _by_name(group: Sequence[type[Effect]]) -> list[type[Effect]]:
    return sorted(group, key=lambda effect: effect.name)


def _made(task: Task, effects: Sequence[type[Effect]]) -> None:
    supermodel_of(task, effects).make_program()
