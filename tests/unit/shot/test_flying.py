"""What falls and flies before a shot's camera, as values of one frame."""

from dataclasses import dataclass

import numpy as np
import pytest
from builders import view_at

from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.model.camera import INSTANT, Shutter
from sumo3dviz_pt.model.falling import Cabin, Glows
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.traffic import Trace, VehicleType
from sumo3dviz_pt.model.weather import Rain, Weather, WeatherCourse, Wind
from sumo3dviz_pt.motion import smooth
from sumo3dviz_pt.shot.cameras.riding import turned, windscreen_of
from sumo3dviz_pt.shot.falling import (
    EXPOSURE,
    LIFE,
    MOST_GLOWS,
    _ends,
    carried_by_wind,
    exposure_of,
    nearest,
    spray,
)

RAIN = Weather(rain=Rain(8.0))
VIEW = view_at((0.0, -12.0, 2.0), heading=0.0, fov=60.0)
KIND = VehicleType("car", "passenger", 4.6, 1.8, 1.5)


@dataclass(frozen=True)
class Rail:
    """A camera that glides to the east from time 0 on, to time 1."""

    speed: float = 10.0
    shutter: Shutter = INSTANT

    def view_at(self, time):
        if not 0.0 <= time <= 1.0:
            raise ConfigError("not there", key="cameras")
        return View(Transform.from_pose((self.speed * time, 0.0, 1.5)), Lens.of_degrees(60.0))


def test_cameras_without_a_shutter_have_the_stated_exposure():
    assert exposure_of(None) == exposure_of(Rail()) == EXPOSURE
    assert exposure_of(Rail(shutter=Shutter(0.0, 0.02))) == pytest.approx(0.02)


@pytest.mark.parametrize("time", [0.5, 0.0, 1.0])
def test_cameras_move_during_the_exposure_also_at_the_ends_of_their_life(time):
    camera = Rail()
    first, last = _ends(camera, camera.view_at(time), time, 0.02)
    np.testing.assert_allclose((last - first)[:3, 3], (0.2, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(0.5 * (first + last)[0, 3], 10.0 * time, atol=1e-12)


def test_wind_that_changes_carries_by_its_mean():
    moments = tuple(Weather(wind=Wind(speed, 0.0)) for speed in (2.0, 6.0))
    course = WeatherCourse((10.0, 20.0), moments)
    assert carried_by_wind(course, 10.0) == pytest.approx((20.0, 0.0))
    assert carried_by_wind(course, 15.0) == pytest.approx((35.0, 0.0))
    assert carried_by_wind(course, 25.0) == pytest.approx((90.0, 0.0))
    assert carried_by_wind(course, -1.0) == pytest.approx((-2.0, 0.0))
    assert carried_by_wind(WeatherCourse((0.0,), (Weather(),)), 7.0) == (0.0, 0.0)


def test_wipers_turn_faster_in_heavier_rain_and_never_jump():
    even = [WeatherCourse((0.0,), (Weather(rain=Rain(rate)),)) for rate in (1.0, 5.0, 40.0)]
    per_minute = [60.0 * (turned(course, 70.0) - turned(course, 60.0)) / 10.0 for course in even]
    assert per_minute == sorted(per_minute) and per_minute[0] > 8.0 and per_minute[-1] < 70.0
    rising = WeatherCourse((0.0, 30.0), (Weather(rain=Rain(1.0)), Weather(rain=Rain(40.0))))
    turns = [turned(rising, time) for time in np.arange(0.0, 40.0, 0.1)]
    assert np.diff(turns).min() > 0.0 and np.diff(turns).max() < 0.12


@pytest.mark.parametrize(
    ("name", "wet"),
    [("sedan", True), ("rickshaw", True), ("boat", False), ("container", False), ("ferry", False)],
)
def test_only_what_has_a_windscreen_has_a_wet_one(name, wet):
    model = next(model for model in models_for({}) if model.name == name)
    body = build_body(ModelChoice(model, min(model.vclasses), model.size), {})
    cabin, course = Cabin(np.eye(4), np.array(body.size)), WeatherCourse((0.0,), (RAIN,))
    assert (windscreen_of(body, cabin, VIEW, course=course, time=1.0) is not None) == wet


def lamps(count, away=10.0):
    """Lamps in a row, each farther away than the one before."""
    at = np.column_stack([np.zeros(count), away + 0.7 * np.arange(count), np.full(count, 4.0)])
    down = np.tile([0.0, 0.0, -1.0], (count, 1))
    return Glows(at, down, np.ones((count, 3)), np.ones((count, 2)))


def test_only_lamps_that_give_much_light_count_and_none_comes_suddenly():
    found = nearest([Glows(), lamps(60)], VIEW)
    assert 5 < len(found.at) <= MOST_GLOWS
    assert found.intensity[0, 0] == pytest.approx(1.0) and 0.0 < found.intensity[-1, 0] < 0.4
    sums = [nearest([lamps(60, away)], VIEW).intensity.sum() for away in np.arange(10.0, 20.0, 0.1)]
    assert np.abs(np.diff(sums)).max() < 0.5
    assert len(nearest([lamps(5)], VIEW).at) == 5


def drive(speed):
    """A car that drives to the east for ten seconds."""
    times = np.arange(0.0, 10.5, 0.5)
    ones, none = np.ones(len(times)), np.full(len(times), -1)
    places = np.column_stack([speed * (times - 5.0), 0 * times, 0 * times])
    trace = Trace(
        "a", "vehicle", "car", times, places, 0 * ones, speed * ones, 0 * ones, none, none
    )
    made = [smooth(trace, smoother="paper_symmetric", step=1.0)]
    return build_fleet(made, {"car": KIND}, VehicleSettings(), seed=7)


def puffs(fleet, time, wetness=1.0):
    return spray(fleet, fleet.presence.at(time), VIEW, wetness=wetness, wind=(0.0, 0.0))


def test_spray_grows_with_speed_and_water():
    total = [float(puffs(drive(speed), 5.0).depths.sum()) for speed in (5.0, 14.0, 25.0)]
    assert total[0] == 0.0 and 0.0 < 3.0 * total[1] < total[2]
    assert puffs(drive(25.0), 5.0, wetness=0.5).depths.sum() == pytest.approx(0.5 * total[2])
    assert len(puffs(drive(25.0), 5.0, wetness=0.0).at) == 0


def test_spray_lies_behind_the_car_above_the_road():
    fleet = drive(25.0)
    found = puffs(fleet, 5.0)
    front = fleet.presence.at(5.0).positions[0]
    assert (found.at[:, 0] < front[0] - 2.0).all()
    assert (found.at[:, 0] > front[0] - 2.0 - 25.0 * LIFE - 5.0).all()
    assert (found.at[:, 2] > 0.2).all() and (np.abs(found.at[:, 1]) < 1.0).all()


def test_spray_changes_little_by_little():
    fleet = drive(25.0)
    times = np.arange(5.0, 5.4, 0.005)
    sums = np.array([puffs(fleet, time).depths.sum() for time in times])
    assert np.abs(np.diff(sums)).max() < 0.06 * sums.mean()
    # A frame's spray is the same whatever was asked for before.
    again = puffs(fleet, float(times[3]))
    np.testing.assert_array_equal(again.at, puffs(drive(25.0), float(times[3])).at)
