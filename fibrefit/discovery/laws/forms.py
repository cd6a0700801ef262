"""The forms a law may have, and which of them a free curve has: fast regressions that propose, and decide nothing.

Each form is linear in its heights and not in its shape. The heights are eliminated, as base parameters are before them
(`relaxation`); the shape is looked for on a grid and then to the bottom.

Source
------
Variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973). Schwarz, Ann. Stat. 6 (1978), on the price of
parameters. The peak is that of a relaxation's loss over the rate (Debye, Polar Molecules (1929), ch. V) and of an eddy
current brake over the speed (Smythe, Trans. AIEE 61 (1942)).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

Shape = tuple[float, ...]


class Term(NamedTuple):
    """One number of a form.

    Parameters
    ----------
    name : str
    says : str
    kind : {"height", "slope", "steep", "place", "length", "number", "turn", "second"}
        What it is measured in: as the curve, as the curve over the variable, in all of its range or in a part of it, as
        the variable, by itself, or as one over a second variable. A length is positive and spans decades.
    symbol : str
        In the equation of its form.
    """

    name: str
    says: str
    kind: str
    symbol: str


@dataclass(frozen=True)
class Form:
    """How a law may depend on its variable.

    Parameters
    ----------
    name, says : str
        ``says`` follows on "a friction that".
    law : str
        The equation, x the variable.
    code : str
        The same in a method of an effect; ``LOW`` and ``SPAN`` stand for the left end and the length of the variable's
        range.
    quantities : tuple of Term
        Heights first.
    columns : callable
        Of places ``(n,)`` from 0 to 1 along the range and a shape in units of it: ``(n, n_height)``.
    grid : tuple of tuple of float
        Of each number of the shape, in units of the range.
    named : callable
        Heights and shape as the form's quantities, given the left end and length of the range.
    periodic : bool
        Whether the shape is a period.
    begins : bool
        Whether it begins at the left end of the range; of a variable with two signs it begins at zero, and is odd.
    odd : bool
        Whether there is such a form of a variable with two signs.
    """

    name: str
    says: str
    law: str
    code: str
    quantities: tuple[Term, ...]
    columns: Callable[[np.ndarray, Shape], np.ndarray]
    grid: tuple[tuple[float, ...], ...]
    named: Callable[[np.ndarray, Shape, float, float], tuple[float, ...]]
    periodic: bool = False
    begins: bool = False
    odd: bool = True

    def ends(self, low: float, high: float, signed: bool) -> tuple[float, float]:
        """Where it begins, and the length that its shape is told in."""
        return (0.0, high) if signed and self.begins else (low, high - low)

    def columns_at(self, x: np.ndarray, shape: Shape, ends: tuple[float, float], signed: bool) -> np.ndarray:
        """Columns at values of the variable, ``(n, n_height)``, see `columns`."""
        u = (x - ends[0]) / ends[1]
        if signed and self.begins:
            return np.sign(u)[:, None] * self.columns(np.abs(u), shape)
        return self.columns(u, shape)

    def resolved_grid(self, places: np.ndarray) -> tuple[tuple[float, ...], ...]:
        """The grid without shapes that knots at `places` do not resolve: periods below two distances (Nyquist)."""
        least = 2.0 * float(np.max(np.diff(places))) if self.periodic else 0.0
        return tuple(tuple(step for step in steps if step >= least) for steps in self.grid)


STEEP = 0.01
"""Half width of a step, as a share of the range: a jump, but one that can be integrated across."""
_AMPLITUDE = Term("amplitude", "largest value", "height", "a")
_SLOPE = Term("slope", "change over the variable", "slope", "a")
_BEYOND = _SLOPE._replace(kind="steep")
_KNEE = Term("knee", "place from which it acts", "place", "b")
_PLACES = tuple(np.linspace(0.05, 0.95, 37))
_LENGTHS = tuple(np.geomspace(0.02, 3.0, 24))
_PERIODS = tuple(np.geomspace(0.025, 2.0, 700))


def _one(values: np.ndarray) -> np.ndarray:
    return values[:, None]


FORMS: tuple[Form, ...] = (
    Form(
        "linear", "is proportional to", "a x", "self.slope * x", (_SLOPE,),
        lambda u, shape: _one(u), (),
        lambda heights, shape, low, span: (heights[0] / span,),
    ),
    Form(
        "knee_above", "grows in proportion beyond a place in", "a max(x - b, 0)",
        "self.slope * jnp.maximum(x - self.knee, 0.0)", (_BEYOND, _KNEE),
        lambda u, shape: _one(np.maximum(u - shape[0], 0.0)), (_PLACES,),
        lambda heights, shape, low, span: (heights[0] / span, low + span * shape[0]),
    ),
    Form(
        "knee_below", "grows in proportion below a place in", "a max(b - x, 0)",
        "self.slope * jnp.maximum(self.knee - x, 0.0)", (_BEYOND, _KNEE),
        lambda u, shape: _one(np.maximum(shape[0] - u, 0.0)), (_PLACES,),
        lambda heights, shape, low, span: (heights[0] / span, low + span * shape[0]),
    ),
    Form(
        "power", "is a power of", "a ((x - x0) / X)^n",
        "self.amplitude * jnp.maximum((x - LOW) / SPAN, 1e-9) ** self.exponent",
        (_AMPLITUDE, Term("exponent", "exponent", "number", "n")),
        lambda u, shape: _one(np.maximum(u, 1e-9) ** shape[0]), (tuple(np.geomspace(0.2, 6.0, 30)),),
        lambda heights, shape, low, span: (heights[0], shape[0]), begins=True,
    ),
    Form(
        "saturating", "saturates with", "a (x - x0) / (x - x0 + s)",
        "self.amplitude * jnp.maximum(x - LOW, 0.0) / (jnp.maximum(x - LOW, 0.0) + self.scale)",
        (_AMPLITUDE, Term("scale", "where half of it is reached", "length", "s")),
        lambda u, shape: _one(u / (u + shape[0])), (_LENGTHS,),
        lambda heights, shape, low, span: (heights[0], span * shape[0]), begins=True,
    ),
    Form(
        "exponential", "decays exponentially with", "a exp(-(x - x0) / s)",
        "self.amplitude * jnp.exp(-jnp.maximum(x - LOW, 0.0) / self.scale)",
        (_AMPLITUDE, Term("scale", "over which it falls to 1/e", "length", "s")),
        lambda u, shape: _one(np.exp(-u / shape[0])), (_LENGTHS,),
        lambda heights, shape, low, span: (heights[0], span * shape[0]), begins=True, odd=False,
    ),
    Form(
        "peak", "rises to a peak and falls beyond it with", "2 a ((x - x0) / s) / (1 + ((x - x0) / s)^2)",
        "2.0 * self.amplitude * self.scale * jnp.maximum(x - LOW, 0.0)"
        " / (self.scale**2 + jnp.maximum(x - LOW, 0.0) ** 2)",
        (_AMPLITUDE, Term("scale", "where the peak lies", "length", "s")),
        lambda u, shape: _one(2.0 * (u / shape[0]) / (1.0 + (u / shape[0]) ** 2)), (_LENGTHS,),
        lambda heights, shape, low, span: (heights[0], span * shape[0]), begins=True,
    ),
    Form(
        "bump", "has a bump at a place in", "a exp(-((x - b) / w)^2 / 2)",
        "self.amplitude * jnp.exp(-(((x - self.centre) / self.width) ** 2) / 2.0)",
        (_AMPLITUDE, Term("centre", "place of the bump", "place", "b"), Term("width", "standard width", "length", "w")),
        lambda u, shape: _one(np.exp(-(((u - shape[0]) / shape[1]) ** 2) / 2.0)),
        (_PLACES, tuple(np.geomspace(0.01, 0.5, 12))),
        lambda heights, shape, low, span: (heights[0], low + span * shape[0], span * shape[1]),
    ),
    Form(
        "sine", "varies as a sine of", "a sin(2 pi (x - x0) / p + c)",
        "self.amplitude * jnp.sin(2.0 * jnp.pi * (x - LOW) / self.period + self.phase)",
        (_AMPLITUDE, Term("period", "period", "length", "p"), Term("phase", "phase", "turn", "c")),
        lambda u, shape: np.column_stack([np.sin(2.0 * np.pi * u / shape[0]), np.cos(2.0 * np.pi * u / shape[0])]),
        (_PERIODS,),
        lambda heights, shape, low, span: (
            float(np.hypot(*heights)), span * shape[0], float(np.arctan2(heights[1], heights[0]))
        ),
        periodic=True,
    ),
    Form(
        "step", "steps at a place in", "a (1 + tanh((x - b) / W)) / 2",
        f"self.amplitude * (1.0 + jnp.tanh((x - self.place) / ({STEEP} * SPAN))) / 2.0",
        (_AMPLITUDE, Term("place", "place of the step", "place", "b")),
        lambda u, shape: _one((1.0 + np.tanh((u - shape[0]) / STEEP)) / 2.0), (_PLACES,),
        lambda heights, shape, low, span: (heights[0], low + span * shape[0]),
    ),
)  # fmt: skip


class FittedForm(NamedTuple):
    """A form fitted to a curve.

    Parameters
    ----------
    form : Form
    values : tuple of float
        Of its quantities, in SI units.
    score : float
        Schwarz's Bayesian information criterion (BIC); the lower the better.
    """

    form: Form
    values: tuple[float, ...]
    score: float


class Quadratic(NamedTuple):
    """What a law costs by the records, to second order: ``|half @ values - target|^2`` in twice nats.

    Parameters
    ----------
    knots : (n_knot,) in SI units
        Of its free curve.
    places : (n_place,) in SI units
        Of the values of the law.
    half : (n_seen, n_place) in inverse SI units
    target : (n_seen,)
    """

    knots: np.ndarray
    places: np.ndarray
    half: np.ndarray
    target: np.ndarray


def forms_of(quadratic: Quadratic, signed: bool = False) -> list[FittedForm]:
    """Every form at its best for a curve, the best first.

    Parameters
    ----------
    quadratic : Quadratic
    signed : bool
        Whether the variable has two signs, so that a form which begins at its null is odd about zero.
    """
    forms = [form for form in FORMS if not (signed and form.begins) or form.odd]
    found = [_fit(form, quadratic, signed) for form in forms]
    return sorted((one for one in found if one is not None), key=lambda one: one.score)


def _fit(form: Form, quadratic: Quadratic, signed: bool) -> FittedForm | None:
    knots = quadratic.knots
    ends = form.ends(float(knots[0]), float(knots[-1]), signed)

    def left(shape: Shape) -> tuple[float, np.ndarray]:
        columns = quadratic.half @ form.columns_at(quadratic.places, shape, ends, signed)
        found = np.linalg.lstsq(columns, quadratic.target, rcond=1e-10)[0]
        return float(np.sum((quadratic.target - columns @ found) ** 2)), found

    grid = form.resolved_grid((knots - knots[0]) / (knots[-1] - knots[0]))

    def inside(shape: np.ndarray) -> float:
        bounds = [(min(steps), max(steps)) for steps in grid]
        if any(not low <= value <= high for value, (low, high) in zip(shape, bounds, strict=True)):
            return np.inf
        return left(tuple(shape))[0]

    shape = min(product(*grid), key=lambda one: left(one)[0])
    if shape:
        shape = tuple(minimize(inside, shape, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-6}).x)
    squares, found = left(shape)
    number, seen = len(found) + len(shape), len(quadratic.target)
    if seen <= number + 1 or not np.isfinite(squares):
        return None
    return FittedForm(form, form.named(found, shape, *ends), squares + number * float(np.log(seen)))
