"""What a study says about a parameter: start, range, prior, whether it is held or shared."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictBool, StrictFloat, StrictStr

from fibrefit.core.declarations import Parameter
from fibrefit.core.errors import Mistakes, StudyError
from fibrefit.core.limits import SMALLEST_SIZE
from fibrefit.core.units import IN_PERCENT, NOT_IN_PERCENT, in_percent, uncertain
from fibrefit.study.quantity import CHECK_IT, quantity_in, quoted, refusal
from fibrefit.study.table import StudyTable

NORMAL_SUPPORT = 10.0
"""Standard deviations from its mean beyond which a normal prior allows nothing: less than 1e-23 of it lies there."""

#: What a change of units may add to a limit: pi/2 rad and 90 deg are one.
UNIT_ROUNDING = 1e-9

#: A quantity whose unit the parameter's declaration tells; a bare number is right only where that unit is "-".
Quantity = StrictStr | StrictFloat


class NormalPrior(StudyTable):
    """Normal distribution; truncated where a limit is given."""

    kind: Literal["normal"]
    mean: Quantity
    sd: Quantity
    lower: Quantity | None = None
    upper: Quantity | None = None


class HalfNormalPrior(StudyTable):
    """Normal distribution around zero, positive half."""

    kind: Literal["half_normal"]
    sd: Quantity


class LogNormalPrior(StudyTable):
    """Normal distribution of the logarithm; `log_sd` is its standard deviation, a pure number."""

    kind: Literal["log_normal"]
    median: Quantity
    log_sd: Annotated[float, Field(gt=0, le=100.0)]


class UniformPrior(StudyTable):
    """Equal density between two limits."""

    kind: Literal["uniform"]
    lower: Quantity
    upper: Quantity


class LogUniformPrior(StudyTable):
    """Equal density of the logarithm between two positive limits."""

    kind: Literal["log_uniform"]
    lower: Quantity
    upper: Quantity


AnyPrior = Annotated[
    NormalPrior | HalfNormalPrior | LogNormalPrior | UniformPrior | LogUniformPrior, Field(discriminator="kind")
]


def _normal_prior(said: Any) -> Any:
    """The normal prior that ``"3.1 +/- 0.05 kg"`` stands for."""
    if not isinstance(said, str):
        return said
    if in_percent(said):
        raise refusal(f"{quoted(said)}: {IN_PERCENT}", 'a prior such as "3.1 +/- 0.05 kg"', NOT_IN_PERCENT)
    if (parts := uncertain(said)) is None:
        raise refusal(quoted(said), 'a prior such as "3.1 +/- 0.05 kg", or a table with its kind', "")
    mean, sd = (float(part) if " " not in part else part for part in parts)
    return {"kind": "normal", "mean": mean, "sd": sd}


Prior = Annotated[AnyPrior, BeforeValidator(_normal_prior, json_schema_input_type=AnyPrior | StrictStr)]


class ParameterTable(StudyTable):
    """One table ``[parameters.NAME]`` of a study."""

    initial: Quantity | None = None
    """Starting value; found from the data when absent."""
    bounds: tuple[Quantity, Quantity] | None = None
    """Lower and upper limit."""
    fixed: StrictBool | Quantity = False
    """true holds `initial`; a quantity holds itself."""
    prior: Prior | None = None
    """Distribution before the data; "3.1 +/- 0.05 kg" is a normal one."""
    shared: StrictBool = True
    """One value for all records, or one a record."""


@dataclass(frozen=True, slots=True)
class PriorSetting:
    """A prior in SI.

    Parameters
    ----------
    kind : str
        ``normal``, ``half_normal``, ``log_normal``, ``uniform`` or ``log_uniform``.
    centre : float
        Mean (normal) or median (log-normal), in the parameter's unit; nan where the kind has none.
    spread : float
        Standard deviation, in the parameter's unit; of the logarithm, a pure number, for ``log_normal``.
    lower, upper : float
        Support, in the parameter's unit.
    """

    kind: str
    centre: float = math.nan
    spread: float = math.nan
    lower: float = -math.inf
    upper: float = math.inf

    @property
    def lowest(self) -> float:
        """Least value that it allows at all."""
        return max(self.lower, self._tail(-1.0))

    @property
    def highest(self) -> float:
        """Largest value that it allows at all."""
        return min(self.upper, self._tail(1.0))

    def _tail(self, side: float) -> float:
        normal = not math.isnan(self.centre) and self.kind != "log_normal"
        return self.centre + side * NORMAL_SUPPORT * self.spread if normal else side * math.inf


@dataclass(frozen=True, slots=True)
class ParameterSetting:
    """What a study says about a parameter, in SI.

    Parameters
    ----------
    name, unit : str
        Name of the parameter and SI unit of all its numbers.
    initial : float or None
        Starting value, or the value held; None: to be found from the data.
    lower, upper : float or None
        Limits of the study; None: those of the parameter's declaration hold.
    fixed : bool
        Whether it is held at `initial`.
    shared : bool
        One value for all records (True) or one a record.
    prior : PriorSetting or None
        Distribution before the data; None: the default.
    """

    name: str
    unit: str
    initial: float | None = None
    lower: float | None = None
    upper: float | None = None
    fixed: bool = False
    shared: bool = True
    prior: PriorSetting | None = None


def setting_of(name: str, table: ParameterTable, unit: str, locate: Callable[[str], str]) -> ParameterSetting:
    """Setting of a parameter in SI, from its table and its unit.

    Parameters
    ----------
    name, unit : str
        Name and SI unit of the parameter.
    table : ParameterTable
        What the study says.
    locate : callable
        Gives file and place of a key below the table (``".bounds"``), for messages.

    Returns
    -------
    ParameterSetting
        All numbers in `unit`.

    Raises
    ------
    StudyError
        If a quantity has the wrong unit, limits are swapped, the start lies outside them, or a held value is missing.
    """

    def number(key: str, written: Quantity) -> float:
        """Number in `unit`: a bare one for a pure number, else text with a unit."""
        if unit == "-" and isinstance(written, float):
            return written
        return quantity_in(written, unit, "0.05" if unit == "-" else f"1 {unit}", locate(f".{key}"))

    initial, lower, upper, prior = None, None, None, None
    with Mistakes(locate("")) as mistakes:
        with mistakes.collect():
            initial = None if table.initial is None else number("initial", table.initial)
            if table.fixed is True and initial is None:
                raise StudyError(locate(".fixed"), "true, but no initial", "the value to hold", "Give it as initial.")
            if not isinstance(table.fixed, bool):
                fixed = number("fixed", table.fixed)
                if initial is not None and initial != fixed:
                    raise StudyError(locate(""), "initial and fixed differ", "one value", "Remove initial.")
                initial = fixed
        with mistakes.collect():
            if table.bounds is not None:
                lower, upper = (number(f"bounds[{i}]", bound) for i, bound in enumerate(table.bounds))
                _refuse_swapped(lower, upper, unit, locate(".bounds"))
        with mistakes.collect():
            prior = None if table.prior is None else _prior(table.prior, number, unit, locate)
    if initial is not None and lower is not None and upper is not None and not lower <= initial <= upper:
        got, expected = f"initial {initial:g} {unit} lies outside bounds", f"{lower:g} to {upper:g} {unit}"
        raise StudyError(locate(""), got, expected, "Change one.")
    return ParameterSetting(name, unit, initial, lower, upper, table.fixed is not False, table.shared, prior)


def with_initial(table: ParameterTable, value: float, setting: ParameterSetting, declared: Parameter) -> ParameterTable:
    """A table whose start is a value that was found: one at a limit may lie a rounding error beyond it.

    Parameters
    ----------
    setting : ParameterSetting
        What the table says, with the limits of the study.
    declared : Parameter
        With the physical range.
    """
    low = max(declared.lower, -math.inf if setting.lower is None else setting.lower)
    high = min(declared.upper, math.inf if setting.upper is None else setting.upper)
    inside = float(min(max(value, low), high))
    return table.model_copy(update={"initial": inside if setting.unit == "-" else f"{inside!r} {setting.unit}"})


def check_possible(setting: ParameterSetting, declared: Parameter, locate: Callable[[str], str]) -> None:
    """Refuse a start, limits or a prior that leave a parameter no value of its physical range.

    Parameters
    ----------
    declared : Parameter
        With the physical range.
    locate : callable
        As for `setting_of`.

    Raises
    ------
    StudyError
        For the first of them.
    """
    low, high, unit = declared.lower, declared.upper, setting.unit
    expected = f"{low:g} to {high:g} {unit}, in which {declared.name} can be"
    if setting.initial is not None and not low <= setting.initial <= high:
        key = ".fixed" if setting.fixed else ".initial"
        raise StudyError(locate(key), f"{setting.initial:g} {unit}", expected, CHECK_IT)
    stated = low if setting.lower is None else setting.lower, high if setting.upper is None else setting.upper
    if max(stated[0], low) >= min(stated[1], high):
        raise StudyError(locate(".bounds"), f"{stated[0]:g} to {stated[1]:g} {unit}", f"a part of {expected}", CHECK_IT)
    beyond = [(i, at) for i, at in enumerate(stated) if not (_reaches(low, at) and _reaches(at, high))]
    if beyond:
        (side, at), limit = beyond[0], (low, high)[beyond[0][0]]
        do = f"Write {limit:g} {unit} there, or a value inside." if math.isfinite(limit) else CHECK_IT
        raise StudyError(locate(f".bounds[{side}]"), f"{at:g} {unit}", f"a part of {expected}", do)
    prior = setting.prior
    if prior is not None and (prior.highest < low or prior.lowest > high):
        said = f"{prior.lowest:g} to {prior.highest:g} {unit} at the utmost"
        raise StudyError(locate(".prior"), said, f"a part of {expected}", CHECK_IT)


def _reaches(low: float, high: float) -> bool:
    """Whether one number is no higher than another, but for what a change of units rounds off."""
    return low <= high or math.isclose(low, high, rel_tol=UNIT_ROUNDING)


def _prior(
    prior: Prior, number: Callable[[str, Quantity], float], unit: str, locate: Callable[[str], str]
) -> PriorSetting:
    """Prior in SI, its limits and widths checked."""

    def get(key: str, default: float) -> float:
        written = getattr(prior, key, None)
        return default if written is None else number(f"prior.{key}", written)

    lower, upper = get("lower", -math.inf), get("upper", math.inf)
    _refuse_swapped(lower, upper, unit, locate(".prior"))
    if prior.kind == "log_uniform" and lower <= 0:
        do = "A logarithm is taken of it."
        raise StudyError(locate(".prior.lower"), f"{lower:g} {unit}", f"a value above 0 {unit}", do)
    if isinstance(prior, LogNormalPrior):
        median = _positive(get("median", math.nan), unit, locate(".prior.median"))
        log_sd = _positive(prior.log_sd, "-", locate(".prior.log_sd"))
        return PriorSetting(prior.kind, median, log_sd, 0.0, upper)
    if isinstance(prior, UniformPrior | LogUniformPrior):
        return PriorSetting(prior.kind, lower=lower, upper=upper)
    spread = _positive(get("sd", math.nan), unit, locate(".prior.sd"))
    if isinstance(prior, HalfNormalPrior):
        return PriorSetting(prior.kind, 0.0, spread, 0.0, upper)
    return PriorSetting(prior.kind, get("mean", math.nan), spread, lower, upper)


def _positive(value: float, unit: str, where: str) -> float:
    if value <= 0:
        raise StudyError(where, f"{value:g} {unit}", f"a value above 0 {unit}", "")
    if value < SMALLEST_SIZE:
        raise StudyError(where, f"{value:g} {unit}", f"at least {SMALLEST_SIZE:g} {unit}", CHECK_IT)
    return value


def _refuse_swapped(lower: float, upper: float, unit: str, where: str) -> None:
    if lower >= upper:
        expected = "the lower limit first, and below the upper"
        raise StudyError(where, f"{lower:g} to {upper:g} {unit}", expected, "Swap or widen them.")
