"""Sound tracks against a drive that is known: 10 m/s, braking at 2 m/s2."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from sumo3dviz_pt.job.surroundings import SoundSettings
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Motion, Trajectory
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.films.sound import sample_times, track_of

CAR = VehicleType("car", "passenger", 4.0, 1.8, 1.5)


class Braking:
    """Drives north from (5, 0) at 10 m/s and brakes at 2 m/s2, from 1 s to 4 s."""

    begin, end = 1.0, 4.0

    def sample(self, times):
        since = times - 1.0
        y = 10.0 * since - since**2
        places = np.column_stack([np.full_like(y, 5.0), y, np.zeros_like(y)])
        yaw = np.full_like(y, np.pi / 2)
        alive = np.ones(len(y), dtype=bool)
        return Motion(alive, places, yaw, 0.0 * y, 10.0 - 2.0 * since, y)

    def trail(self, times, distances):
        raise AssertionError("nobody asks for a trail here")


def test_a_track_says_place_speed_and_acceleration_while_the_source_exists():
    times = np.arange(0.0, 5.0, 0.5)
    eyes = np.tile([5.0, -2.0, 1.0], (len(times), 1))
    track = track_of(Trajectory("a", "vehicle", "car", (Braking(),)), CAR, times, eyes)
    assert track.samples.tolist() == [2, 3, 4, 5, 6, 7, 8]
    assert track.places[0] == pytest.approx([5.0, -2.0, 0.0])  # half a length behind the front
    assert track.speeds == pytest.approx(10.0 - 2.0 * (times[2:9] - 1.0))
    assert track.accelerations == pytest.approx(-2.0)  # at both ends, too
    assert track.nearest == pytest.approx(1.0)


def test_samples_follow_the_films_clock_and_sumos():
    frames = 10.0 + 2.0 * np.arange(26) / 25  # at twice the speed
    film, sumo = sample_times(frames, Pace(Fraction(25), Fraction(2)), SoundSettings())
    assert film == pytest.approx(np.arange(26) / 25)
    assert sumo == pytest.approx(frames)
    film, sumo = sample_times(frames, Pace(Fraction(25), Fraction(2)), SoundSettings(rate=100))
    assert len(film) == 101
    assert sumo[-1] == pytest.approx(12.0)
