"""What laws of a change share: when it comes, and what is changed by it. A law is one of each."""

from __future__ import annotations

import inspect
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.laws.law import INSTANTS, Effect, FibreLaw, GuideLaw, Moment, quantity


class OfOneForm(Effect):
    """A law that is of one form with others: its docstring holds what is its own, and takes the rest from the form.

    Attributes
    ----------
    page : str
        Sections that all laws of this form share; they stand behind the law.
    """

    page: ClassVar[str] = ""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        own = inspect.cleandoc(cls.__doc__ or "")
        # The members of a family have the whole page of the law already.
        if "name" in vars(cls) and cls.page.strip() not in own:
            law, title, source = own.partition("Source\n")
            cls.__doc__ = f"{law.rstrip()}{cls.page}{title}{source}"


class Change(OfOneForm):
    """A relative change of something, which a law names and limits."""

    def relative(self) -> jax.Array:
        """How much it comes to, over what it is without the law."""
        raise NotImplementedError


class ChangeSince(Change):
    """From one record on."""

    page: ClassVar[str] = """

Valid range
-----------
a > -1.

"""
    family: ClassVar[str] = "since"
    change: jax.Array = quantity("-", "relative change", 0.5, symbol="a")

    def relative(self) -> jax.Array:
        """The change."""
        return self.change


class ChangeAtInstant(ChangeSince):
    """At an instant of one record."""

    timed: ClassVar[bool] = True
    sudden: ClassVar[bool] = True
    family: ClassVar[str] = "in"
    instant: jax.Array = quantity(
        "-", "share of the record after which it happens", 0.5, lower=0.0, upper=1.0, starts=INSTANTS, symbol="t_s"
    )

    def as_of(self, moment: Moment) -> Self:
        """Nothing before the instant."""
        return self.scaled(moment.past)


class SettlingChange(Change):
    """While a record lasts, to what it settles at."""

    page: ClassVar[str] = """

Valid range
-----------
τ from some samples on; of a much longer one, only a/τ is known.

"""
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("-", "relative change in the end", 0.5, symbol="a")
    settling_time: jax.Array = quantity(
        "s", "time in which it settles", 1.0, lower=0.01, upper=100.0, log=True, symbol="τ"
    )

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(-jnp.expm1(-moment.time / self.settling_time))

    def relative(self) -> jax.Array:
        """The drift."""
        return self.drift


class ByRecord(Effect):
    """Evenly from record to record."""

    trend: jax.Array = quantity("-", "growth a record", 0.1)

    def in_record(self, number: jax.Array, duration: jax.Array) -> Self:
        """What has come together by then; the first record is as the base model says."""
        return self.scaled(number - 1.0)


class OfFriction(Change, GuideLaw):
    """Change of the level of Coulomb friction."""

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """The relative change times F_c."""
        return self.relative() * coulomb


class OfStiffness(Change, FibreLaw):
    """Change of the stiffness."""

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """One and the relative change."""
        return 1.0 + self.relative()
