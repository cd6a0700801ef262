"""What tests of the innovations have to say against a model of a search."""

from __future__ import annotations

from collections.abc import Collection

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.residuals.innovations import Alarm, tests_of
from fibrefit.discovery.search.search import Search


def alarms_of(search: Search, fitted: LaplaceFit) -> list[Alarm]:
    """Tests of the innovations that say a model is not complete."""
    task = search.task
    tested = tests_of(search.inference, fitted, task.traces, task.problem.model.rig.channels, task.steps)
    return [alarm for alarm in tested if alarm.raised]


def most_nats(alarms: Collection[Alarm]) -> float:
    """The most nats of tests that object; 0 where none does."""
    return max((alarm.nats for alarm in alarms), default=0.0)
