"""Explanations that do equally well, and the further record that tells them apart best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fibrefit.discovery.design.apart import Contest
from fibrefit.discovery.design.menu import menu_of
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.model.finding import separation
from fibrefit.discovery.search.search import Search
from fibrefit.study.summaries.discovery import Separation


@dataclass(frozen=True)
class Rivals:
    """What was added, and what would have explained the records as well in its place.

    Parameters
    ----------
    names : (str, str)
    models : (LaplaceFit, LaplaceFit)
        With the one and with the other.
    """

    names: tuple[str, str]
    models: tuple[LaplaceFit, LaplaceFit]


def separating_experiment(search: Search, rivals: Rivals) -> Separation | None:
    """The record of the menu that tells two explanations apart best; None where the rig has no menu.

    That of which the second one, at its best as slopes say, misses most where the first one is true.

    Parameters
    ----------
    search : Search
    rivals : Rivals
    """
    if not (menu := menu_of(search.task)):
        return None
    contest = Contest.between(search, *rivals.models)
    before, after = contest.now, np.array(contest.by_slopes(menu))
    if not (np.isfinite(before) and np.isfinite(after).any()):
        return None
    best = int(np.nanargmax(after))
    record = search.task.problem.layout.records[menu[best].record]
    return separation(rivals.names, menu[best], record, before, float(after[best]))
