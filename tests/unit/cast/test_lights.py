"""Which lamps of a vehicle shine, and how brightly."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.cast.lamps import DerivedLamps, in_fog, running_lights, vehicle_lights
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Prototype, VehicleLamp
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.weather import CONTRAST, Fog, Rain, Snow, Weather, WeatherCourse

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def trace(bits=-1, *, name="a", kind="vehicle"):
    ones = np.ones(3)
    signals = np.broadcast_to(bits, 3).astype(int)
    times = np.arange(3.0)
    return Trace(name, kind, "", times, np.zeros((3, 3)), ones, ones, ones, signals * 0, signals)


def lit(bits=-1, *, dark=False, time=1.0, derived=()):
    lights = vehicle_lights([trace(bits)], dark=dark, seed=3)
    spans = dict.fromkeys(derived, ((0.0, 100.0),))
    return lights.lit("vehicle:a", time, derived=lambda: DerivedLamps(spans))


def test_by_day_nothing_shines_without_a_reason():
    assert lit() == frozenset()


def test_by_night_everybody_has_lights_on():
    assert {"head", "tail"} <= lit(dark=True)
    assert {"head", "tail"} <= lit(0, dark=True), "whatever the log says"


def test_the_sign_of_a_taxi_is_off_while_people_ride_in_it():
    lights = vehicle_lights([trace()], dark=True, seed=3, taken={"vehicle:a": ((0.5, 1.5),)})
    signs = [
        "sign" in lights.lit("vehicle:a", time, derived=lambda: DerivedLamps({}))
        for time in (0.0, 1.0, 2.0)
    ]
    assert signs == [True, False, True]


def test_where_the_log_says_nothing_the_motion_does():
    assert lit(derived=["brake", "reverse"]) == {"brake", "reverse"}
    assert lit(dark=True, derived=["brake"]) > {"brake", "tail"}
    shown = [lit(derived=["left"], time=t) for t in np.arange(0.0, 2.0, 0.01)]
    assert {frozenset(), frozenset(["left"])} == set(shown)


def test_the_log_knows_better():
    assert "brake" not in lit(0, derived=["brake"])
    assert "brake" in lit(8)
    assert lit([0, 0, 8], time=-1.0) == frozenset(), "before its first row"
    assert lit([0, 0, 8], time=2.5) == {"brake"}, "after its last row"


def test_a_row_of_the_log_tells_of_the_step_before_it():
    assert lit([8, 0, 0], time=0.0) == {"brake"}
    assert lit([8, 0, 0], time=0.1) == frozenset(), "who sets off has released the brake"
    assert lit([0, 8, 0], time=0.1) == {"brake"}
    assert lit([0, 8, 0], time=1.0) == {"brake"}
    assert lit([0, 8, 0], time=1.1) == frozenset()


def test_indicators_blink():
    times = np.arange(0, 2, 0.01)
    shown = np.array(["right" in lit(1, time=t) for t in times])
    assert shown.mean() == pytest.approx(0.5, abs=0.02)
    changes = np.count_nonzero(np.diff(shown))
    assert changes in (5, 6, 7), "1.5 a second"
    both = [lit(4, time=t) for t in times]
    assert all(("left" in roles) == ("right" in roles) for roles in both)
    assert any("left" in roles for roles in both)


def test_blue_lamps_flash_twice_and_only_as_logged():
    times = np.arange(0.0, 10.0, 0.01)
    shown = np.array(["blue" in lit(2048, time=t) for t in times])
    assert shown.mean() == pytest.approx(0.4, abs=0.02)
    assert np.count_nonzero(np.diff(shown)) == pytest.approx(80, abs=2)
    assert "blue" not in lit(8192 + 4096)


def test_a_later_vehicle_with_the_same_id_has_its_own_log():
    later = trace(8)
    lights = vehicle_lights([trace(0), later], dark=False, seed=3)
    none = DerivedLamps({})
    assert lights.lit("vehicle:a", 1.0, derived=lambda: none) == frozenset()
    assert lights.lit("vehicle:a#2", 1.0, derived=lambda: none) == {"brake"}


def body(*roles):
    lamps = tuple(VehicleLamp(role, (0.0, 0.0, 0.7), (0.1, 0.1), 0.0) for role in roles)
    return Prototype("body", (), (), lamps)


def test_scenes_without_lamps_have_none():
    assert running_lights([body()], dark=True, left_hand=False) is None
    assert running_lights([body("head", "tail")], dark=False, left_hand=False) is None


def test_beams_are_for_the_night():
    day = running_lights([body("head", "brake")], dark=False, left_hand=False)
    assert day is not None and day.beam is None and not day.sampled
    assert set(day.intensity) == {"brake"}
    night = running_lights([body("head", "brake")], dark=True, left_hand=False)
    assert night is not None and night.beam is not None and night.sampled


def test_intensities_are_candelas():
    lights = running_lights([body("tail", "brake", "head")], dark=True, left_hand=False)
    assert lights is not None
    candelas = {
        role: float(np.array(power) @ LUMINANCE) * CANDELAS_PER_UNIT
        for role, power in lights.intensity.items()
    }
    assert 4 <= candelas["tail"] <= 17
    assert 60 <= candelas["brake"] <= 260
    assert candelas["brake"] > 5 * candelas["tail"]
    assert lights.beam is not None
    peak = float(np.array(lights.beam.intensity) @ LUMINANCE) * CANDELAS_PER_UNIT
    assert peak == pytest.approx(36_000, rel=1e-6)


def weather(**parts):
    """A weather that does not change."""
    return WeatherCourse((0.0,), (Weather(**parts),))


@pytest.mark.parametrize(
    ("parts", "roles"),
    [
        ({"rain": Rain(5.0)}, {"head", "tail"}),
        ({"rain": Rain(0.1)}, set()),
        ({"snow": Snow(0.1, falling=1.0)}, {"head", "tail"}),
        ({"snow": Snow(0.1)}, set()),
        ({"fog": Fog(CONTRAST / 200.0)}, {"head", "tail"}),
        ({"fog": Fog(CONTRAST / 50.0)}, {"head", "tail", "fog", "front_fog"}),
        ({"wetness": 1.0}, set()),
    ],
)
def test_lamps_are_lit_by_day_where_weather_hides_much(parts, roles):
    lights = vehicle_lights([trace(0)], dark=False, seed=3, weather=weather(**parts))
    assert lights.lit("vehicle:a", 5.0, derived=lambda: None) == roles


def test_lamps_follow_the_weather_of_the_time():
    course = WeatherCourse((0.0, 10.0), (Weather(rain=Rain(0.0)), Weather(rain=Rain(5.0))))
    lights = vehicle_lights([trace(0)], dark=False, seed=3, weather=course)
    lit = [lights.lit("vehicle:a", time, derived=lambda: None) for time in (0.1, 9.0)]
    assert lit == [set(), {"head", "tail"}]


def test_rear_fog_lamps_are_there_in_dense_fog_alone():
    bodies = {"car": body("tail", "tail", "head")}
    dense, thin = (weather(fog=Fog(CONTRAST / sight)) for sight in (50.0, 300.0))
    assert in_fog(bodies, thin, left_hand=False) is bodies
    assert in_fog(bodies, None, left_hand=False) is bodies
    (shown,) = in_fog(bodies, dense, left_hand=False).values()
    assert [lamp.role for lamp in shown.lamps].count("fog") == 1
    lights = running_lights([shown], dark=False, left_hand=False, weather=dense)
    assert set(lights.intensity) == {"head", "tail", "fog"} and lights.beam is None
    assert not lights.sampled
    assert "front_fog" not in {lamp.role for lamp in shown.lamps}, "it has one head lamp"
    bicycle = {"bicycle": body("tail", "head")}
    (same,) = in_fog(bicycle, dense, left_hand=False).values()
    assert same is bicycle["bicycle"]


def test_front_fog_lamps_are_a_pair_below_the_head_lamps():
    heads = [VehicleLamp("head", (-0.1, y, 0.7), (0.1, 0.1), 0.0) for y in (0.6, 0.4, -0.4, -0.6)]
    car = Prototype("car", (), (), tuple(heads))
    (shown,) = in_fog({"car": car}, weather(fog=Fog(CONTRAST / 50.0)), left_hand=False).values()
    found = [lamp for lamp in shown.lamps if lamp.role == "front_fog"]
    assert sorted(lamp.at[1] for lamp in found) == pytest.approx([-0.48, 0.48])
    assert all(lamp.at[2] < 0.5 and lamp.yaw == 0.0 for lamp in found)


@pytest.mark.parametrize("left_hand", [False, True])
def test_a_single_rear_fog_lamp_is_on_the_side_of_oncoming_traffic(left_hand):
    """UN Regulation 48, 6.11.4.1; +y is the body's left."""
    tails = tuple(VehicleLamp("tail", (-4.0, y, 0.8), (0.1, 0.1), np.pi) for y in (-0.7, 0.7))
    dense = weather(fog=Fog(CONTRAST / 50.0))
    (shown,) = in_fog({"car": Prototype("car", (), (), tails)}, dense, left_hand=left_hand).values()
    (fog,) = [lamp for lamp in shown.lamps if lamp.role == "fog"]
    assert (fog.at[1] > 0.0) != left_hand
