"""Reading the weather: what moments say, and what follows where they do not."""

import math

import pytest

from sumo3dviz_pt.job.surroundings import WeatherSettings
from sumo3dviz_pt.model.weather import CONTRAST, Rain, Wind
from sumo3dviz_pt.world.weather import weather_course


def course(**settings):
    """The weather over time of a scene file."""
    return weather_course(WeatherSettings.model_validate(settings), base=12.0)


def test_nothing_said_is_no_weather():
    assert weather_course(None) is None and course() is None


def test_fog_begins_above_the_ground():
    fog = course(fog={"visibility": 200}).first.fog
    assert fog.extinction == pytest.approx(CONTRAST / 200.0) and fog.base == 12.0
    assert fog.height == math.inf
    assert course(fog={"visibility": 200, "height": 60}).first.fog.height == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("settings", "wetness", "puddles"),
    [
        ({"rain": {"rate": 5}}, 1.0, 0.5),
        ({"rain": {"rate": 0}}, 0.0, 0.0),
        ({"rain": {"rate": 5}, "wetness": 0.6}, 0.6, 0.3),
        ({"wetness": 0.6, "puddles": 0.1}, 0.6, 0.1),
        ({"fog": {"visibility": 100}}, 0.0, 0.0),
    ],
)
def test_wetness_follows_rain_and_puddles_follow_wetness(settings, wetness, puddles):
    found = course(**settings).first
    assert (found.wetness, found.puddles) == pytest.approx((wetness, puddles))


def test_each_key_goes_by_the_moments_that_give_it():
    found = course(
        rain={"rate": 8},
        wind={"speed": 4, "from": 180},
        course=[
            {"time": 10, "fog": {"visibility": 100_000}},
            {"time": 20, "snow": {"falling": 2}},
            {"time": 30, "fog": {"visibility": 100}, "wind": {"speed": 8}},
        ],
    )
    assert found.times == (10.0, 20.0, 30.0)
    assert found.at(20.0).fog.extinction == pytest.approx(CONTRAST / 200.0)
    assert all(moment.rain == Rain(8.0) for moment in found.moments)
    assert all(moment.snow.falling == 2.0 for moment in found.moments)
    assert all(moment.wind.speed == pytest.approx(8.0) for moment in found.moments)
    assert isinstance(found.first.wind, Wind) and found.first.wind.north > 0.0
