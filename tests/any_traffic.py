"""Logs as simulations write them, drawn by a seed: stop-and-go, jams, wiggles, jumps aside.

A log is a row of stretches on one straight road of several lanes: driving, standing, creeping,
standing with a wiggle (as the sublane model logs it), a change of lanes in one step at any speed,
a teleport, a gap. What SUMO would log of it is known: angle along the road, places to the cm.
"""

from __future__ import annotations

import numpy as np
from drives import straight, trace_of

STEPS = (0.04, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0)
LANES = ("a_0", "a_1", "a_2")
DRIVEN = ("drive", "stand", "creep", "wiggle", "change", "stop and change", "slide")
KINDS = (*DRIVEN, "teleport", "gap")


def network(turn=0.0):
    """Three lanes of 6 km."""
    return straight(length=6000.0, lanes=3, turn=turn)


class _Drive:
    """What a vehicle has done until now, and its rows: time, along, aside, speed, lane."""

    def __init__(self, step, *, aside):
        self.step, self.aside, self.rows = step, aside, []
        self.time, self.along, self.lane, self.speed = 0.0, 20.0, 1, 0.0

    def log(self, beside=0.0):
        aside = 3.2 * self.lane + self.aside + beside
        self.rows.append((round(self.time, 6), self.along, aside, self.speed, self.lane))

    def slide(self, rng):
        """Slide to the next lane as the sublane model does: 1 m/s aside, at any pace."""
        to = 1 if self.lane == 0 else -1 if self.lane == 2 else int(rng.choice([-1, 1]))
        old, pace, aside = self.lane, rng.uniform(0.3, 9.0), 0.0
        while aside < 3.2:
            aside = min(aside + self.step, 3.2)
            change = float(np.clip(pace - self.speed, -4.5 * self.step, 2.6 * self.step))
            self.speed = self.speed + change
            self.time, self.along = self.time + self.step, self.along + self.speed * self.step
            self.lane = old + to * int(aside > 1.6)
            self.log(to * aside - 3.2 * (self.lane - old))

    def stretch(self, kind, rng):
        """Do one thing for some seconds."""
        if kind == "slide":
            self.slide(rng)
            return
        paces = {"drive": rng.uniform(3.0, 14.0), "creep": rng.uniform(0.05, 0.6)}
        target = {**paces, "change": rng.choice([0.5, 2.0, 8.0])}.get(kind, 0.0)
        for number in range(max(3, round(rng.uniform(4.0, 25.0) / self.step))):
            most = (2.6 if target > self.speed else 4.5) * self.step
            self.speed = max(self.speed + float(np.clip(target - self.speed, -most, most)), 0.0)
            self.time, self.along = self.time + self.step, self.along + self.speed * self.step
            stops = kind == "stop and change" and 0.0 < self.speed <= 4.5 * self.step
            if (stops and number < 40) or (kind == "change" and number == 3):
                self.lane = int(np.clip(self.lane + rng.choice([-1, 1]), 0, 2))
            stands = kind == "wiggle" and self.speed == 0.0
            self.log(float(rng.choice([-0.12, 0.0, 0.12])) if stands else 0.0)


def traffic(seed, *, step, euler=True, turn=0.0, sublane=False, stretches=8):
    """The trace of one vehicle.

    Args:
        seed: Of what it does.
        step: Time between rows [s].
        euler: Whether speeds are means of the step before.
        turn: Direction of the road [rad].
        sublane: Whether it drives beside the middle of its lane.
        stretches: How many things it does.
    """
    rng = np.random.default_rng(seed)
    drive = _Drive(step, aside=rng.uniform(-0.8, 0.8) if sublane else 0.0)
    drive.log()
    for kind in rng.choice(KINDS, stretches):
        drive.along += rng.uniform(60.0, 400.0) if kind == "teleport" else 0.0
        drive.time += 8 * step if kind == "gap" else 0.0
        drive.stretch(kind, rng)
    times, s, d, v, lanes = np.array(drive.rows).T
    if not euler:
        v = np.r_[(v[1:] + v[:-1]) / 2.0, v[-1]] * (v > 0)
    cos, sin = np.cos(turn), np.sin(turn)
    xy = np.column_stack([s * cos - d * sin, s * sin + d * cos])
    return trace_of(times, xy, turn, v, lanes=lanes.astype(int), offsets=s)
