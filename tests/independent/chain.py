"""Compiled time stepping of a fibre of point masses: stiff, so implicit in the fibre.

The chain is written in the direction in which the fibre is stretched, with the gauge's end at `-drive` and the weight
last; each segment pulls and never pushes. The implicit midpoint rule needs one tridiagonal solution a step; which
segments pull, and whether the weight slides, is found by trial.
"""

from __future__ import annotations

import numpy as np

from tests.independent.kernel import compiled, level, resistance

TRIALS = 40


@compiled
def _eliminate(velocities, stretches, active, end_rate, pulls, masses, step, p):
    """Diagonal and right side of the equations of a step, for given pulling segments, after forward elimination.

    From the gauge's end on: what is left for the weight is one equation, in which friction is a projection.
    """
    n = velocities.size
    segments = n
    k, b = segments * p.stiffness, segments * p.damping
    gain = b + 0.5 * step * k
    diagonal, right = np.empty(n), np.empty(n)
    for j in range(n):
        lower = gain if active[j] else 0.0
        upper = gain if j + 1 < n and active[j + 1] else 0.0
        diagonal[j] = 2.0 * masses[j] / step + lower + upper
        right[j] = 2.0 * masses[j] / step * velocities[j] + pulls[j]
        if active[j]:
            right[j] -= k * stretches[j]
            if j == 0:
                right[j] += gain * end_rate
        if j + 1 < n and active[j + 1]:
            right[j] += k * stretches[j + 1]
        if j > 0 and active[j]:
            ratio = gain / diagonal[j - 1]
            diagonal[j] -= ratio * gain
            right[j] += ratio * right[j - 1]
    return diagonal, right


@compiled
def _back(diagonal, right, active, gain, weight, out):
    out[-1] = weight
    for j in range(out.size - 2, -1, -1):
        upper = gain if active[j + 1] else 0.0
        out[j] = (right[j] + upper * out[j + 1]) / diagonal[j]


@compiled
def _load(stretch, middle, before, step, k, b):
    rate = middle - before
    return k * (stretch + 0.5 * step * rate) + b * rate


@compiled
def run_chain(places, n_masses, drive, drive_rate, start, step, p, fibre_mass, weight_of_fibre):
    """Weight and point masses; returns gauge force and position at the middle of each step."""
    n, size = drive.size, n_masses + 1
    forces, positions = np.empty(n), np.empty(n)
    places, velocities, middles = places.copy(), np.zeros(size), np.zeros(size)
    masses, pulls = np.full(size, fibre_mass / n_masses), np.full(size, weight_of_fibre / n_masses)
    masses[-1] = p.mass
    active, stretches = np.zeros(size, np.bool_), np.empty(size)
    k, b = size * p.stiffness, size * p.damping
    gain = b + 0.5 * step * k
    for i in range(n):
        time = start + (i + 0.5) * step
        # The first half of the drive's step is taken at its present speed, the other half belongs to the next step.
        end = -(drive[i] - 0.5 * step * drive_rate[i])
        for j in range(size):
            stretches[j] = places[j] - (end if j == 0 else places[j - 1]) - p.length_offset / size
            active[j] = stretches[j] > 0.0
        pulls[-1] = -p.side * (p.pull - resistance(along_guide(places[-1], p), along_guide(velocities[-1], p), p))
        load = 0.0
        for trial in range(TRIALS):
            diagonal, right = _eliminate(velocities, stretches, active, -drive_rate[i], pulls, masses, step, p)
            sense = along_guide(1.0, p)
            up = level(sense, middles[-1], load, along_guide(places[-1], p), time, 0.0, p)
            down = level(-sense, middles[-1], load, along_guide(places[-1], p), time, 0.0, p)
            needed = right[-1] - diagonal[-1] * 0.5 * velocities[-1]
            if needed > up:
                weight = (right[-1] - up) / diagonal[-1]
            elif needed < -down:
                weight = (right[-1] + down) / diagonal[-1]
            else:
                weight = 0.5 * velocities[-1]
            _back(diagonal, right, active, gain, weight, middles)
            changed = False
            for j in range(size):
                before = -drive_rate[i] if j == 0 else middles[j - 1]
                total = _load(stretches[j], middles[j], before, step, k, b)
                reach = stretches[j] + 0.5 * step * (middles[j] - before)
                pulling = reach > 0.0 and total > 0.0
                if pulling != active[j] and trial < TRIALS // 2:
                    active[j], changed = pulling, True
                elif active[j] and not pulling:
                    active[j], changed = False, True
            load = _load(stretches[-1], middles[-1], middles[-2], step, k, b) if active[-1] else 0.0
            if not changed and (trial > 0 or p.load_coefficient == 0.0):
                break
        force = 0.0
        if active[0]:
            force = _load(stretches[0], middles[0], -drive_rate[i], step, k, b)
        forces[i], positions[i] = force, along_guide(places[-1] + 0.5 * step * middles[-1], p)
        for j in range(size):
            places[j] += step * middles[j]
            velocities[j] = 2.0 * middles[j] - velocities[j]
    return forces, positions


@compiled
def along_guide(place, p):
    """Position of the weight for a place along the fibre: the two run against each other over a pulley."""
    return -p.side * place
