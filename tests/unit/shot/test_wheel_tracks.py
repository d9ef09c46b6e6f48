"""Where wheels passed: beside the middle of the way, of vehicles only, near cameras only."""

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.model.weather import Snow, Weather, WeatherCourse
from sumo3dviz_pt.shot.wheel_tracks import REACH, wheel_tracks

TYPES = {
    kind.id: kind
    for kind in (
        VehicleType("car", "passenger", 4.6, 1.8, 1.47),
        VehicleType("bike", "bicycle", 1.6, 0.65, 1.7),
        VehicleType("ped", "pedestrian", 0.215, 0.478, 1.719),
    )
}
EYE = np.zeros((1, 3))


def course(roads="tracked", depth=0.05):
    snow = Snow(depth, roads)
    return WeatherCourse((0.0,), (Weather(snow=snow, season="winter"),))


def tracks_of(*kinds, weather=None, eye=EYE):
    made = [
        Trajectory(f"{kind}{k}", "person" if kind == "ped" else "vehicle", kind, (PathPiece(),))
        for k, kind in enumerate(kinds)
    ]
    fleet = build_fleet(made, TYPES, VehicleSettings(), seed=3)
    return wheel_tracks(weather or course(), fleet, eye)


def test_cars_leave_two_tracks_and_bicycles_one():
    car, bike = tracks_of("car"), tracks_of("bike")
    assert car is not None and bike is not None
    assert len(car.begins) == 2 * len(bike.begins) > 10
    half = len(car.begins) // 2
    apart = np.hypot(*(car.begins[:half] - car.begins[half:]).T)
    np.testing.assert_allclose(apart, 2 * 0.43 * 1.8, rtol=0.1)


def test_drivers_stray_each_in_their_own_way():
    one = tracks_of("car")
    two = tracks_of("car", "car")
    assert one is not None and two is not None
    assert len(two.begins) == 2 * len(one.begins)
    half = len(one.begins)
    away = np.hypot(*(two.begins[:half] - two.begins[half:]).T)
    assert 0.05 < away.mean() < 1.5


def test_who_walks_leaves_none():
    found = tracks_of("ped")
    assert found is not None and len(found.begins) == 0


def test_tracks_far_from_cameras_are_left_out():
    found = tracks_of("car", eye=np.array([[5000.0 + REACH, 0.0, 0.0]]))
    assert found is not None and len(found.begins) == 0


@pytest.mark.parametrize("weather", [None, course("cleared"), course(depth=0.0)])
def test_none_are_kept_where_no_snow_lies(weather):
    fleet = build_fleet([], TYPES, VehicleSettings(), seed=3)
    assert wheel_tracks(weather, fleet, EYE) is None
