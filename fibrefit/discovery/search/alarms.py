"""What tests of the innovations have to say against a model of a search."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from fibrefit.discovery.engine.effort import LINEARISED_ANEW, settles
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.residuals.innovations import Alarm, tests_of
from fibrefit.discovery.search.inputs import Confirmation, confirmed
from fibrefit.discovery.search.search import Search


def alarms_of(search: Search, fitted: LaplaceFit) -> list[Alarm]:
    """Tests of the innovations that say a model is not complete."""
    task = search.task
    tested = tests_of(search.inference, fitted, task.traces, task.problem.model.rig.channels, task.steps)
    return [alarm for alarm in tested if alarm.raised]


def most_nats(alarms: Collection[Alarm]) -> float:
    """The most nats of tests that object; 0 where none does."""
    return max((alarm.nats for alarm in alarms), default=0.0)


def confirmed_where_it_settles(
    search: Search, parent: LaplaceFit, found: LaplaceFit
) -> tuple[Confirmation | None, float]:
    """What a hypothesis gains about itself, and the nats by which tests object there; None, 0 as of `confirmed`.

    What readings miss that are linearised about another model looks like something left: they are linearised about it
    again as long as that halves what tests object by. A jump, and noise that rests do not show, are told in no nats:
    where nothing else objects the nats are infinite.
    """
    if (seen := confirmed(search, parent, found)) is None:
        return None, 0.0
    alarms = alarms_of(seen.search, seen.found)
    for _ in range(LINEARISED_ANEW):
        if not most_nats(alarms) or (again := confirmed(seen.search, seen.parent, seen.found)) is None:
            break
        still = alarms_of(again.search, again.found)
        if not settles(most_nats(alarms), most_nats(still)):
            break
        seen, alarms = replace(again, led=seen.led or again.led), still
    return seen, most_nats(alarms) or (float("inf") if alarms else 0.0)
