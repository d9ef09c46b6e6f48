"""The weather as values: what is in the air, and what is between two moments."""

import math

import numpy as np
import pytest

from sumo3dviz_pt.model.weather import CONTRAST, Fog, Rain, Snow, Weather, WeatherCourse, Wind


def test_visibility_is_where_two_per_cent_of_contrast_are_left():
    fog = Fog(CONTRAST / 200.0)
    assert fog.visibility == pytest.approx(200.0)
    assert math.exp(-fog.extinction * 200.0) == pytest.approx(0.02)
    assert Fog(0.0).visibility == math.inf


@pytest.mark.parametrize(("rate", "per_km"), [(10.0, 1.46), (50.0, 4.29), (0.0, 0.0)])
def test_rain_hardly_takes_light_away(rate, per_km):
    assert Rain(rate).falling_extinction * 1000.0 == pytest.approx(per_km, abs=0.01)


@pytest.mark.parametrize(("rate", "sight"), [(1.0, 1000.0), (2.5, 500.0)])
def test_snowfall_hides_what_the_classes_of_snow_say(rate, sight):
    """By 5 % of contrast, which meteorologists take."""
    seen = -math.log(0.05) / Snow(falling=rate).falling_extinction
    assert sight * 0.75 < seen < sight * 1.05


def test_wind_comes_from_its_bearing():
    west, north = (Wind.coming(5.0, math.radians(bearing)) for bearing in (270.0, 0.0))
    assert np.allclose([west.east, west.north], [5.0, 0.0])
    assert np.allclose([north.east, north.north], [0.0, -5.0])


def test_numbers_between_moments_are_interpolated():
    early = Weather(Fog(0.0), Rain(2.0), 0.2, 0.0, Snow(0.02, "covered", 0.0), Wind(1.0, 0.0))
    late = Weather(Fog(0.02, 50.0), Rain(4.0), 1.0, 0.4, Snow(0.04, "tracked", 1.0), Wind(0.0, 3.0))
    course = WeatherCourse((10.0, 20.0), (early, late))
    half = course.at(15.0)
    assert half.fog == Fog(0.01, 100.0) and half.rain == Rain(3.0)
    assert half.wetness == pytest.approx(0.6) and half.puddles == pytest.approx(0.2)
    assert half.snow.depth == pytest.approx(0.03) and half.snow.roads == "covered"
    assert half.wind == Wind(0.5, 1.5)
    assert course.at(0.0) == early and course.at(10.0) == early
    assert course.at(20.0) == late and course.at(99.0) == late
    assert course.changes and course.is_foggy and course.rains and course.snows


def test_moments_have_the_same_kinds():
    with pytest.raises(ValueError, match="same kinds"):
        WeatherCourse((0.0, 1.0), (Weather(), Weather(rain=Rain(1.0))))
