"""The same fit with diffrax: adaptive steps, forward-mode derivatives, all records in one compiled program."""

from __future__ import annotations

from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from tests.benchmarks.problem import Fit

RELATIVE, ABSOLUTE = 1e-6, 1e-8
CREEP = 1e-6
"""Speed, m/s, over which friction comes up; stiff, hence the implicit solver."""


def _rate(t: jax.Array, y: jax.Array, laws: tuple) -> jax.Array:
    k, b, friction, mass, pull, release = laws
    load = k * y[0] + b * y[1]
    tension = jnp.where((y[0] > 0.0) & (load > 0.0), load, 0.0)
    rate = jnp.stack([y[1], (pull - tension - friction * jnp.tanh(y[1] / CREEP)) / mass])
    return jnp.where(t < release, 0.0, rate)


def fitter(fit: Fit) -> Callable[[], np.ndarray]:
    """A function that runs the whole fit, compiled on its first call."""
    longest = max(record.times.size for record in fit.records)
    step = fit.records[0].times[1] - fit.records[0].times[0]
    times = jnp.arange(longest) * step
    pad = lambda a, fill=0.0: np.concatenate([a, np.full(longest - a.size, fill)])  # noqa: E731
    force, position = (jnp.array([pad(getattr(r, c)) for r in fit.records]) for c in ("force", "position"))
    weights = jnp.array(
        [[pad(np.full(r.times.size, w)) for w in (r.force_weight, r.position_weight)] for r in fit.records]
    )
    rigs = jnp.array([[r.mass, r.pull, r.lift] for r in fit.records])

    def one(values: jax.Array, rig: jax.Array, force: jax.Array, position: jax.Array, weight: jax.Array) -> jax.Array:
        k, b, friction, zero, release = values
        mass, pull, lift = rig
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(_rate),
            diffrax.Kvaerno3(),
            times[0],
            times[-1],
            step,
            jnp.stack([-lift, 0.0]),
            args=(k, b, friction, mass, pull, release),
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=diffrax.PIDController(rtol=RELATIVE, atol=ABSOLUTE),
            adjoint=diffrax.ForwardMode(),
            max_steps=200_000,
            throw=False,
        )
        u, v = found.ys.T
        load = k * u + b * v
        tension = jnp.where((u > 0.0) & (load > 0.0), load, 0.0)
        return jnp.concatenate([(tension - force) * weight[0], (u + zero - position) * weight[1]])

    def away(scaled: jax.Array, _: None) -> jax.Array:
        values = scaled * fit.scale
        shared = jnp.broadcast_to(values[:3], (len(fit.records), 3))
        local = jnp.concatenate([shared, values[3:].reshape(-1, 2)], axis=1)
        return jax.vmap(one)(local, rigs, force, position, weights).ravel()

    @jax.jit
    def run(start: jax.Array) -> jax.Array:
        solver = optx.LevenbergMarquardt(rtol=1e-8, atol=1e-8)
        return optx.least_squares(away, solver, start, options={"jac": "fwd"}, max_steps=60, throw=False).value

    start = jnp.array(fit.start / fit.scale)
    return lambda: np.asarray(run(start)) * fit.scale
