"""A rig: what can be measured on it and must be known of it, how it moves, and where a fit of it begins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, NamedTuple

import jax
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.laws.law import Effect
from fibrefit.rigs.signals.newton import Pull
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import FARTHER

STANDARD_GRAVITY = 9.81
"""In m/s^2: the value of central Europe, to which the rigs' published data refer."""

Values = Mapping[str, Any]
"""Scalars by name; one that may be infinite can be given `ByInverse`."""


Initial = Mapping[str, float | None]
"""Parameters of the model, those of its effects among them, with what the study states as their start."""
Stated = Sequence[Mapping[str, float]]
"""What a study says of each record, in SI units."""


class Start(NamedTuple):
    """Where a record begins to move: state and mode at `time` [s], held until then; None is the first sample."""

    state: Any
    mode: Any
    time: jax.Array | None = None


@dataclass(frozen=True)
class Starting:
    """First guesses from the records themselves, without simulation or search; in SI units.

    Parameters
    ----------
    shared : dict of float
        One for each parameter of the base model.
    each : dict of (n_record,)
        One for each nuisance and each condition that had to be learnt.
    moving : (n_record,)
        Instant [s] at which the motion begins.
    settled : (n_record,)
        Instant [s] up to which the guesses can be trusted to predict: the first contact is over.
    spread : dict of float
        Factor by which each shared guess may be wrong.
    horizons : tuple of tuple of float
        Ways to lengthen the horizon of a fit up to the whole record, in multiples of the time from `moving` to
        `settled`.
    """

    shared: dict[str, float]
    each: dict[str, np.ndarray]
    moving: np.ndarray
    settled: np.ndarray
    spread: dict[str, float]
    horizons: tuple[tuple[float, ...], ...] = ((1.0,), (2.0,))


class Variation(NamedTuple):
    """A condition in which a further record could differ from those at hand.

    Parameters
    ----------
    onto : str
        Condition onto which it comes, as an added mass onto that of the weight: a rig can do a range of the sum.
    """

    condition: str
    onto: str = ""


@dataclass(frozen=True, eq=False)
class Rig:
    """One kind of rig.

    A state is a NamedTuple with `position` [m] and `velocity`, or with `angle` [rad] and `rate` where the rig turns. A
    mode is one whose fields tell phases apart by their names: `guide` is the direction of sliding, `fibre` (`fibre_1`,
    `fibre_2`) positive while it is taut; where nothing switches, one field of any other name.

    Parameters
    ----------
    kind : str
        Name in a study.
    parameters : tuple of Parameter
        Those of the base model, the same for all records unless requested otherwise.
    nuisances : tuple of Parameter
        Unknown for each record and found unrequested.
    conditions : tuple of Parameter
        What must be known of a record; `typical` is the value assumed where a study is silent, NaN if it must speak.
    capabilities : frozenset of Capability
        What it has that laws act on.
    channels, inputs : tuple of str
        Measured channels that are explained, and those that drive the rig.
    build : callable ``(values, conditions, laws, tension_law) -> System``
    start : callable ``(system, values, conditions, inputs) -> Start``
        The inputs are those at the first sample.
    observe : callable ``(system, state, mode, inputs) -> {channel: value}``
        True value of each channel at one instant, in SI units, before any sensor.
    starting : callable ``(traces, stated, initial) -> Starting``
        Where a fit begins; a `DataError` where the records do not show it.
    anchor : str or None
        Channel whose measured value and rate tell where the motion begins, as an input "anchor"; a motion that nothing
        brings back to its place is begun anew again and again.
    fibres : callable ``(system, state, mode, inputs) -> ((stretch, rate), ...)``, optional
        Stretch [m] and its rate [m/s] of each fibre at one instant, negative while slack; None where there is no fibre.
    directions : tuple of str
        Words for the + and the - direction of the position.
    prepared : callable ``(trace) -> trace``, optional
        What is made of a record before it is compared: cut to where a motion begins, or given its derived inputs.
    derived : tuple of str
        Inputs that are made of measured ones, of a rig whose motion is known from its records.
    further : tuple of Variation
        Conditions in which a further record could differ; none where the rig allows no choice.
    possible : mapping of str to (float, float), in SI units
        Least and most of what a study says that the rig can do, by condition or as ``drive_travel``, ``drive_speed``.
    planned : callable ``(conditions) -> {nuisance: value}``, optional
        Nuisances of a record that is planned; zero where not named. None where only a measurement tells how a motion
        begins: such a record cannot be planned.
    per_unit_of : str
        Parameter that the others are found per unit of only, unless ``added_<name>`` differs between records.
    pulled : callable ``(conditions, position (n_time,)) -> Pull``, optional
        What acts on the weight besides friction, where its mass and its gravity are known.
    variants : mapping of str to Rig
        Rigs of which a study says that less of them was measured, or something else explained, by its `variant`.
    """

    kind: str
    parameters: tuple[Parameter, ...]
    nuisances: tuple[Parameter, ...]
    conditions: tuple[Parameter, ...]
    capabilities: frozenset[Capability]
    channels: tuple[str, ...]
    inputs: tuple[str, ...]
    build: Callable[[Values, Values, tuple[Effect, ...], str], Any]
    start: Callable[[Any, Values, Values, Any], Start]
    observe: Callable[[Any, Any, Any, Any], dict[str, jax.Array]]
    starting: Callable[[Sequence[Trace], Stated, Initial], Starting]
    anchor: str | None = None
    fibres: Callable[[Any, Any, Any, Any], tuple[tuple[jax.Array, jax.Array], ...]] | None = None
    directions: tuple[str, str] = ("forwards", "back")
    prepared: Callable[[Trace], Trace] | None = None
    derived: tuple[str, ...] = ()
    further: tuple[Variation, ...] = ()
    possible: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    planned: Callable[[Mapping[str, float]], Mapping[str, float]] | None = lambda _: {}
    per_unit_of: str = ""
    pulled: Callable[[Mapping[str, float], np.ndarray], Pull] | None = None
    variants: Mapping[str, Rig] = field(default_factory=dict)

    @property
    def measured(self) -> tuple[str, ...]:
        """Channels that a record must hold."""
        return (*self.channels, *(name for name in self.inputs if name not in self.derived))

    def finding(self, name: str, value: float) -> Rig:
        """The rig with one of its conditions as a parameter that all records share.

        Parameters
        ----------
        value : float
            About which it is known, in SI units.

        Raises
        ------
        KeyError
            If the rig has no such condition.
        """
        known = {condition.name: condition for condition in self.conditions}
        freed = replace(known[name], typical=value or 1.0)
        # A slope of just 90 degrees may turn out on either side of it.
        freed = replace(freed, lower=freed.lower if value > freed.lower else -math.inf)
        freed = replace(freed, upper=freed.upper if value < freed.upper else math.inf)
        conditions = tuple(freed if condition.name == name else condition for condition in self.conditions)
        # What all records share is the same in a further one.
        further = tuple(variation for variation in self.further if variation.condition != name)
        return replace(self, parameters=(*self.parameters, freed), conditions=conditions, further=further)

    def reach(self, stated: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
        """Least and most of each condition that a further record could have, in SI units.

        As a study says that the rig can do; where it says nothing what was measured, wider by a factor at either end.

        Parameters
        ----------
        stated : mapping of str to (n_record,) in SI units
            Conditions of the records at hand.
        """
        found = {}
        for condition, onto in self.further:
            ends = self.possible.get(condition)
            if not ends:
                (declared,) = (p for p in self.conditions if p.name == condition)
                known = np.asarray(stated[condition], dtype=float)
                base = np.asarray(stated[onto], dtype=float) if onto else np.zeros(len(known))
                whole = known + base
                # A further record is like the first one but for what is varied.
                beyond = whole.min() / FARTHER - base[0], whole.max() * FARTHER - base[0]
                low, high = (float(np.clip(end, declared.lower, declared.upper)) for end in beyond)
                ends = low, high
            found[condition] = ends
        return found

    def menu(self, stated: Mapping[str, Any]) -> tuple[dict[str, float], ...]:
        """Conditions that further records could be measured under: all combinations of the `further` ones.

        Each is at an end of its `reach`, or the largest that was measured.

        Parameters
        ----------
        stated : mapping of str to (n_record,) in SI units
            Conditions of the records at hand.

        Returns
        -------
        tuple of dict of str to float
            In SI units; empty where there is no choice.
        """
        axes = {
            # A change of units may round what was measured beyond its end.
            name: sorted({low, float(np.clip(np.max(stated[name]), low, high)), high})
            for name, (low, high) in self.reach(stated).items()
        }
        return tuple(dict(zip(axes, values, strict=True)) for values in product(*axes.values())) if axes else ()
