"""Compiled time stepping of a weight on a fibre, with or without a pulley between.

The scheme is that of Moreau: half a step of position, an impulse balance in which Coulomb friction is a projection of
the velocity onto its cone, half a step of position. Nothing is located: a fibre that becomes taut within a step, or a
velocity that changes its sign, counts for its share of the step, so that readings depend smoothly on parameters.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from tests.independent.laws import GRAVITY

SPEED_OF_RATE_LAWS = 0.1
SLOWEST = 1e-3
"""Speed, m/s, below which powers of speed level off."""
CREEP_OF_CAPSTAN = 1e-4
PATIENCE = 60
CLOSE = 1e-9
"""Change of velocity, m/s, at which a fixed point counts as found: it is closer still, since trials contract fast."""

compiled = numba.njit(cache=True, fastmath=False, error_model="numpy")


@compiled
def power_of_speed(speed, exponent):
    """Power of a speed over that of the rate laws."""
    return ((speed**2 + SLOWEST**2) / (SPEED_OF_RATE_LAWS**2 + SLOWEST**2)) ** (0.5 * exponent)


@compiled
def tension(stretch, rate, dashpot, loop, drive_speed, time, step, p):
    """Tension, mean over a step with this `stretch` at its middle; the clamped law unless `heaviside` is set.

    In the step in which a fibre becomes taut it pulls for a share of the step only.
    """
    reach, share = 0.5 * rate * step, 1.0
    if stretch <= min(0.0, -reach):
        return 0.0
    if stretch < reach:
        share = 0.5 * (1.0 + stretch / reach)
        stretch = share**2 * reach
    elastic = p.stiffness * stretch * (1.0 + p.hardening * stretch)
    if p.toe_depth != 0.0:
        elastic *= 1.0 - p.toe_depth * math.exp(-stretch / p.toe_length)
    elastic *= 1.0 + p.stiffness_rate_factor * abs(rate) / SPEED_OF_RATE_LAWS
    elastic *= 1.0 + p.drive_speed_factor * abs(drive_speed) / SPEED_OF_RATE_LAWS
    if p.stiffness_exponent != 0.0:
        elastic *= power_of_speed(rate, p.stiffness_exponent)
    if p.fade != 0.0:
        elastic *= 1.0 - p.fade * (1.0 - math.exp(-time / p.fade_time))
    if stretch > p.kink_stretch:
        elastic += p.kink * (stretch - p.kink_stretch)
    factor = max(0.05, 1.0 + p.damping_rate_factor * abs(rate) / SPEED_OF_RATE_LAWS)
    if p.damping_exponent != 0.0:
        factor *= power_of_speed(rate, p.damping_exponent)
    if p.load_damping != 0.0:
        factor *= 1.0 + p.load_damping * p.stiffness * stretch / (p.mass * GRAVITY)
    total = elastic + share * p.damping * factor * rate
    total += p.branch_stiffness * (stretch - share * dashpot) + share * p.hysteretic_stiffness * loop
    if total < 0.0 and p.heaviside == 0.0:
        return 0.0
    return total


@compiled
def creep(dashpot, stretch, share):
    """Stretch of the dashpot of the relaxing branch after a time in which `share` of the way remains."""
    goal = max(stretch, 0.0)
    return goal + (dashpot - goal) * share


@compiled
def loop_rate(loop, stretch, rate, p):
    """Rate of the hysteretic stretch."""
    if stretch <= 0.0:
        return 0.0
    return rate - p.beta * abs(rate) * loop - p.gamma * rate * abs(loop)


@compiled
def level(direction, velocity, load, position, time, path, p):
    """Coulomb friction against sliding in `direction`, after a `path` slid since the record began."""
    coulomb = p.friction * (1.0 + p.asymmetry * direction)
    if p.roughness != 0.0:
        coulomb *= 1.0 + p.roughness * math.sin(2.0 * math.pi * position / p.roughness_length)
    if p.warm_up != 0.0:
        coulomb *= 1.0 + p.warm_up * math.exp(-time / p.warm_up_time)
    if p.wear != 0.0:
        coulomb *= 1.0 + p.wear * path / (path + p.wear_path)
    if p.heating != 0.0:
        coulomb *= max(0.0, 1.0 - p.heating * time)
    if p.friction_exponent != 0.0:
        coulomb *= power_of_speed(velocity, p.friction_exponent)
    coulomb += p.load_coefficient * load
    if p.breakaway_excess != 0.0:
        coulomb += p.breakaway_excess * math.exp(-((velocity / p.stribeck_velocity) ** 2))
    return coulomb


@compiled
def resistance(position, velocity, p):
    """Forces of guide and gauges that have one value for each state; positive against +."""
    sense = 1.0 if velocity > 0.0 else -1.0
    total = p.viscous_coefficient * (1.0 + p.viscous_asymmetry * sense) * velocity
    total += p.drag_coefficient * velocity * abs(velocity)
    total += p.gauge_force + p.gauge_spring * position
    if p.eddy_coefficient != 0.0:
        total += p.eddy_coefficient * velocity / (1.0 + (velocity / p.eddy_velocity) ** 2)
    if position > p.stop_position:
        total += p.stop_stiffness * (position - p.stop_position)
    if p.detent_force != 0.0:
        total += p.detent_force * math.sin(2.0 * math.pi * position / p.detent_pitch)
    return total


@compiled
def rubbed(velocity, free, up, down):
    """Velocity after a step that ends at `free` without friction.

    Impulses of friction are at most `up` against + and `down` against -. A velocity that passes zero within the step
    stays there if friction can hold it, and else feels the other sign for the rest of the step.
    """
    push = free - velocity
    if velocity > 0.0:
        end = free - up
        if end >= 0.0:
            return end
        return min(push + down, 0.0) * end / (end - velocity)
    if velocity < 0.0:
        end = free + down
        if end <= 0.0:
            return end
        return max(push - up, 0.0) * end / (end - velocity)
    if free > up:
        return free - up
    if free < -down:
        return free + down
    return 0.0


@compiled
def bristle_force(bristle, velocity, coulomb, p):
    """Friction of bristles that bend before they break away."""
    rate = velocity - p.bristle_stiffness * abs(velocity) * bristle / coulomb
    return p.bristle_stiffness * bristle + p.bristle_damping * rate


@compiled
def bent(bristle, velocity, coulomb, step, p):
    """Deflection of the bristles after a step at constant velocity, exact."""
    if velocity == 0.0:
        return bristle
    limit = math.copysign(coulomb / p.bristle_stiffness, velocity)
    return limit + (bristle - limit) * math.exp(-p.bristle_stiffness * abs(velocity) * step / coulomb)


@compiled
def fibre_end(position, p):
    """Length of fibre a weight at `position` has let in, and its rate per velocity of the weight."""
    if p.lateral_offset == 0.0:
        return p.side * position, p.side
    here = math.sqrt((p.guide_distance - position) ** 2 + p.lateral_offset**2)
    start = math.sqrt(p.guide_distance**2 + p.lateral_offset**2)
    return start - here, (p.guide_distance - position) / here


@compiled
def weight_after(velocity, middle, load, position, time, path, bristle, step, p, slope):
    """Velocity of the weight after a step under `load` of the fibre."""
    force = p.pull + slope * load - resistance(position, middle, p)
    if p.bristle_stiffness != 0.0:
        sense = 1.0 if middle >= 0.0 else -1.0
        force -= bristle_force(bristle, middle, level(sense, middle, load, position, time, path, p), p)
        return velocity + step / p.mass * force
    up = step / p.mass * level(1.0, middle, load, position, time, path, p)
    down = step / p.mass * level(-1.0, middle, load, position, time, path, p)
    return rubbed(velocity, velocity + step / p.mass * force, up, down)


@compiled
def mounted(deflection, stretch, rate, step, p):
    """Deflection, at the middle of a step, of a drive mount in series with the fibre."""
    if p.damping == 0.0:
        middle = p.stiffness * stretch / (p.stiffness + 1.0 / p.mount_compliance)
    else:
        pace = 0.5 * step / p.damping
        middle = deflection + 0.5 * step * rate + pace * p.stiffness * stretch
        middle /= 1.0 + pace * (p.stiffness + 1.0 / p.mount_compliance)
    return middle if middle > 0.0 and stretch > middle else 0.0


@compiled
def run_direct(position, dashpot, deflection, drive, drive_rate, start, step, p):
    """Weight held by the fibre directly, or over a massless pulley.

    Returns the force at the gauge and the position at the middle of each step.
    """
    n = drive.size
    forces, positions = np.empty(n), np.empty(n)
    velocity, change, loop, bristle, path = 0.0, 0.0, 0.0, 0.0, 0.0
    half_left, left = math.exp(-0.5 * step / p.relaxation_time), math.exp(-step / p.relaxation_time)
    for i in range(n):
        time = start + (i + 0.5) * step
        middle_position = position + 0.5 * step * velocity
        let_in, slope = fibre_end(middle_position, p)
        bend = drive[i] / p.pulley_radius
        stretch = drive[i] + p.eccentricity * math.sin(bend) - let_in - p.length_offset
        if time > p.slip_instant:
            stretch -= p.slip_length
        pace = drive_rate[i] * (1.0 + p.eccentricity / p.pulley_radius * math.cos(bend))
        middle_dashpot = creep(dashpot, stretch, half_left)
        # The last step's change is a good guess; one trial more makes it good enough.
        after, pull, middle, rate, middle_mount = velocity + change, 0.0, velocity, 0.0, 0.0
        for _ in range(PATIENCE):
            before = after
            middle = 0.5 * (velocity + before)
            rate = pace - slope * middle
            if p.mount_compliance > 0.0:
                middle_mount = mounted(deflection, stretch, rate, step, p)
                pull = middle_mount / p.mount_compliance
            else:
                middle_loop = loop + 0.5 * step * loop_rate(loop, stretch, rate, p)
                pull = tension(stretch, rate, middle_dashpot, middle_loop, drive_rate[i], time, step, p)
            load = pull
            if p.capstan != 0.0:
                load *= math.exp(-p.capstan * middle / (abs(middle) + CREEP_OF_CAPSTAN))
            after = weight_after(velocity, middle, load, middle_position, time, path, bristle, step, p, slope)
            if abs(after - before) < CLOSE:
                break
        middle = 0.5 * (velocity + after)
        if p.bristle_stiffness != 0.0:
            sense = 1.0 if middle >= 0.0 else -1.0
            bristle = bent(bristle, middle, level(sense, middle, pull, middle_position, time, path, p), step, p)
        dashpot = creep(dashpot, stretch, left)
        loop = loop + step * loop_rate(loop, stretch, rate, p) if stretch > 0.0 else 0.0
        deflection = max(0.0, 2.0 * middle_mount - deflection) if middle_mount > 0.0 else 0.0
        path += abs(after + velocity) * 0.5 * step
        velocity, change = after, after - velocity
        position = middle_position + 0.5 * step * velocity
        forces[i], positions[i] = pull, middle_position
    return forces, positions


@compiled
def run_rim(position, rim, dashpots, drive, drive_rate, start, step, p):
    """Weight held over a pulley whose rim has a mass and friction of its own, half the fibre on either side."""
    n = drive.size
    forces, positions = np.empty(n), np.empty(n)
    velocity, spin, bristle, path = 0.0, 0.0, 0.0, 0.0
    first, second = dashpots, dashpots
    first_loop, second_loop = 0.0, 0.0
    half_left, left = math.exp(-0.5 * step / p.relaxation_time), math.exp(-step / p.relaxation_time)
    # Fixed-point steps of the spin overshoot by this much through the damping of both halves: taken out by relaxation.
    stiff = 2.0 * p.damping * step / p.rim_mass
    for i in range(n):
        time = start + (i + 0.5) * step
        middle_position, middle_rim = position + 0.5 * step * velocity, rim + 0.5 * step * spin
        let_in, slope = fibre_end(middle_position, p)
        bend = drive[i] / p.pulley_radius
        offset = p.length_offset + (p.slip_length if time > p.slip_instant else 0.0)
        one = 2.0 * (drive[i] + p.eccentricity * math.sin(bend) - middle_rim) - offset
        two = 2.0 * (middle_rim - let_in) - offset
        pace = drive_rate[i] * (1.0 + p.eccentricity / p.pulley_radius * math.cos(bend))
        after, spin_after = velocity, spin
        pull, load, rate_one, rate_two = 0.0, 0.0, 0.0, 0.0
        for _ in range(PATIENCE):
            before, spin_before = after, spin_after
            middle, spin_middle = 0.5 * (velocity + before), 0.5 * (spin + spin_before)
            rate_one, rate_two = 2.0 * (pace - spin_middle), 2.0 * (spin_middle - slope * middle)
            loop_one = first_loop + 0.5 * step * loop_rate(first_loop, one, rate_one, p)
            loop_two = second_loop + 0.5 * step * loop_rate(second_loop, two, rate_two, p)
            pull = tension(one, rate_one, creep(first, one, half_left), loop_one, drive_rate[i], time, step, p)
            load = tension(two, rate_two, creep(second, two, half_left), loop_two, drive_rate[i], time, step, p)
            rubbing = step * p.bearing_friction / p.rim_mass
            spin_after = rubbed(spin, spin + step * (pull - load) / p.rim_mass, rubbing, rubbing)
            spin_after = (spin_after + stiff * spin_before) / (1.0 + stiff)
            after = weight_after(velocity, middle, load, middle_position, time, path, bristle, step, p, slope)
            if abs(after - before) < CLOSE and abs(spin_after - spin_before) < CLOSE:
                break
        if p.bristle_stiffness != 0.0:
            middle = 0.5 * (velocity + after)
            sense = 1.0 if middle >= 0.0 else -1.0
            bristle = bent(bristle, middle, level(sense, middle, load, middle_position, time, path, p), step, p)
        first, second = creep(first, one, left), creep(second, two, left)
        first_loop = first_loop + step * loop_rate(first_loop, one, rate_one, p) if one > 0.0 else 0.0
        second_loop = second_loop + step * loop_rate(second_loop, two, rate_two, p) if two > 0.0 else 0.0
        path += abs(after + velocity) * 0.5 * step
        velocity, spin = after, spin_after
        position, rim = middle_position + 0.5 * step * velocity, middle_rim + 0.5 * step * spin
        forces[i], positions[i] = pull, middle_position
    return forces, positions
