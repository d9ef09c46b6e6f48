"""Where wheels passed: beside the middle of the way, of vehicles only, near cameras only."""

import numpy as np
import pytest

from sumo3dviz_pt.model.trajectory import DrivenWay, DrivenWays
from sumo3dviz_pt.model.weather import Snow, Weather, WeatherCourse
from sumo3dviz_pt.shot.tracks import REACH, wheel_tracks

WIDTHS = {"passenger": 1.8, "bicycle": 0.65, "rail": 2.8}
EYE = np.zeros((1, 3))
RADIUS = 40.0


def course(roads="tracked", depth=0.05):
    snow = Snow(depth, roads)
    return WeatherCourse((0.0,), (Weather(snow=snow, season="winter"),))


def way(vclass="passenger", name="0", places=None, speed=10.0):
    """A drive on a quarter of a circle around the origin, or through other places."""
    angles = np.arange(0.0, 0.5 * np.pi, 10.0 / RADIUS)
    if places is None:
        places = RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])
        yaws = angles + 0.5 * np.pi
    else:
        yaws = np.zeros(len(places))
    times, speeds = np.arange(float(len(places))), np.full(len(places), speed)
    return DrivenWay(f"vehicle:{name}", vclass, WIDTHS[vclass], times, places, yaws, speeds)


def tracks_of(*ways, weather=None, eye=EYE):
    return wheel_tracks(weather or course(), DrivenWays(1.0, ways), eye, seed=3)


def test_cars_leave_two_tracks_and_bicycles_one():
    car, bike = tracks_of(way()), tracks_of(way("bicycle"))
    assert len(car.begins) == 2 * len(bike.begins) > 10
    half = len(car.begins) // 2
    apart = np.hypot(*(car.begins[:half] - car.begins[half:]).T)
    np.testing.assert_allclose(apart, 2 * 0.43 * 1.8, rtol=0.1)


def test_a_track_has_no_gaps_and_follows_the_bend_between_samples():
    """Samples are 10 m apart; chords between them would lie 31 cm inside."""
    bike = tracks_of(way("bicycle"))
    np.testing.assert_allclose(bike.ends[:-1], bike.begins[1:], atol=1e-9)
    away = np.hypot(*bike.begins.T) - RADIUS
    # Whoever strays does so by a slow wave; what a chord cut off would come back in every step.
    wave = np.polynomial.Polynomial.fit(np.arange(len(away)), away, 7)(np.arange(len(away)))
    assert np.abs(away - wave).max() < 0.03


def test_drivers_stray_each_in_their_own_way():
    one = tracks_of(way())
    two = tracks_of(way(), way(name="1"))
    assert len(two.begins) == 2 * len(one.begins)
    half = len(one.begins)
    away = np.hypot(*(two.begins[:half] - two.begins[half:]).T)
    assert 0.05 < away.mean() < 1.5


def test_trains_leave_none():
    assert len(tracks_of(way("rail")).begins) == 0


def test_who_stands_or_jumps_leaves_none():
    stood = np.zeros((5, 2))
    jumped = np.array([[0.0, 0.0], [200.0, 0.0], [0.0, 0.0]])
    assert len(tracks_of(way(places=stood)).begins) == 0
    assert len(tracks_of(way(places=jumped)).begins) == 0


def test_who_is_not_logged_for_a_while_leaves_no_track_there():
    there = way()
    late = np.where(np.arange(len(there.times)) < 3, there.times, there.times + 30.0)
    gone = DrivenWay(there.key, there.vclass, 1.8, late, there.places, there.yaws, there.speeds)
    assert 0 < len(tracks_of(gone).begins) < len(tracks_of(there).begins)


def test_tracks_far_from_cameras_are_left_out():
    found = tracks_of(way(), eye=np.array([[5000.0 + REACH, 0.0, 0.0]]))
    assert found is not None and len(found.begins) == 0


@pytest.mark.parametrize("weather", [None, course("cleared"), course(depth=0.0)])
def test_none_are_kept_where_no_snow_lies(weather):
    assert wheel_tracks(weather, DrivenWays(1.0), EYE, seed=3) is None


def test_who_stands_all_the_time_is_parked():
    stood = way(places=np.tile([3.0, 4.0], (90, 1)), speed=0.0)
    waits = way(name="1", places=np.zeros((30, 2)), speed=0.0)
    assert DrivenWays(1.0, (stood, waits, way(name="2"))).parked == {"vehicle:0"}
