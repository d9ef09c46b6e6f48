"""The sky in weather: clouds that rain falls from, and one exposure for less light."""

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.model.weather import CONTRAST, Fog, Rain, Snow, Weather, WeatherCourse, left
from sumo3dviz_pt.world.sky import build_sky
from sumo3dviz_pt.world.weather import in_weather

DAY, DUSK, NIGHT = (
    build_sky(SkySettings(preset=name)) for name in ("sky_blue", "sky_dusk", "sky_night3")
)
RAIN, FOG = Weather(rain=Rain(5.0)), Weather(fog=Fog(CONTRAST / 50.0, 80.0))


def under(sky, *moments):
    """A sky in a weather that is the same, or changes."""
    return in_weather(sky, WeatherCourse(tuple(float(k) for k in range(len(moments))), moments))


def test_a_sky_without_weather_is_the_same_object():
    assert in_weather(DAY, None) is DAY


def test_rain_brings_clouds_and_makes_the_exposure_longer():
    sky = under(DAY, RAIN)
    assert sky.overcast is not None and DAY.overcast is None
    assert 1.0 < sky.exposure - DAY.exposure < 2.5


def test_dense_fog_is_shown_as_light_grey():
    """Not as white: that would be an exposure for what lies behind."""
    share = left(FOG, float(DAY.sun_direction[2]))
    shown = share * 2.0 ** (under(DAY, FOG).exposure - DAY.exposure)
    assert shown == pytest.approx(0.45, rel=0.05) and under(DAY, FOG).overcast is None


def test_rain_clouds_have_no_gaps():
    """Through the least of them the evening sky behind would sparkle."""
    assert under(DUSK, RAIN).overcast.cover.min() == 1.0


def test_a_dusk_in_rain_is_no_night():
    """Lamps count, but the sky does, too, until nautical twilight ends."""
    gains = [under(sky, RAIN).exposure - sky.exposure for sky in (NIGHT, DUSK, DAY)]
    assert gains[0] == 0.0 and 0.8 < gains[1] < 0.7 * gains[2]


def test_by_night_lamps_say_what_the_exposure_is():
    assert all(under(NIGHT, each).exposure == NIGHT.exposure for each in (RAIN, FOG))


def test_one_exposure_is_for_all_of_a_course():
    dry, wet = Weather(rain=Rain(0.0)), RAIN
    both = under(DAY, dry, wet).exposure - DAY.exposure
    assert both == pytest.approx(0.5 * (under(DAY, wet).exposure - DAY.exposure))


def test_snow_on_the_ground_makes_dull_days_brighter():
    bare, white = (Weather(snow=Snow(depth, falling=1.0)) for depth in (0.0, 0.1))
    assert left(white, 0.5) > 1.2 * left(bare, 0.5)


@pytest.mark.parametrize("sine", [0.0, 0.05, 0.5, 1.0])
def test_weather_never_makes_light(sine):
    """Not even with all that ground and clouds send to and fro; more rain never brings more."""
    for weather in (RAIN, FOG, Weather(fog=Fog(1e-5)), Weather(snow=Snow(0.1, falling=2.0))):
        assert 0.0 < left(weather, sine) <= 1.0 + 1e-3
    rates = [left(Weather(rain=Rain(rate)), sine) for rate in (0.0, 0.05, 0.1, 1.0, 10.0, 100.0)]
    assert all(np.diff(rates) <= 1e-9)


def test_snow_is_exposed_for():
    """By day and where it hides the ground; lamps by night are for what they light."""
    clear = build_sky(SkySettings(preset="sky_blue"))
    course = WeatherCourse((0.0,), (Weather(snow=Snow(depth=0.05), season="winter"),))
    assert in_weather(clear, course).exposure == pytest.approx(clear.exposure - 0.6, abs=1e-6)
    assert in_weather(NIGHT, course).exposure == NIGHT.exposure
