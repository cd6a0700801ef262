"""The drop rig written by hand for the compiler: what a loop without any generality costs.

Base model only. Steps are classical Runge-Kutta steps between samples; switches (taut, released, stopped, broken away)
are located to rounding and taken at their instant; sensitivities are the variational equations beside the motion, with
the jumps they have at a switch because its instant depends on the parameters.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

N_SENSITIVE = 4
"""Stiffness, damping, friction, release; the zero of position only adds a constant."""

compiled = numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"})
inlined = numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"}, inline="always")


class Drop(NamedTuple):
    """Constants of one run, SI."""

    stiffness: float
    damping: float
    friction: float
    mass: float
    pull: float
    lift: float
    release: float


class Mode(NamedTuple):
    """One mode: ``a = rest - stiff u - damp v`` while the weight slides. `taut` and `direction` are 0 or ±1."""

    taut: float
    direction: float
    rest: float
    stiff: float
    damp: float


@inlined
def _mode(taut, direction, c):
    per_mass = 1.0 / c.mass
    rest = (c.pull - direction * c.friction) * per_mass
    return Mode(taut, direction, rest, taut * c.stiffness * per_mass, taut * c.damping * per_mass)


@inlined
def _flow(u, v, h, m):
    """State after one Runge-Kutta step of a sliding weight."""
    half = 0.5 * h
    a1 = m.rest - m.stiff * u - m.damp * v
    v2 = v + half * a1
    a2 = m.rest - m.stiff * (u + half * v) - m.damp * v2
    v3 = v + half * a2
    a3 = m.rest - m.stiff * (u + half * v2) - m.damp * v3
    v4 = v + h * a3
    a4 = m.rest - m.stiff * (u + h * v3) - m.damp * v4
    sixth = h / 6.0
    return u + sixth * (v + 2.0 * (v2 + v3) + v4), v + sixth * (a1 + 2.0 * (a2 + a3) + a4)


@inlined
def _margins(u, v, m, c):
    """Margins of fibre and guide, in N and m/s; negative where the mode no longer holds."""
    load = c.stiffness * u + c.damping * v
    fibre = min(c.stiffness * u, load)
    if m.taut == 0.0:
        fibre = -fibre
    guide = m.direction * v if m.direction != 0.0 else c.friction - abs(c.pull - m.taut * load)
    return fibre, guide


@compiled
def _locate(u, v, h, m, c):
    """Length of the step that ends at the first switch, to rounding, just beyond it; and whether it is the guide's.

    False position with the Illinois rule, on the margin that is violated at the end; should the other one be violated
    there too, on that one again.
    """
    guided = False
    for which in range(2):
        ue, ve = _flow(u, v, h, m)
        at_high = _margins(ue, ve, m, c)[which]
        if at_high >= 0.0:
            continue
        guided = which == 1
        low, high, at_low = 0.0, h, _margins(u, v, m, c)[which]
        for count in range(60):
            if high - low <= 4e-16:
                break
            ratio = at_low / (at_low - at_high)
            if count % 3 == 2 or not 1e-3 < ratio < 1.0 - 1e-3:
                ratio = 0.5
            middle = low + ratio * (high - low)
            um, vm = _flow(u, v, middle, m)
            value = _margins(um, vm, m, c)[which]
            if value >= 0.0:
                low, at_low, at_high = middle, value, 0.5 * at_high
            else:
                high, at_high, at_low = middle, value, 0.5 * at_low
        h = high
    return h, guided


@inlined
def _settled(u, v, taut, c):
    """Direction in which a weight at rest starts to move, 0 where friction holds it."""
    net = c.pull - taut * (c.stiffness * u + c.damping * v)
    if abs(net) <= c.friction:
        return 0.0
    return 1.0 if net > 0.0 else -1.0


@inlined
def _switched(u, v, guided, m, c):
    """Velocity and mode after a switch."""
    taut = m.taut if guided else 1.0 - m.taut
    if guided and m.direction != 0.0:
        v = 0.0
    direction = _settled(u, v, taut, c) if guided or m.direction == 0.0 else m.direction
    return v, _mode(taut, direction, c)


@compiled
def simulate(c, dt, force, position):
    """Fill force and position at the samples ``i dt``."""
    n = force.size
    u, v, t = -c.lift, 0.0, c.release
    m = _mode(0.0, _settled(u, v, 0.0, c), c)
    i = 0
    while i < n and i * dt <= t:
        force[i], position[i] = 0.0, u
        i += 1
    while i < n:
        h = i * dt - t
        un, vn = _flow(u, v, h, m) if m.direction != 0.0 else (u, v)
        fibre, guide = _margins(un, vn, m, c)
        if fibre >= 0.0 and guide >= 0.0:
            u, v, t = un, vn, i * dt
            force[i], position[i] = m.taut * (c.stiffness * u + c.damping * v), u
            i += 1
            continue
        guided = True
        if m.direction != 0.0:
            h, guided = _locate(u, v, h, m, c)
            u, v = _flow(u, v, h, m)
            t += h
        v, m = _switched(u, v, guided, m, c)


@inlined
def _kick(j, u, v, m, c):
    """Rate of the velocity that parameter j adds: stiffness, damping, friction, release."""
    if j == 0:
        return -m.taut * u / c.mass
    if j == 1:
        return -m.taut * v / c.mass
    return -m.direction / c.mass if j == 2 else 0.0


@inlined
def _flow_sensitive(u, v, su, sv, h, m, c):
    """As `_flow`, with the sensitivities, in place, carried by the same stages."""
    half, sixth = 0.5 * h, h / 6.0
    a1 = m.rest - m.stiff * u - m.damp * v
    u2, v2 = u + half * v, v + half * a1
    a2 = m.rest - m.stiff * u2 - m.damp * v2
    u3, v3 = u + half * v2, v + half * a2
    a3 = m.rest - m.stiff * u3 - m.damp * v3
    u4, v4 = u + h * v3, v + h * a3
    a4 = m.rest - m.stiff * u4 - m.damp * v4
    for j in range(N_SENSITIVE):
        p, q = su[j], sv[j]
        r1 = _kick(j, u, v, m, c) - m.stiff * p - m.damp * q
        q2 = q + half * r1
        r2 = _kick(j, u2, v2, m, c) - m.stiff * (p + half * q) - m.damp * q2
        q3 = q + half * r2
        r3 = _kick(j, u3, v3, m, c) - m.stiff * (p + half * q2) - m.damp * q3
        q4 = q + h * r3
        r4 = _kick(j, u4, v4, m, c) - m.stiff * (p + h * q3) - m.damp * q4
        su[j] = p + sixth * (q + 2.0 * (q2 + q3) + q4)
        sv[j] = q + sixth * (r1 + 2.0 * (r2 + r3) + r4)
    return u + sixth * (v + 2.0 * (v2 + v3) + v4), v + sixth * (a1 + 2.0 * (a2 + a3) + a4)


@inlined
def _record(i, u, v, su, sv, m, c, force, position, force_slopes, position_slopes):
    force[i], position[i] = m.taut * (c.stiffness * u + c.damping * v), u
    for j in range(N_SENSITIVE):
        force_slopes[i, j] = m.taut * (c.stiffness * su[j] + c.damping * sv[j])
        position_slopes[i, j] = su[j]
    force_slopes[i, 0] += m.taut * u
    force_slopes[i, 1] += m.taut * v
    force_slopes[i, N_SENSITIVE], position_slopes[i, N_SENSITIVE] = 0.0, 1.0


@compiled
def _jump(u, v, su, sv, guided, m, new_v, new, c):
    """Sensitivities across a switch of a sliding weight: its instant moves, and the old rate acts that much longer."""
    before = m.rest - m.stiff * u - m.damp * v
    after = new.rest - new.stiff * u - new.damp * new_v if new.direction != 0.0 else 0.0
    released = c.damping * v < 0.0
    for j in range(N_SENSITIVE):
        if guided:
            value, rate = sv[j], before
        elif released:
            value = c.stiffness * su[j] + c.damping * sv[j] + (u if j == 0 else v if j == 1 else 0.0)
            rate = c.stiffness * v + c.damping * before
        else:
            value, rate = su[j], v
        shift = -value / rate if rate != 0.0 else 0.0
        su[j] += (v - new_v) * shift
        sv[j] += (before - after) * shift
        if new.direction == 0.0:
            sv[j] = 0.0


@compiled
def simulate_sensitive(c, dt, force, position, force_slopes, position_slopes):
    """As `simulate`, with slopes ``(n_time, 5)``: stiffness, damping, friction, release, zero of position."""
    n = force.size
    su, sv = np.zeros(N_SENSITIVE), np.zeros(N_SENSITIVE)
    u, v, t = -c.lift, 0.0, c.release
    m = _mode(0.0, _settled(u, v, 0.0, c), c)
    i = 0
    while i < n and i * dt <= t:
        _record(i, u, v, su, sv, m, c, force, position, force_slopes, position_slopes)
        i += 1
    if m.direction != 0.0:
        sv[3] = -m.rest
    while i < n:
        h = i * dt - t
        sliding = m.direction != 0.0
        un, vn = _flow(u, v, h, m) if sliding else (u, v)
        fibre, guide = _margins(un, vn, m, c)
        if fibre >= 0.0 and guide >= 0.0:
            if sliding:
                u, v = _flow_sensitive(u, v, su, sv, h, m, c)
            t = i * dt
            _record(i, u, v, su, sv, m, c, force, position, force_slopes, position_slopes)
            i += 1
            continue
        guided = True
        if sliding:
            h, guided = _locate(u, v, h, m, c)
            u, v = _flow_sensitive(u, v, su, sv, h, m, c)
            t += h
        new_v, new = _switched(u, v, guided, m, c)
        if sliding:
            _jump(u, v, su, sv, guided, m, new_v, new, c)
        v, m = new_v, new


@inlined
def _run(row):
    return Drop(row[0], row[1], row[2], row[3], row[4], row[5], row[6])


@compiled
def simulate_batch(runs, dt, forces, positions):
    """Many runs ``(n_run, 7)``, one after the other."""
    for r in range(len(runs)):
        simulate(_run(runs[r]), dt, forces[r], positions[r])


@compiled
def sensitive_batch(runs, dt, forces, positions, force_slopes, position_slopes):
    """Many runs with sensitivities, one after the other."""
    for r in range(len(runs)):
        simulate_sensitive(_run(runs[r]), dt, forces[r], positions[r], force_slopes[r], position_slopes[r])
