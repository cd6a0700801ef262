"""A free curve as the relaxation of every law in its place: what a law costs, and where base parameters go with it.

About a curve the likelihood is a quadratic form in its heights and the base parameters. With these eliminated (the
profile likelihood of the heights) it tells what any law in the place of the curve would cost, what base parameters
take up of it for nothing; and given a law, where they are. What stands for a law is the piecewise linear curve nearest
to it: where it turns within a few knots, heights are larger than the law is anywhere.

Source
------
Conditional of a normal law: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), A.2. Profile
likelihood: Murphy and van der Vaart, J. Am. Stat. Assoc. 95 (2000).
"""

from __future__ import annotations

import numpy as np

from fibrefit.discovery.curves.free_form import FittedCurve
from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.laws.forms import Quadratic

UNSEEN = 1e-10
"""Share of the largest eigenvalue below which a direction of the heights is rounding."""
FINER = 8
"""Places between neighbouring knots at which a law is held against its curve."""


def places_along(knots: np.ndarray) -> np.ndarray:
    """Where laws are held against a curve with such knots, ``(n_place,)`` in SI units."""
    return np.linspace(knots[0], knots[-1], FINER * (len(knots) - 1) + 1)


def nearest_curve(knots: np.ndarray) -> np.ndarray:
    """Heights of the piecewise linear curve nearest to values at `places_along` the knots: ``(n_knot, n_place)``."""
    places = places_along(knots)
    return np.linalg.pinv(np.stack([np.interp(places, knots, one) for one in np.eye(len(knots))], axis=1))


def quadratic_of(curve: FittedCurve) -> Quadratic:
    """What a law in the place of a curve costs by the records alone, base parameters refitted, in twice nats.

    Parameters
    ----------
    curve : FittedCurve
    """
    n, size, evidence = len(curve.knots), curve.walk.size, curve.fitted.evidence
    posterior = np.linalg.inv(evidence.spread[-n:, -n:])
    # Of the posterior of the heights, at whose mean precision and pull are in balance, the prior is taken off.
    seen, directions = np.linalg.eigh(posterior - curve.walk.precision())
    kept = seen > UNSEEN * seen[-1]
    pull = directions[:, kept].T @ (posterior @ evidence.mean[-n:])
    root = np.sqrt(seen[kept])
    half = root[:, None] * directions[:, kept].T / size
    return Quadratic(curve.knots, places_along(curve.knots), half @ nearest_curve(curve.knots), pull / root)


def beside(curve: FittedCurve, values: np.ndarray, supermodel: Supermodel) -> np.ndarray:
    """Values ``(n_record, n_local)`` in SI units beside a law in the place of a curve, those of the law aside.

    Base parameters are where they are most probable given the law, to first order; each record's own stay.

    Parameters
    ----------
    curve : FittedCurve
    values : (n_place,) in SI units
        Of the law, at `places_along` the knots.
    supermodel : Supermodel
        Of the values.
    """
    found, n = curve.fitted.evidence, len(curve.knots)
    spread, place = found.spread, found.mode.place
    heights = nearest_curve(curve.knots) @ values
    away = np.linalg.solve(spread[-n:, -n:], heights / curve.walk.size - found.mean[-n:])
    z = place.z.copy()
    z[:-n] = found.mean[:-n] + spread[:-n, -n:] @ away
    unknowns = found.mode.unknowns
    z = np.clip(z, unknowns.lower, unknowns.upper)
    return transferred(supermodel, curve.fitted.supermodel, unknowns.local_of(place._replace(z=z)))
