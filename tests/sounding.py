"""Scenes of sound that are known: sources on straight lines before a listener who stands."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.sound.emission import BANDS, Emission, emission_of
from sumo3dviz_pt.sound.render import STEP, SoundScene, Source

CAR = VehicleType("car", "passenger", 4.5, 1.8, 1.5)
BEGIN = -1.0
EYE = np.array([0.0, 0.0, 1.2])


def clock(length):
    return BEGIN + STEP * np.arange(round((length - BEGIN) / STEP) + 8)


def steady(band, level, count):
    """A power of one band."""
    levels = np.full((count, len(BANDS)), -200.0)
    levels[:, band] = level
    return Emission(levels, np.full((count, len(BANDS)), -200.0), np.zeros(count))


def straight(times, *, at, speed=(0.0, 0.0, 0.0), since=0.0):
    """Places of what is somewhere at a time, and goes straight on."""
    return np.asarray(at) + (times - since)[:, None] * np.asarray(speed)


def car(times, places, name="car", *, speed=0.0, there=None, **more):
    count = len(times)
    emission = emission_of(CAR, np.full(count, speed), np.zeros(count))
    return Source(name, places, np.ones(count) if there is None else there, emission, **more)


def scene(length, *sources, **more):
    count = len(clock(length))
    return SoundScene(
        BEGIN,
        np.tile(EYE, (count, 1)),
        np.tile(np.eye(3), (count, 1, 1)),
        sources,
        **{"radius": 300.0, **more},
    )
